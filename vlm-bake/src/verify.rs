//! Stage 6: proves that no light lights the surface that it stands for, and that none comes out on another side of its object.
//!
//! A light fails
//! - where it lights one of the surface points for which it stands, or comes nearer to that than the clearance
//!   ([`crate::clearance::self_lighting`]);
//! - where a corner, the middle of an edge or its centre lies in front of another side of its own island
//!   ([`IslandDistance`]): a side that faces more than 60 degrees away from the light. In front of its own side it may lie: there it
//!   bridges a recess.
//!
//! A light that fails is first mended: it sinks along its own normal as deep as its points ask for and the island allows. What
//! then still fails is tagged by the next stage.

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::clearance::{rise, self_lighting};
use crate::decimate::LightMesh;
use crate::patches::{Patches, Region};
use crate::refine::Light;
use crate::signed_distance::IslandDistance;
use crate::surface::{Standing, SurfacePoint};

/// A light comes out of its island when it lies less than this share of the clearance behind it: a mitred vertex at a sharp edge
/// may be nearer to the edge than to either face.
const POKE_SHARE: f64 = 0.25;

/// The cosine below which a side of an island is another side than that for which a light stands.
const OTHER_SIDE_COSINE: f64 = 0.5;

/// Why a light fails, and by how much.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Violation {
    /// The light.
    pub light: u32,
    /// Number of surface points that it lights.
    pub points: u32,
    /// By how much it would have to move, metres.
    pub depth: f64,
    /// Where it is worst, world space.
    pub place: DVec3,
    /// It comes out on another side of its object.
    pub pokes_out: bool,
}

/// The result of the check, as the report shows it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ClearanceReport {
    /// Surface points checked.
    pub samples: u64,
    /// Surface points lit by their own light, and lights that come out, where no tag keeps that light away.
    pub violations: u64,
    /// The greatest distance by which a violating light would have to move, metres.
    pub worst_m: f64,
    /// The clearance asked for, metres.
    pub required_m: f64,
}

/// All that the check looks at.
pub struct Evidence<'a> {
    /// The visible surface.
    pub patches: &'a Patches,
    /// The faces of which the lights are parts.
    pub mesh: &'a LightMesh,
    /// Points on the visible surface.
    pub points: &'a [SurfacePoint],
    /// Which of them each light stands for.
    pub standing: &'a Standing,
    /// Sides of the islands.
    pub distance: &'a IslandDistance<'a>,
    /// Required distance behind the surface, metres.
    pub clearance: f64,
}

impl<'a> Evidence<'a> {
    fn region(&self, light: &Light) -> &Region {
        &self.patches.regions[self.mesh.faces[light.face as usize].region as usize]
    }

    fn own_points(&self, light: usize) -> impl Iterator<Item = &'a SurfacePoint> {
        self.standing.of(light).iter().map(|&p| &self.points[p as usize])
    }
}

/// Sinks the lights that fail by at most `deepest` metres along their own normals; a light that this does not clear stays
/// where it was. Lights of two-sided surfaces stay too: nothing lies behind such a surface.
pub fn sink(lights: &mut [Light], evidence: &Evidence, deepest: f64) {
    lights.par_iter_mut().enumerate().for_each(|(l, light)| {
        if evidence.region(light).two_sided || judge(l, light, evidence).is_none() {
            return;
        }
        let normal = light.normal();
        let depth = evidence
            .own_points(l)
            .filter(|point| self_lighting(&light.corners, normal, point, evidence.clearance) > 0.0)
            .map(|point| (rise(&light.corners, point) + 1.1 * evidence.clearance) / point.normal.dot(normal))
            .fold(0.0, f64::max);
        let sunk = Light { corners: light.corners.map(|p| p - normal * depth), ..*light };
        if depth > 0.0 && depth <= deepest && judge(l, &sunk, evidence).is_none() {
            *light = sunk;
        }
    });
}

/// Every light that fails, ascending. Lights of two-sided surfaces fail where they light their own points.
#[must_use]
pub fn verify(lights: &[Light], evidence: &Evidence) -> Vec<Violation> {
    lights.par_iter().enumerate().filter_map(|(l, light)| judge(l, light, evidence)).collect()
}

/// What is wrong with a light, if anything.
fn judge(number: usize, light: &Light, evidence: &Evidence) -> Option<Violation> {
    let mut violation = lit_points(number, light, evidence);
    let region = evidence.region(light);
    if !region.two_sided {
        poke(light, region.island, evidence, &mut violation);
    }
    (violation.points > 0 || violation.pokes_out).then_some(violation)
}

/// The points of a light that it lights.
fn lit_points(number: usize, light: &Light, evidence: &Evidence) -> Violation {
    let normal = light.normal();
    let mut violation = Violation { light: number as u32, ..Violation::default() };
    for point in evidence.own_points(number) {
        let depth = self_lighting(&light.corners, normal, point, evidence.clearance);
        if depth > 0.0 {
            violation.points += 1;
            if depth > violation.depth {
                (violation.depth, violation.place) = (depth, point.position);
            }
        }
    }
    violation
}

/// Looks for places of a light that lie in front of another side of its island.
fn poke(light: &Light, island: u32, evidence: &Evidence, violation: &mut Violation) {
    let [a, b, c] = light.corners;
    let (normal, room) = (light.normal(), POKE_SHARE * evidence.clearance);
    for place in [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0] {
        let other_side =
            evidence.distance.at(place, island).filter(|n| n.normal.dot(normal) < OTHER_SIDE_COSINE);
        let out = other_side.map_or(f64::NEG_INFINITY, |n| n.signed + room);
        if out > 0.0 {
            violation.pokes_out = true;
            if out > violation.depth {
                (violation.depth, violation.place) = (out, place);
            }
        }
    }
}

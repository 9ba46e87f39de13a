//! Stage 7: proves that no light lights the surface for which it stands, and that none comes out on another side of its object.
//! `docs/behind-the-geometry.md` has the definition in words.
//!
//! A light fails
//! - where it lights one of the surface points for which it stands ([`crate::correspondence`]), or comes nearer to that than
//!   the clearance ([`crate::clearance::self_lighting`]);
//! - where the straight way from one of these points through the solid to the nearest place of the light leads out into the
//!   open on another side ([`crate::way_out`]), or would with a little more depth;
//! - where a corner, the middle of an edge or its centre lies in front of another side of its own island
//!   ([`IslandDistance`]): a side that faces more than 60 degrees away from the light. In front of its own side it may lie: there it
//!   bridges a recess.

use glam::{DVec3, Vec3, Vec3A};
use rayon::prelude::*;
use serde::Serialize;

use crate::bvh::nearest::closest_point;
use crate::clearance::self_lighting;
use crate::correspondence::{Light, Standing};
use crate::patches::{Patches, Region};
use crate::signed_distance::IslandDistance;
use crate::surface::SurfacePoint;
use crate::way_out::WayOut;

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
    pub dbg: [bool;3],
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
    /// Points on the visible surface.
    pub points: &'a [SurfacePoint],
    /// Which of them each light stands for.
    pub standing: &'a Standing,
    /// Sides of the islands.
    pub distance: &'a IslandDistance<'a>,
    /// Ways out of objects.
    pub way_out: &'a WayOut,
    /// Required distance behind the surface, metres.
    pub clearance: f64,
}

impl<'a> Evidence<'a> {
    fn region(&self, light: &Light) -> &Region {
        &self.patches.regions[light.region as usize]
    }

    /// The surface points of a light.
    pub fn own_points(&self, light: usize) -> impl Iterator<Item = &'a SurfacePoint> {
        self.standing.of(light).iter().map(|&p| &self.points[p as usize])
    }
}

/// Every light that fails, ascending. Lights of two-sided surfaces fail where they light their own points.
#[must_use]
pub fn verify(lights: &[Light], evidence: &Evidence) -> Vec<Violation> {
    lights.par_iter().enumerate().filter_map(|(l, light)| judge(l, light, evidence)).collect()
}

/// What is wrong with a light, if anything.
#[must_use]
pub fn judge(number: usize, light: &Light, evidence: &Evidence) -> Option<Violation> {
    let mut violation = lit_points(number, light, evidence);
    if !evidence.region(light).two_sided {
        violation.dbg[0] = violation.points > 0;
        poke_between(number, light, evidence, &mut violation);
        violation.dbg[1] = violation.pokes_out;
        let b = violation.pokes_out; violation.pokes_out=false;
        poke_beside(light, evidence, &mut violation);
        violation.dbg[2] = violation.pokes_out;
        violation.pokes_out |= b;
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

/// Looks for surface between a light's points and the light.
fn poke_between(number: usize, light: &Light, evidence: &Evidence, violation: &mut Violation) {
    let normal = light.normal();
    for point in evidence.own_points(number) {
        let before = (point.position - light.corners[0]).dot(normal);
        // A point behind its light lies in a recess that the light bridges.
        if before <= 0.0 {
            continue;
        }
        let corners = light.corners.map(|v| (v - point.position).as_vec3a());
        let place = point.position + Vec3::from(closest_point(&corners, Vec3A::ZERO)).as_dvec3();
        if leads_out(point, place, evidence) {
            violation.pokes_out = true;
            let depth = place.distance(point.position);
            if depth > violation.depth {
                (violation.depth, violation.place) = (depth, point.position);
            }
        }
    }
}

/// True if the way from a surface point to a place behind it leads out on another side.
fn leads_out(point: &SurfacePoint, place: DVec3, evidence: &Evidence) -> bool {
    let least = evidence.way_out.least_length();
    let start = point.position - point.normal * least;
    let Some(direction) = (place - start).try_normalize() else { return false };
    let end = place + direction * (POKE_SHARE * evidence.clearance);
    let own = evidence.patches.triangle_source[point.triangle as usize];
    evidence.way_out.leads_out(start, end, |triangle| triangle == own)
}

/// Looks for places of a light that lie in front of another side of its island.
fn poke_beside(light: &Light, evidence: &Evidence, violation: &mut Violation) {
    let [a, b, c] = light.corners;
    let (normal, room) = (light.normal(), POKE_SHARE * evidence.clearance);
    let island = evidence.region(light).island;
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

//! Stage 6: proves that no face lights the surface that it stands for, and that none comes out on another side of its object.
//!
//! A face fails
//! - where it lights one of the surface points for which it stands, or comes nearer to that than the clearance
//!   ([`crate::clearance::self_lighting`]);
//! - where a corner, the middle of an edge or its centre lies in front of its own island ([`IslandDistance`]).

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::clearance::self_lighting;
use crate::decimate::LightMesh;
use crate::patches::Patches;
use crate::signed_distance::IslandDistance;
use crate::surface::{Standing, SurfacePoint};

/// A face comes out of its island when it lies less than this share of the clearance behind it: a mitred vertex at a sharp edge
/// may be nearer to the edge than to either face.
const POKE_SHARE: f64 = 0.25;

/// Why a face fails, and by how much.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Violation {
    /// The face.
    pub face: u32,
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
    /// Surface points lit by their own face, and faces that come out, where no tag keeps that light away.
    pub violations: u64,
    /// The greatest distance by which a violating face would have to move, metres.
    pub worst_m: f64,
    /// The clearance asked for, metres.
    pub required_m: f64,
}

/// Every face that fails, ascending. Faces of two-sided surfaces always fail: nothing lies behind such a surface.
#[must_use]
pub fn verify(
    mesh: &LightMesh,
    patches: &Patches,
    points: &[SurfacePoint],
    standing: &Standing,
    distance: &IslandDistance,
    clearance: f64,
) -> Vec<Violation> {
    (0..mesh.faces.len())
        .into_par_iter()
        .filter_map(|f| {
            let own = standing.of(f).iter().map(|&p| &points[p as usize]);
            let mut violation = lit_points(mesh, f, own, clearance);
            let region = patches.regions[mesh.faces[f].region as usize];
            if !region.two_sided {
                poke(mesh, f, region.island, distance, clearance, &mut violation);
            }
            (violation.points > 0 || violation.pokes_out).then_some(violation)
        })
        .collect()
}

/// The points of a face that it lights.
fn lit_points<'a>(
    mesh: &LightMesh,
    face: usize,
    points: impl Iterator<Item = &'a SurfacePoint>,
    clearance: f64,
) -> Violation {
    let (light, normal) = (mesh.corners(face), mesh.normal(face));
    let mut violation = Violation { face: face as u32, ..Violation::default() };
    for point in points {
        let depth = self_lighting(&light, normal, point, clearance);
        if depth > 0.0 {
            violation.points += 1;
            if depth > violation.depth {
                (violation.depth, violation.place) = (depth, point.position);
            }
        }
    }
    violation
}

/// Looks for places of a face that lie in front of its island.
fn poke(
    mesh: &LightMesh,
    face: usize,
    island: u32,
    distance: &IslandDistance,
    clearance: f64,
    violation: &mut Violation,
) {
    let [a, b, c] = mesh.corners(face);
    for place in [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0] {
        let out = distance.at(place, island).map_or(f64::NEG_INFINITY, |n| n.signed + POKE_SHARE * clearance);
        if out > 0.0 {
            violation.pokes_out = true;
            if out > violation.depth {
                (violation.depth, violation.place) = (out, place);
            }
        }
    }
}

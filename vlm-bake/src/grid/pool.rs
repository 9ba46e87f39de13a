//! Places where probes may be: spread evenly over the surface that free space sees.

use glam::Vec3;
use rayon::prelude::*;

use crate::bvh::Hit;
use crate::reference::directions_above;
use crate::shade::{SurfacePoint, TraceScene};
use crate::surface::{area_steps, uniform_barycentric};
use crate::topology::area;

/// Places per probe. Higher values place probes more evenly and find smaller surfaces; each takes [`LOOKS`] rays.
const PLACES_PER_PROBE: u32 = 10;

/// At least so many places, unless the options ask for another number.
pub const LEAST_PLACES: u32 = 40_000;

/// Rays by which a place looks around.
const LOOKS: u32 = 24;

/// Places from which this share of directions meets backs lie inside something.
const MOST_BACKS: f32 = 0.5;

/// A place on exposed surface.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The place itself.
    pub surface: SurfacePoint,
    /// The area for which it stands, square metres.
    pub area: f32,
    /// Harmonic mean distance of what it sees, metres (Ward, Rubinstein, Clear 1988): light changes over about this distance.
    pub openness: f32,
}

/// Spreads places over all visible surface, and leaves out those that lie inside of something.
#[must_use]
pub fn pool(trace: &TraceScene, probes: u32, least: u32) -> Vec<Place> {
    let scene = trace.scene;
    let corners = |t: usize| scene.corners(t).unwrap_or_default().map(Vec3::as_dvec3);
    let areas: Vec<f64> = (0..scene.triangles.len())
        .into_par_iter()
        .map(|t| if trace.lit_sides(t as u32)[0] { area(corners(t)) } else { 0.0 })
        .collect();
    let count = probes.saturating_mul(PLACES_PER_PROBE).max(least);
    let (drawn, step) = area_steps(&areas, count as usize);
    let looked = drawn.par_iter().enumerate().flat_map_iter(|(i, &triangle)| {
        let barycentric = off_edges(uniform_barycentric(i as u64));
        let [front, back] = trace.lit_sides(triangle);
        let sides = [(front, true), (back, false)].into_iter().filter(|(lit, _)| *lit);
        sides.filter_map(move |(_, front)| {
            let hit = Hit { triangle, distance: 0.0, barycentric, front };
            let surface = trace.surface(&hit, 0.0)?;
            look(trace, surface, step as f32, i as u64)
        })
    });
    looked.collect()
}

/// A place on the very edge of a triangle moves inward: from the line where two walls meet, neither is seen.
fn off_edges(barycentric: Vec3) -> Vec3 {
    const LEAST: f32 = 1e-5;
    if barycentric.min_element() >= LEAST {
        return barycentric;
    }
    let moved = barycentric.max(Vec3::splat(LEAST));
    moved / moved.element_sum()
}

/// Looks around from a place; `None` inside of something.
fn look(trace: &TraceScene, surface: SurfacePoint, area: f32, seed: u64) -> Option<Place> {
    let origin = trace.bvh.leave(surface.position, surface.geometric_normal);
    let (mut backs, mut inverse) = (0.0, 0.0);
    for direction in directions_above(&surface, LOOKS, seed) {
        if let Some(hit) = trace.path_hit(origin, direction) {
            backs += f32::from(u8::from(!trace.is_lit_side(&hit)));
            inverse += 1.0 / hit.distance.max(f32::MIN_POSITIVE);
        }
    }
    let openness = if inverse > 0.0 { LOOKS as f32 / inverse } else { f32::INFINITY };
    (backs < MOST_BACKS * LOOKS as f32).then_some(Place { surface, area, openness })
}

//! What share of a probe's light comes from which light, by rays over its hemisphere.

use glam::Mat3;
use rayon::prelude::*;

use super::{GridInput, StandIns};
use super::pool::Place;
use crate::progress::Progress;
use crate::reference::cosine_directions;
use crate::shade::{SurfacePoint, TraceScene};

/// Irradiance per radiosity by light, ascending by light.
pub type Row = Vec<(u32, f32)>;

/// The rows of places, each from `rays` directions. Surface in each direction stands for the light that stands for it, so a row knows
/// what is hidden from its place, and its sum over lights is what their surface would give.
#[must_use]
pub fn rows(input: &GridInput, places: &[Place], rays: u32, progress: &dyn Progress) -> Vec<Row> {
    let row = |(i, place): (usize, &Place)| {
        progress.advance(1);
        transport(input.trace, input.stand_ins, &place.surface, rays, i as u64)
    };
    places.par_iter().enumerate().map(row).collect()
}

/// The row of one place; `seed` chooses its directions.
#[must_use]
pub fn transport(trace: &TraceScene, stand_ins: &StandIns, surface: &SurfacePoint, rays: u32, seed: u64) -> Row {
    let origin = trace.bvh.leave(surface.position, surface.geometric_normal);
    let (tangent, bitangent) = surface.normal.any_orthonormal_pair();
    let mut row: Row = Vec::with_capacity(rays as usize);
    let frame = Mat3::from_cols(tangent, bitangent, surface.normal);
    for local in cosine_directions(rays, seed) {
        let direction = frame * local;
        if direction.dot(surface.geometric_normal) <= 0.0 {
            continue;
        }
        let hit = trace.path_hit(origin, direction).filter(|hit| trace.is_lit_side(hit));
        let light = hit.and_then(|hit| stand_ins.light_at(hit.triangle, hit.barycentric, hit.front));
        row.extend(light.map(|(light, ratio)| (light, ratio / rays as f32)));
    }
    row.sort_unstable_by_key(|(light, _)| *light);
    row.dedup_by(|next, first| {
        let same = next.0 == first.0;
        first.1 += if same { next.1 } else { 0.0 };
        same
    });
    row
}

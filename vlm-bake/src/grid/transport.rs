//! What share of a probe's light comes from which surface, by rays over its hemisphere.

use glam::Vec3;
use rayon::prelude::*;
use vlm_shaders::cpu::upload::LightSet;

use super::pool::Place;
use super::{GridInput, StandIns, made_lights};
use crate::progress::Progress;
use crate::reference::directions_above;
use crate::shade::{SurfacePoint, TraceScene};

/// Irradiance per radiosity by source, ascending by source: samples, then lights.
pub type Row = Vec<(u32, f32)>;

/// A light that seems smaller than this (edge over distance) counts as one source, a larger one by its samples. Lower values follow
/// shadows on far surface more closely, and make rows longer.
const WHOLE: f32 = 0.2;

/// The rows of places, each from `rays` directions. The surface in each direction is a source's, so a row knows what is hidden from its
/// place, and its sum is the share of directions that meet surface.
#[must_use]
pub fn rows(input: &GridInput, places: &[Place], rays: u32, progress: &dyn Progress) -> Vec<Row> {
    let made = made_lights::made_lights(input);
    let row = |(i, place): (usize, &Place)| {
        if progress.is_cancelled() {
            return Row::new();
        }
        progress.advance(1);
        let row = transport(input.trace, input.stand_ins, &place.surface, rays, i as u64);
        let mut row = whole_lights(input, place.surface.position, &row);
        made_lights::add(input, &made, place, &mut row);
        row
    };
    places.par_iter().enumerate().map(row).collect()
}

/// The row of one place, over samples alone; `seed` chooses its directions.
#[must_use]
pub fn transport(
    trace: &TraceScene,
    stand_ins: &StandIns,
    surface: &SurfacePoint,
    rays: u32,
    seed: u64,
) -> Row {
    let origin = trace.bvh.leave(surface.position, surface.geometric_normal);
    shares(trace, stand_ins, origin, directions_above(surface, rays, seed), rays, |_| ())
}

/// The share of `rays` that each sample gets of the light along some directions; those that meet one are shown to `found`.
pub fn shares(
    trace: &TraceScene,
    stand_ins: &StandIns,
    origin: Vec3,
    directions: impl Iterator<Item = Vec3>,
    rays: u32,
    mut found: impl FnMut(Vec3),
) -> Row {
    let mut met: Vec<u32> = Vec::with_capacity(rays as usize);
    for direction in directions {
        let hit = trace.path_hit(origin, direction).filter(|hit| trace.is_lit_side(hit));
        if let Some(sample) =
            hit.and_then(|hit| stand_ins.sample_at(hit.triangle, hit.barycentric, hit.front))
        {
            met.push(sample);
            found(direction);
        }
    }
    met.sort_unstable();
    met.chunk_by(|a, b| a == b).map(|same| (same[0], same.len() as f32 / rays as f32)).collect()
}

/// Joins the samples of lights that seem small into the lights themselves.
pub fn whole_lights(input: &GridInput, place: Vec3, row: &Row) -> Row {
    let samples = input.light_of_sample.len() as u32;
    let mut joined: Row = Vec::with_capacity(row.len());
    let mut whole: Row = Vec::new();
    for own in row.chunk_by(|a, b| input.light_of(a.0) == input.light_of(b.0)) {
        match input
            .light_of(own[0].0)
            .filter(|&light| own.len() > 1 && seems_small(input.lights, light, place))
        {
            Some(light) => whole.push((samples + light, own.iter().map(|(_, share)| share).sum())),
            None => joined.extend_from_slice(own),
        }
    }
    joined.extend(whole);
    joined.sort_unstable_by_key(|(source, _)| *source);
    joined
}

fn seems_small(lights: &LightSet, light: u32, place: Vec3) -> bool {
    let geometry = &lights.geometry[light as usize];
    geometry.longest_edge() < WHOLE * geometry.centroid().distance(place)
}

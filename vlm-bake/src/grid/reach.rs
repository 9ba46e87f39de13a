//! How far around itself a probe counts: to where walls begin.

use glam::Vec3;
use rayon::prelude::*;
use vlm_format::Probe;

use super::pool::Place;
use super::relief::relief;
use super::spacing::Spacing;
use crate::shade::TraceScene;

/// Reach along the surface over the spacing. Higher values blend more probes, which smooths their noise and blurs borders.
const REACH: f32 = 1.35;

/// The most reach along the normal over that along the surface. Higher values blend over rounder edges.
const HEIGHT: f32 = 0.5;

/// The least reach along the normal over that along the surface, for surface that is flat. Higher values blend over higher steps, and give
/// niches the light of the wall before them.
const FLAT: f32 = 0.06;

/// Reach along the normal over how far the surface rises or falls. Higher values blend curved surface more evenly.
const RELIEF: f32 = 2.0;

/// Rays along the surface.
const AROUND: u32 = 32;

/// They run at this height, over the reach. Lower ones are stopped by smaller steps.
const LIFT: f32 = 0.12;

/// Walls count as out of reach from this share of it on, for what rounding takes from their distance.
const OUT: f32 = 0.99;

/// A reach is never below this share of what it would be in the open.
const LEAST: f32 = 0.02;

/// What is left of a wall's normal across that of the surface tells a direction if it is longer; else it is rounding, and lies anywhere.
const LEAST_ACROSS: f32 = 1e-3;

/// The probes at the chosen places, their rows still empty.
#[must_use]
pub fn probes(trace: &TraceScene, pool: &[Place], spacing: &Spacing, chosen: &[u32]) -> Vec<Probe> {
    let probe = |&i: &u32| {
        let place = &pool[i as usize];
        probe(trace, place, REACH * spacing.at(place))
    };
    chosen.par_iter().map(probe).collect()
}

fn probe(trace: &TraceScene, place: &Place, reach: f32) -> Probe {
    let surface = &place.surface;
    let normal = surface.normal;
    let height = HEIGHT * reach;
    let up = free(trace, surface.position, surface.geometric_normal, height);
    let down = free(trace, surface.position, -surface.geometric_normal, height);
    let walls = walls(trace, place, reach, up);
    let tangent = tangent(normal, walls.first().map(|wall| wall.facing));
    let bitangent = normal.cross(tangent);
    let mut sides = [reach; 4];
    for wall in &walls {
        let (u, v) = (wall.at.dot(tangent), wall.at.dot(bitangent));
        let [side_u, side_v] = [usize::from(u > 0.0), 2 + usize::from(v > 0.0)];
        // A straight wall that the nearest ray has met is out of reach for all other rays that meet it: it must not cut what runs along it.
        let is_beyond = |side: usize, along: f32| along.abs() > OUT * sides[side];
        if !is_beyond(side_u, u) && !is_beyond(side_v, v) {
            let (side, along) = if u.abs() >= v.abs() { (side_u, u) } else { (side_v, v) };
            sides[side] = along.abs();
        }
    }
    let least = LEAST * reach;
    let [rise, fall] = relief(trace, place, reach, [up, down]);
    let along_normal = |free: f32, relief: f32| free.min((RELIEF * relief).max(FLAT * reach)).max(least);
    Probe {
        position: surface.position,
        row_scale: 0.0,
        normal,
        reach_up: along_normal(up, rise),
        tangent,
        reach_down: along_normal(down, fall),
        reach: sides.map(|side| side.max(least)),
    }
}

/// A unit vector across the normal, along the normal of the nearest wall if that tells one.
fn tangent(normal: Vec3, facing: Option<Vec3>) -> Vec3 {
    let across = facing.map(|facing| facing.reject_from(normal));
    let across = across.filter(|across| across.length_squared() > LEAST_ACROSS * LEAST_ACROSS);
    across.and_then(Vec3::try_normalize).unwrap_or_else(|| normal.any_orthonormal_vector())
}

/// What stands in a probe's way along its surface.
struct Wall {
    /// From the probe, metres.
    at: Vec3,
    /// The wall's normal.
    facing: Vec3,
}

/// The walls within reach, nearest first; `up` is how far the way along the normal is free.
fn walls(trace: &TraceScene, place: &Place, reach: f32, up: f32) -> Vec<Wall> {
    let surface = &place.surface;
    let (u, v) = surface.geometric_normal.any_orthonormal_pair();
    let lift = up.min(LIFT * reach) * 0.9;
    let origin =
        trace.bvh.leave(surface.position + surface.geometric_normal * lift, surface.geometric_normal);
    let mut walls: Vec<(f32, Wall)> = (0..AROUND)
        .filter_map(|i| {
            let (sin, cos) = (std::f32::consts::TAU * (i as f32 + 0.5) / AROUND as f32).sin_cos();
            let direction = u * cos + v * sin;
            let hit = trace.path_hit_within(origin, direction, reach * std::f32::consts::SQRT_2)?;
            let facing = trace.surface(&hit, 0.0)?.geometric_normal;
            Some((hit.distance, Wall { at: direction * hit.distance, facing }))
        })
        .collect();
    walls.sort_by(|a, b| a.0.total_cmp(&b.0));
    walls.into_iter().map(|(_, wall)| wall).collect()
}

/// How far one comes from a surface along a direction, at most `most`.
fn free(trace: &TraceScene, position: Vec3, direction: Vec3, most: f32) -> f32 {
    let origin = trace.bvh.leave(position, direction);
    trace.path_hit_within(origin, direction, most).map_or(most, |hit| hit.distance)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Found by fuzzing: what rounding left of a normal was taken for a direction.
    #[test]
    fn a_wall_that_faces_along_the_normal_tells_no_tangent() {
        let normal = Vec3::new(0.36, 0.48, 0.8).normalize_or_zero();
        for turned in [0.0, 1e-7, 3e-7, 1e-5, 1e-3, 0.1, 1.0] {
            let facing = (Vec3::new(turned, 0.0, 0.0) - normal).normalize_or_zero();
            let tangent = tangent(normal, Some(facing));
            let off = tangent.dot(normal).abs();
            assert!(off < 1e-4 && (tangent.length() - 1.0).abs() < 1e-5, "{turned}: {off}");
        }
        let nearly = (Vec3::new(1e-7, 3e-7, 0.0) - normal).normalize_or_zero();
        let rounding = nearly.reject_from(normal).normalize_or_zero();
        assert!(rounding.dot(normal).abs() > 1e-3, "the negative control: {rounding}");
    }
}

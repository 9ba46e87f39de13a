//! What probes see: irradiance by direction, and the moments of the distance.

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use vlm_bake::shade::TraceScene;

use super::octahedral::texel_direction;
use super::probes::ProbeGrid;
use crate::methods::area_lights::shadow_rays;
use crate::random::{fibonacci_direction, rotation, unit};

/// Texels along a side of a probe's irradiance.
pub const IRRADIANCE_SIDE: usize = 8;

/// Texels along a side of a probe's moments.
pub const MOMENTS_SIDE: usize = 16;

/// Distances count up to this many spacings: 1.5 diagonals of a cell, as in the paper.
const FARTHEST: f32 = 2.6;

/// Distances to backs count this much, so that points behind the surface take no light from the probe (as in the paper).
const BACK_SHARE: f32 = 0.2;

/// What one probe holds.
#[derive(Clone, Copy)]
pub struct ProbeLight {
    /// By direction of the receiver's normal, lx.
    pub irradiance: [Vec3; IRRADIANCE_SIDE * IRRADIANCE_SIDE],
    /// By direction of sight: mean of the distance (m) and of its square (m^2).
    pub moments: [Vec2; MOMENTS_SIDE * MOMENTS_SIDE],
}

/// All probes of a frame.
pub struct Updated {
    /// One per corner; black where the probe is switched off.
    pub probes: Vec<ProbeLight>,
    /// Rays traced, shadows included.
    pub rays: u64,
}

/// The directions of a frame, and what each counts in each texel; the same for all probes.
pub struct RaySet {
    directions: Vec<Vec3>,
    /// Rows of one weight per ray, one row per texel; they sum to 1.
    irradiance_weights: Vec<f32>,
    moments_weights: Vec<f32>,
}

impl RaySet {
    /// `count` directions, turned at random for each frame.
    #[must_use]
    pub fn new(count: u32, frame: u32) -> Self {
        let count = count.max(1);
        let turn = rotation([0, 1, 2].map(|k| unit(u64::from(frame), k)));
        let directions: Vec<Vec3> = (0..count).map(|i| turn * fibonacci_direction(i, count)).collect();
        Self {
            irradiance_weights: weights(IRRADIANCE_SIDE, &directions, |cosine| cosine),
            moments_weights: weights(MOMENTS_SIDE, &directions, sharp_lobe),
            directions,
        }
    }

    fn row<'a>(&self, weights: &'a [f32], texel: usize) -> &'a [f32] {
        &weights[texel * self.directions.len()..(texel + 1) * self.directions.len()]
    }
}

/// `cosine^50`, as in the paper.
fn sharp_lobe(cosine: f32) -> f32 {
    cosine.powi(50)
}

fn weights(side: usize, directions: &[Vec3], lobe: impl Fn(f32) -> f32) -> Vec<f32> {
    let row = |texel: usize| {
        let axis = texel_direction(texel, side);
        let row: Vec<f32> = directions.iter().map(|d| lobe(axis.dot(*d).max(0.0))).collect();
        let sum = row.iter().sum::<f32>().max(f32::MIN_POSITIVE);
        row.into_iter().map(move |weight| weight / sum)
    };
    (0..side * side).flat_map(row).collect()
}

/// Traces the rays of every probe.
#[must_use]
pub fn update(scene: &TraceScene<'_>, grid: &ProbeGrid, rays: &RaySet) -> Updated {
    let black = ProbeLight { irradiance: [Vec3::ZERO; _], moments: [Vec2::ZERO; _] };
    let probe = |position: &Option<Vec3>| {
        position.map_or((black, 0), |position| update_probe(scene, position, FARTHEST * grid.spacing, rays))
    };
    let updated: Vec<(ProbeLight, u64)> = grid.positions.par_iter().map(probe).collect();
    let traced = updated.iter().map(|(_, rays)| rays).sum();
    Updated { probes: updated.into_iter().map(|(probe, _)| probe).collect(), rays: traced }
}

fn update_probe(scene: &TraceScene<'_>, position: Vec3, farthest: f32, rays: &RaySet) -> (ProbeLight, u64) {
    let mut traced = rays.directions.len() as u64;
    let seen: Vec<(Vec3, f32)> =
        rays.directions.iter().map(|&d| look(scene, position, d, &mut traced)).collect();
    let irradiance = std::array::from_fn(|texel| {
        let weights = rays.row(&rays.irradiance_weights, texel);
        weights.iter().zip(&seen).map(|(w, (radiosity, _))| *radiosity * *w).sum()
    });
    let moments = std::array::from_fn(|texel| {
        let weights = rays.row(&rays.moments_weights, texel);
        let moments = |distance: f32| Vec2::new(distance, distance * distance);
        weights.iter().zip(&seen).map(|(w, (_, d))| moments(d.min(farthest)) * *w).sum()
    });
    (ProbeLight { irradiance, moments }, traced)
}

/// Radiosity of what a ray meets, lx, and its distance, metres. The weighted mean of radiosities is the irradiance,
/// as `E = integral of B / pi cos = mean of B` under the cosine.
fn look(scene: &TraceScene<'_>, position: Vec3, direction: Vec3, traced: &mut u64) -> (Vec3, f32) {
    let Some(hit) = scene.path_hit(position, direction) else { return (Vec3::ZERO, f32::MAX) };
    if !scene.is_lit_side(&hit) {
        return (Vec3::ZERO, BACK_SHARE * hit.distance);
    }
    let Some(y) = scene.surface(&hit, 0.0) else { return (Vec3::ZERO, hit.distance) };
    if y.albedo != Vec3::ZERO {
        *traced += shadow_rays(scene, y.position, y.normal, y.geometric_normal);
    }
    (scene.reflected(&y) + std::f32::consts::PI * y.emission, hit.distance)
}

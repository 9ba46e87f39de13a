//! The truth: one-bounce indirect irradiance by path tracing. Uses no virtual lights.
//!
//! `E_1(x) = integral over the hemisphere of L(y(w)) cos(theta) dw`, where `y(w)` is the first surface in direction `w`
//! and `L(y) = albedo / pi * E_direct(y) + L_e(y)`. With directions drawn with density `cos(theta) / pi`, the estimate
//! is the mean of `pi L(y) = albedo * E_direct(y) + pi L_e(y)`: the mean radiosity of what the directions meet.

use glam::Vec3;
use rayon::prelude::*;

use crate::progress::Progress;
use crate::shade::{SurfacePoint, TraceScene};

/// One-bounce indirect irradiance, lx, of each point (row by row, `width` to a row); 0 where there is none.
///
/// Each pixel has random numbers of its own, so results do not depend on the number of threads. The standard error
/// falls faster than `1 / sqrt(samples)` (stratified), most evenly when `samples` is a power of two.
#[must_use]
pub fn indirect_irradiance(
    scene: &TraceScene<'_>,
    points: &[Option<SurfacePoint>],
    width: u32,
    samples: u32,
    progress: &dyn Progress,
) -> Vec<Vec3> {
    let width = width.max(1) as usize;
    let mut irradiance = vec![Vec3::ZERO; points.len()];
    progress.begin("trace", points.len().div_ceil(width) as u64);
    let rows = irradiance.par_chunks_mut(width).zip(points.par_chunks(width)).enumerate();
    rows.for_each(|(row, (irradiance, points))| {
        for (column, (irradiance, point)) in irradiance.iter_mut().zip(points).enumerate() {
            let pixel = (row * width + column) as u64;
            *irradiance = point.as_ref().map_or(Vec3::ZERO, |p| irradiance_at(scene, p, samples, pixel));
        }
        progress.advance(1);
    });
    irradiance
}

/// One-bounce indirect irradiance at one point, lx, from `samples` directions; `seed` chooses them.
#[must_use]
pub fn irradiance_at(scene: &TraceScene<'_>, point: &SurfacePoint, samples: u32, seed: u64) -> Vec3 {
    let origin = scene.bvh.leave(point.position, point.geometric_normal);
    let (tangent, bitangent) = point.normal.any_orthonormal_pair();
    let random = mix(seed.wrapping_add(0x9e37_79b9_7f4a_7c15));
    let shift = (random as u32, (random >> 32) as u32);
    let mut sum = Vec3::ZERO;
    for i in 0..samples {
        let local = cosine_direction(shifted_hammersley(i, samples, shift));
        let direction = tangent * local.x + bitangent * local.y + point.normal * local.z;
        if direction.dot(point.geometric_normal) > 0.0 {
            sum += seen_radiosity(scene, origin, direction);
        }
    }
    sum / samples.max(1) as f32
}

/// Radiosity of the first surface on the ray, lx; backs of single-sided surfaces are black.
fn seen_radiosity(scene: &TraceScene<'_>, origin: Vec3, direction: Vec3) -> Vec3 {
    let lit = scene.path_hit(origin, direction).filter(|hit| scene.is_lit_side(hit));
    lit.and_then(|hit| scene.surface(&hit, 0.0)).map_or(Vec3::ZERO, |y| scene.radiosity(&y))
}

/// The `i`-th of `count` points of the unit square (Hammersley 1960): stratified in both coordinates at every scale,
/// moved around the torus by `shift`, which makes the estimate unbiased (Cranley and Patterson 1976).
fn shifted_hammersley(i: u32, count: u32, shift: (u32, u32)) -> (f32, f32) {
    let regular = (u64::from(i) << 32) / u64::from(count.max(1));
    let unit = |bits: u32| (bits >> 8) as f32 / (1 << 24) as f32;
    (unit((regular as u32).wrapping_add(shift.0)), unit(i.reverse_bits().wrapping_add(shift.1)))
}

/// A direction around +z with density `cos(theta) / pi`: a uniform point of the disk, lifted onto the hemisphere
/// (Malley's method). `.0` chooses the height, `.1` the angle around the axis.
fn cosine_direction((u, v): (f32, f32)) -> Vec3 {
    let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
    let radius = u.sqrt();
    Vec3::new(radius * cos, radius * sin, (1.0 - u).max(0.0).sqrt())
}

/// Stafford's variant 13 of the 64-bit finaliser: every input bit changes half of the output bits.
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_have_the_moments_of_the_cosine_lobe() {
        // Under the density cos / pi: E[z] = 2/3, E[z^2] = 1/2, E[x] = E[y] = 0, E[x^2] = 1/4.
        let mean = |f: &dyn Fn(Vec3) -> f32| {
            let values = (0..4096).map(|i| f(cosine_direction(shifted_hammersley(i, 4096, (123, 456)))));
            values.sum::<f32>() / 4096.0
        };
        assert!((mean(&|d| d.z) - 2.0 / 3.0).abs() < 1e-3);
        assert!((mean(&|d| d.z * d.z) - 0.5).abs() < 1e-3);
        assert!(mean(&|d| d.x).abs() < 1e-3 && mean(&|d| d.y).abs() < 1e-3);
        assert!((mean(&|d| d.x * d.x) - 0.25).abs() < 1e-3);
        assert!((mean(&|d| d.length()) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn points_are_stratified_in_both_coordinates() {
        for axis in 0..2 {
            let mut strata = [0; 64];
            for i in 0..64 {
                let point = shifted_hammersley(i, 64, (77 << 26, 5 << 26));
                let coordinate = if axis == 0 { point.0 } else { point.1 };
                strata[(coordinate * 64.0) as usize] += 1;
            }
            assert_eq!(strata, [1; 64]);
        }
    }
}

//! The truth: one-bounce indirect irradiance by path tracing. Uses no virtual lights.
//!
//! `E_1(x) = integral over the hemisphere of L(y(w)) cos(theta) dw`, where `y(w)` is the first surface in direction `w`
//! and `L(y) = albedo / pi * E_direct(y) + L_e(y)`. With directions drawn with density `cos(theta) / pi`, the estimate
//! is the mean of `pi L(y) = albedo * E_direct(y) + pi L_e(y)`: the mean radiosity of what the directions meet.
//! Emitted light is also sought by points drawn on the emitters, weighed against the directions.

use std::f32::consts::PI;

use glam::{Mat3, Vec3};
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
    let receiver = Receiver {
        origin: scene.bvh.leave(point.position, point.geometric_normal),
        tangents: point.normal.any_orthonormal_pair(),
        point,
    };
    let (toward_hemisphere, toward_emitters) = (random_shift(2 * seed), random_shift(2 * seed + 1));
    let mut sum = Vec3::ZERO;
    for i in 0..samples {
        sum += by_direction(scene, &receiver, shifted_hammersley(i, samples, toward_hemisphere));
        if !scene.emitters.is_empty() {
            sum += by_emitter(scene, &receiver, shifted_hammersley(i, samples, toward_emitters));
        }
    }
    sum / samples.max(1) as f32
}

/// The point whose irradiance is wanted.
struct Receiver<'a> {
    point: &'a SurfacePoint,
    /// Just in front of the surface.
    origin: Vec3,
    /// With the shading normal, an orthonormal frame.
    tangents: (Vec3, Vec3),
}

/// Estimate from one direction: reflected light of what it meets, and its share of emitted light.
fn by_direction(scene: &TraceScene<'_>, receiver: &Receiver<'_>, random: (f32, f32)) -> Vec3 {
    let local = cosine_direction(random);
    let (tangent, bitangent) = receiver.tangents;
    let direction = tangent * local.x + bitangent * local.y + receiver.point.normal * local.z;
    if direction.dot(receiver.point.geometric_normal) <= 0.0 {
        return Vec3::ZERO;
    }
    let lit = scene.path_hit(receiver.origin, direction).filter(|hit| scene.is_lit_side(hit));
    let Some((hit, y)) = lit.and_then(|hit| Some((hit, scene.surface(&hit, 0.0)?))) else {
        return Vec3::ZERO;
    };
    let mut radiosity = scene.reflected(&y);
    if y.emission != Vec3::ZERO {
        let by_direction = local.z / PI;
        let by_emitter = emitter_density(scene, &y, direction, hit.distance);
        radiosity += PI * y.emission * (by_direction / (by_direction + by_emitter));
    }
    radiosity
}

/// Estimate of emitted light from one point of an emitter; with [`by_direction`]'s share it makes the whole (balance
/// heuristic, Veach 1997, section 9.2), which neither small emitters nor those close by make noisy.
fn by_emitter(scene: &TraceScene<'_>, receiver: &Receiver<'_>, random: (f32, f32)) -> Vec3 {
    let Some(target) = scene.emitters.draw(random) else { return Vec3::ZERO };
    let Some(direction) = (target.position - receiver.origin).try_normalize() else { return Vec3::ZERO };
    let cosine = receiver.point.normal.dot(direction);
    if cosine <= 0.0 || receiver.point.geometric_normal.dot(direction) <= 0.0 {
        return Vec3::ZERO;
    }
    // The nearest hit, not a test for blockers: of two coincident triangles, directions too see only one.
    let hit = scene.path_hit(receiver.origin, direction);
    let seen = hit.filter(|hit| hit.triangle == target.triangle && scene.is_lit_side(hit));
    let Some((hit, y)) = seen.and_then(|hit| Some((hit, scene.surface(&hit, 0.0)?))) else {
        return Vec3::ZERO;
    };
    let by_emitter = emitter_density(scene, &y, direction, hit.distance);
    y.emission * (cosine / (by_emitter + cosine / PI))
}

/// Density per solid angle with which [`by_emitter`] finds the direction in which `y` lies.
fn emitter_density(scene: &TraceScene<'_>, y: &SurfacePoint, direction: Vec3, distance: f32) -> f32 {
    let cosine = -y.geometric_normal.dot(direction);
    if cosine <= 0.0 { 0.0 } else { scene.emitters.density(y.triangle) * distance * distance / cosine }
}

/// A random point of the torus.
fn random_shift(seed: u64) -> (u32, u32) {
    let bits = mix(seed.wrapping_add(0x9e37_79b9_7f4a_7c15));
    (bits as u32, (bits >> 32) as u32)
}

/// Of `count` directions around a surface's shading normal with density `cos(theta) / pi`, stratified, those above the surface itself;
/// `seed` chooses them.
pub fn directions_above(surface: &SurfacePoint, count: u32, seed: u64) -> impl Iterator<Item = Vec3> {
    let (tangent, bitangent) = surface.normal.any_orthonormal_pair();
    let frame = Mat3::from_cols(tangent, bitangent, surface.normal);
    let (shift, geometric_normal) = (random_shift(seed), surface.geometric_normal);
    let directions = (0..count).map(move |i| frame * cosine_direction(shifted_hammersley(i, count, shift)));
    directions.filter(move |direction| direction.dot(geometric_normal) > 0.0)
}

/// `count` directions, spread evenly over the whole sphere and stratified; `seed` chooses them.
pub fn directions_around(count: u32, seed: u64) -> impl Iterator<Item = Vec3> {
    let shift = random_shift(seed);
    (0..count).map(move |i| {
        let (u, v) = shifted_hammersley(i, count, shift);
        let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
        let z = 1.0 - 2.0 * u;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(radius * cos, radius * sin, z)
    })
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
    fn directions_around_a_point_have_the_moments_of_the_sphere() {
        let mean = |f: &dyn Fn(Vec3) -> f32| directions_around(4096, 5).map(f).sum::<f32>() / 4096.0;
        for axis in 0..3 {
            assert!(mean(&|d| d[axis]).abs() < 1e-3);
            assert!((mean(&|d| d[axis] * d[axis]) - 1.0 / 3.0).abs() < 1e-3);
        }
        assert!((mean(&|d| d.length()) - 1.0).abs() < 1e-5);
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

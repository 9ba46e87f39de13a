//! Random numbers and directions that are the same on every machine.
//!
//! Counter-based, so that nothing depends on the number of threads. Sine and cosine are the crate `libm`'s: those of
//! the system differ in the last bit between processors, and a ray may then meet another triangle.

use std::f32::consts::TAU;

use glam::{Quat, Vec3};

/// 64 random bits for a number of a stream: the finaliser of SplitMix64 (Steele, Lea, Flood 2014).
#[must_use]
pub fn bits(stream: u64, number: u64) -> u64 {
    let finish = |mut z: u64| {
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    finish(finish(stream.wrapping_add(0x9e37_79b9_7f4a_7c15)).wrapping_add(number))
}

/// A number in 0..1, exclusive of 1.
#[must_use]
pub fn unit(stream: u64, number: u64) -> f32 {
    (bits(stream, number) >> 40) as f32 / (1 << 24) as f32
}

/// A point of the unit square: number `index` of the additive recurrence on the plastic number (Roberts 2018, "The
/// Unreasonable Effectiveness of Quasirandom Sequences"), moved around the torus by `shift`.
#[must_use]
pub fn plastic_point(index: u32, shift: (f32, f32)) -> (f32, f32) {
    const PLASTIC: f64 = 1.324_717_957_244_746;
    let at = |step: f64, shift: f32| (f64::from(shift) + f64::from(index) * step).fract() as f32;
    // Rounding to f32 may give 1.
    let below_1 = |x: f32| x.min(1.0 - f32::EPSILON / 2.0);
    (below_1(at(1.0 / PLASTIC, shift.0)), below_1(at(1.0 / (PLASTIC * PLASTIC), shift.1)))
}

/// Sine and cosine of `turns` times a full turn.
fn sin_cos(turns: f32) -> (f32, f32) {
    libm::sincosf(TAU * turns)
}

/// A unit vector for two numbers in 0..1, uniform over the sphere.
#[must_use]
pub fn sphere_direction((u, v): (f32, f32)) -> Vec3 {
    cone_direction(-1.0, (u, v))
}

/// A unit vector for two numbers in 0..1, uniform over the cone around +z with this cosine of its half angle.
#[must_use]
pub fn cone_direction(cos_angle: f32, (u, v): (f32, f32)) -> Vec3 {
    let z = 1.0 - u * (1.0 - cos_angle);
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = sin_cos(v);
    Vec3::new(radius * cos, radius * sin, z)
}

/// A point of the unit disk for two numbers in 0..1, uniform; z is 0.
#[must_use]
pub fn disk_point((u, v): (f32, f32)) -> Vec3 {
    let (sin, cos) = sin_cos(v);
    Vec3::new(cos, sin, 0.0) * u.sqrt()
}

/// A rotation for three numbers in 0..1, uniform over all rotations (Shoemake 1992).
#[must_use]
pub fn rotation([u, v, w]: [f32; 3]) -> Quat {
    let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
    let ((sin_v, cos_v), (sin_w, cos_w)) = (sin_cos(v), sin_cos(w));
    Quat::from_xyzw(a * sin_v, a * cos_v, b * sin_w, b * cos_w)
}

/// Direction `i` of `count`, spread evenly over the sphere: the spherical Fibonacci lattice (Keinert et al. 2015).
#[must_use]
pub fn fibonacci_direction(i: u32, count: u32) -> Vec3 {
    const GOLDEN: f64 = 1.618_033_988_749_895;
    let turns = (f64::from(i) / GOLDEN).fract() as f32;
    sphere_direction(((i as f32 + 0.5) / count.max(1) as f32, turns))
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT: u32 = 4096;

    fn mean(value: impl Fn(u32) -> f32) -> f32 {
        (0..COUNT).map(value).sum::<f32>() / COUNT as f32
    }

    #[test]
    fn directions_have_the_moments_of_the_sphere() {
        let drawn = |i: u32| sphere_direction(plastic_point(i, (0.1, 0.7)));
        for direction in [&drawn as &dyn Fn(u32) -> Vec3, &|i| fibonacci_direction(i, COUNT)] {
            for axis in 0..3 {
                assert!(mean(|i| direction(i)[axis]).abs() < 2e-3);
                assert!((mean(|i| direction(i)[axis] * direction(i)[axis]) - 1.0 / 3.0).abs() < 2e-3);
            }
        }
    }

    #[test]
    fn cones_and_disks_are_filled_evenly() {
        // Over a cone, z is uniform between the cosine and 1; over a disk, the mean squared radius is 1/2.
        let z = mean(|i| cone_direction(0.6, plastic_point(i, (0.0, 0.0))).z);
        assert!((z - 0.8).abs() < 1e-3, "{z}");
        assert!((mean(|i| disk_point(plastic_point(i, (0.0, 0.0))).length_squared()) - 0.5).abs() < 1e-3);
    }

    #[test]
    fn rotations_keep_lengths_and_have_no_preferred_direction() {
        let turned = |i: u32| rotation([0, 1, 2].map(|k| unit(7, u64::from(3 * i + k)))) * Vec3::X;
        assert!((0..COUNT).all(|i| (turned(i).length() - 1.0).abs() < 1e-5));
        let sum: Vec3 = (0..COUNT).map(turned).sum();
        assert!((sum / COUNT as f32).length() < 0.05, "{sum}");
    }

    #[test]
    fn streams_differ() {
        assert_ne!(unit(1, 5), unit(2, 5));
        assert!((mean(|i| unit(3, u64::from(i))) - 0.5).abs() < 0.02);
    }
}

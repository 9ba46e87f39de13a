//! The form factor of a triangular light at a point, in single precision.
//!
//! After Baum, Rushmeier, Winget, "Improving radiosity solutions through the use of analytically determined
//! form-factors", 1989, equation 3, summed in differences so that f32 suffices; `docs/form-factor.md` has the measurements.
//!
//! Within about `1e-5 r` of the light's plane, `r` the distance to it, F jumps between 0 and its value in front.

mod arithmetic;
mod light;
mod far;
mod near;
mod lanes;
mod moments;

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec3;

pub use lanes::{Receivers, form_factors, form_factors_portable};
pub use light::LightGeometry;
pub use moments::{ErrorBound, centroid_form_factor, form_factor_within, second_moment_form_factor};

use arithmetic::dot;
use far::far_triangle;
use near::{Heights, clip_at_horizon, polygon_sum};

/// The form factor of `light` at the point `x` with unit normal `n`, 0 to 1: irradiance per radiosity.
///
/// 0 behind the light's plane and below the horizon. A normal of another length scales the result, which stays within
/// 0 to 1. NaN in any input gives 0.
#[must_use]
pub fn form_factor(light: &LightGeometry, x: Vec3, n: Vec3) -> f32 {
    exact::<false>(light, x, n)
}

/// [`form_factor`], with or without fused arithmetic.
#[inline(always)]
fn exact<const FUSED: bool>(light: &LightGeometry, x: Vec3, n: Vec3) -> f32 {
    let r = (light.v0 - x) * light.scale;
    let heights = Heights::new::<FUSED>(light, r, n);
    if !(dot::<FUSED>(light.normal, r) < 0.0 && heights.any_above()) {
        return 0.0;
    }
    let (sum, is_far) = far_triangle::<FUSED>(light, r, n);
    if is_far && heights.all_above() { far_form_factor(sum) } else { close::<FUSED>(light, x, n, &heights) }
}

#[inline(always)]
fn far_form_factor(sum: f32) -> f32 {
    to_unit(sum * -(1.0 / TAU))
}

/// What [`far_triangle`] cannot: lights near the point or across its horizon.
#[inline(always)]
fn close<const FUSED: bool>(light: &LightGeometry, x: Vec3, n: Vec3, heights: &Heights) -> f32 {
    let corners = light.corners().map(|v| (v - x) * light.scale);
    let polygon = clip_at_horizon::<FUSED>(light, corners, heights);
    to_unit(polygon_sum::<FUSED>(&polygon, n, dot::<FUSED>(n, light.normal)) * -FRAC_1_PI)
}

/// 0 to 1; 0 for NaN.
#[inline(always)]
fn to_unit(x: f32) -> f32 {
    if x > 0.0 { if x < 1.0 { x } else { 1.0 } } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use std::f64::consts::PI;

    /// Two triangles that make the square `[-h, h]^2` at height `z`, shining down.
    fn ceiling(h: f64, z: f64) -> [LightGeometry; 2] {
        let [a, b, c, d] = [[-h, -h, z], [h, -h, z], [h, h, z], [-h, h, z]].map(DVec3::from);
        [[a, c, b], [a, d, c]].map(LightGeometry::new)
    }

    /// The square seen from the point below its centre: four times the closed form of a corner.
    fn square_above(h: f64, z: f64) -> f64 {
        let x = h / z;
        4.0 / PI * x / (1.0 + x * x).sqrt() * (x / (1.0 + x * x).sqrt()).atan()
    }

    #[test]
    fn square_above_a_point_matches_the_closed_form() {
        for (h, z) in [(1.0, 1.0), (0.5, 3.0), (0.125, 1000.0), (100.0, 0.25)] {
            let sum: f32 = ceiling(h, z).iter().map(|light| form_factor(light, Vec3::ZERO, Vec3::Z)).sum();
            let relative = f64::from(sum) / square_above(h, z) - 1.0;
            assert!(relative.abs() < 1e-6, "{h} {z}: {relative}");
        }
    }

    #[test]
    fn one_sided() {
        let [a, _] = ceiling(1.0, 1.0);
        assert_eq!(form_factor(&a, Vec3::new(0.0, 0.0, 2.0), -Vec3::Z), 0.0, "behind the light");
        assert_eq!(form_factor(&a, Vec3::ZERO, -Vec3::Z), 0.0, "below the horizon");
        assert_eq!(form_factor(&a, Vec3::new(0.0, 0.0, 1.0), Vec3::Z), 0.0, "in its plane");
    }

    #[test]
    fn half_a_wall_above_the_horizon_counts() {
        let wall = |low: f64| {
            let [a, b, c, d] = [[1.0, -2.0, low], [1.0, 2.0, low], [1.0, 2.0, 2.0], [1.0, -2.0, 2.0]];
            let halves = [[a, c, b], [a, d, c]].map(|t| LightGeometry::new(t.map(DVec3::from)));
            halves.iter().map(|light| form_factor(light, Vec3::ZERO, Vec3::Z)).sum::<f32>()
        };
        assert!((wall(-2.0) - wall(0.0)).abs() < 1e-6);
        assert!(wall(0.0) > 0.1);
    }
}

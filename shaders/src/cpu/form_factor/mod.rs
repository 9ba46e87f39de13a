//! The form factor of a triangular light at a point, in single precision.
//!
//! After Baum, Rushmeier, Winget, "Improving radiosity solutions through the use of analytically determined
//! form-factors", 1989, equation 3, summed in differences so that f32 suffices; `docs/form-factor.md` has the measurements.
//!
//! Within about `1e-5 r` of the light's plane, `r` the distance to it, F jumps between 0 and its value in front.

mod real;
mod arctangent;
mod light;
mod far;
mod clip;
mod near;
mod lanes;
mod moments;
mod operations;

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec3;

pub use lanes::{Receivers, form_factors};
pub use light::LightGeometry;
pub use moments::{ErrorBound, centroid_form_factor, form_factor_within, second_moment_form_factor};
pub use operations::far_operations;

use clip::{Heights, clip_at_horizon};
use far::far_triangle;
use near::{polygon_sum, whole_sum};
use real::{Real, Vector};

/// The form factor of `light` at the point `x` with unit normal `n`, 0 to 1: irradiance per radiosity.
///
/// 0 behind the light's plane, below the horizon, and farther than 4e9 times the light's size. A normal of another length,
/// from 1e-18 on, scales the result, which stays within 0 to 1. NaN in any input gives 0.
#[must_use]
pub fn form_factor(light: &LightGeometry, x: Vec3, n: Vec3) -> f32 {
    let (x, n) = (Vector::from(x), Vector::from(n));
    let seen = Seen::new(light, x, n);
    if !seen.is_lit {
        return 0.0;
    }
    if seen.heights.all_above() {
        let (result, is_far) = seen.far(light, n);
        if is_far { result } else { close_whole(light, x, n) }
    } else {
        close_clipped(light, x, n)
    }
}

/// True if the whole light lies behind a surface through `x` with this normal.
#[must_use]
pub fn is_behind(light: &LightGeometry, x: Vec3, surface_normal: Vec3) -> bool {
    let r = Vector::from((light.v0 - x) * light.scale);
    !Heights::new(light, r, Vector::from(surface_normal)).any_above()
}

/// A light as seen from a point.
struct Seen<R: Real> {
    /// First corner, light units.
    r: Vector<R>,
    /// `N . r`: negative in front.
    normal_r: R,
    heights: Heights<R>,
    /// In front of the light, which is not wholly below the horizon.
    is_lit: R::Mask,
}

impl<R: Real> Seen<R> {
    #[inline(always)]
    fn new(light: &LightGeometry, x: Vector<R>, n: Vector<R>) -> Self {
        let r = (x.splat(light.v0) - x) * x.x.splat(light.scale);
        let normal_r = r.splat(light.normal).dot(r);
        let heights = Heights::new(light, r, n);
        let is_lit = normal_r.below(normal_r.zero()) & heights.any_above();
        Self { r, normal_r, heights, is_lit }
    }

    /// The form factor of a light wholly above the horizon, and whether it is far enough for that.
    #[inline(always)]
    fn far(&self, light: &LightGeometry, n: Vector<R>) -> (R, R::Mask) {
        let (sum, is_far) = far_triangle(light, self.r, n, self.heights.corners[0], self.normal_r);
        (to_unit(sum * sum.splat(-1.0 / TAU)), is_far)
    }
}

/// A light near the point, wholly above its horizon.
#[inline(always)]
fn close_whole<R: Real>(light: &LightGeometry, x: Vector<R>, n: Vector<R>) -> R {
    let sum = whole_sum(light, corners_from(light, x), n);
    to_unit(sum * sum.splat(-FRAC_1_PI))
}

/// A light across the point's horizon.
#[inline(always)]
fn close_clipped<R: Real>(light: &LightGeometry, x: Vector<R>, n: Vector<R>) -> R {
    let corners = corners_from(light, x);
    let polygon = clip_at_horizon(light, corners, &Heights::from_nearest(light, corners, n));
    let sum = polygon_sum(light, &polygon, n);
    to_unit(sum * sum.splat(-FRAC_1_PI))
}

/// The corners as seen from `x`, light units, each rounded to its own distance.
#[inline(always)]
fn corners_from<R: Real>(light: &LightGeometry, x: Vector<R>) -> [Vector<R>; 3] {
    let scale = x.x.splat(light.scale);
    let from_x = [x.splat(light.v0) - x, x.splat(light.v1) - x, x.splat(light.v2) - x];
    [from_x[0] * scale, from_x[1] * scale, from_x[2] * scale]
}

/// 0 to 1; 0 for NaN.
#[inline(always)]
fn to_unit<R: Real>(x: R) -> R {
    R::select(x.is_above(), R::select(x.below(x.one()), x, x.one()), x.zero())
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

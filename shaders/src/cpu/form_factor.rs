//! The form factor of a triangular light at a point, in double precision.
//!
//! Baum, Rushmeier, Winget, "Improving radiosity solutions through the use of analytically determined form-factors",
//! 1989, equation 3, with atan2 in place of acos, which loses all accuracy for small angles.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

/// A one-sided triangular light: its corners are `v0`, `v0 + e1` and `v0 + e2`, metres, world space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightGeometry {
    /// First corner.
    pub v0: Vec3,
    /// From the first corner to the second.
    pub e1: Vec3,
    /// From the first corner to the third.
    pub e2: Vec3,
    /// `e1 x e2`: points to the emitting side, twice the area long.
    pub normal: Vec3,
}

impl LightGeometry {
    /// From corners that run counter-clockwise seen from the emitting side. Edges are rounded once, from f64.
    #[must_use]
    pub fn new(corners: [DVec3; 3]) -> Self {
        let [v0, v1, v2] = corners;
        let (e1, e2) = (v1 - v0, v2 - v0);
        Self { v0: v0.as_vec3(), e1: e1.as_vec3(), e2: e2.as_vec3(), normal: e1.cross(e2).as_vec3() }
    }

    /// The corners, counter-clockwise seen from the emitting side.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 3] {
        [self.v0, self.v0 + self.e1, self.v0 + self.e2]
    }

    /// Square metres.
    #[must_use]
    pub fn area(&self) -> f32 {
        0.5 * self.normal.length()
    }
}

/// The form factor of `light` at the point `x` with unit normal `n`, 0 to 1: irradiance per radiosity.
///
/// With corners `r_i` relative to `x`, seen counter-clockwise and clipped to `n . r >= 0`,
/// `F = -1/(2 pi) sum_i Theta_i n . (r_i x r_{i+1}) / |r_i x r_{i+1}|`, where `Theta_i` is the angle between `r_i` and
/// `r_{i+1}`. Behind the light's plane it is 0.
#[must_use]
pub fn form_factor(light: &LightGeometry, x: Vec3, n: Vec3) -> f64 {
    let n = n.as_dvec3();
    let r0 = light.v0.as_dvec3() - x.as_dvec3();
    let (e1, e2) = (light.e1.as_dvec3(), light.e2.as_dvec3());
    if e1.cross(e2).dot(r0) >= 0.0 {
        return 0.0;
    }
    let (polygon, count) = clip_at_horizon([r0, r0 + e1, r0 + e2], n);
    let mut sum = 0.0;
    for i in 0..count {
        let next = if i + 1 == count { 0 } else { i + 1 };
        sum += edge_term(polygon[i], polygon[next], n);
    }
    (-sum / TAU).clamp(0.0, 1.0)
}

/// `Theta n . unit(a x b)`; 0 for an edge seen under no angle.
fn edge_term(a: DVec3, b: DVec3, n: DVec3) -> f64 {
    let cross = a.cross(b);
    let length = cross.length();
    if length == 0.0 { 0.0 } else { length.atan2(a.dot(b)) / length * n.dot(cross) }
}

/// The part of a triangle with `n . r >= 0`: a polygon of 0, 3 or 4 corners (Sutherland and Hodgman 1974).
fn clip_at_horizon(corners: [DVec3; 3], n: DVec3) -> ([DVec3; 4], usize) {
    let heights = corners.map(|r| n.dot(r));
    let mut polygon = [DVec3::ZERO; 4];
    let mut count = 0;
    let mut push = |r| {
        // One plane cuts a triangle into at most 4 corners.
        if let Some(slot) = polygon.get_mut(count) {
            *slot = r;
            count += 1;
        }
    };
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        if heights[i] >= 0.0 {
            push(corners[i]);
        }
        if (heights[i] >= 0.0) != (heights[j] >= 0.0) {
            let t = heights[i] / (heights[i] - heights[j]);
            push(corners[i] + t * (corners[j] - corners[i]));
        }
    }
    (polygon, count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn light(corners: [[f64; 3]; 3]) -> LightGeometry {
        LightGeometry::new(corners.map(DVec3::from))
    }

    /// Two triangles that make the square `[-h, h]^2` at height `z`, shining down.
    fn ceiling(h: f64, z: f64) -> [LightGeometry; 2] {
        let [a, b, c, d] = [[-h, -h, z], [h, -h, z], [h, h, z], [-h, h, z]];
        [light([a, c, b]), light([a, d, c])]
    }

    /// The form factor of a square of half width `h` at height `z`, at the point below its centre: four times the
    /// corner formula `1/(2 pi) (X/sqrt(1+X^2) atan(Y/sqrt(1+X^2)) + Y/sqrt(1+Y^2) atan(X/sqrt(1+Y^2)))`.
    fn square_above(h: f64, z: f64) -> f64 {
        let x = h / z;
        4.0 / PI * x / (1.0 + x * x).sqrt() * (x / (1.0 + x * x).sqrt()).atan()
    }

    #[test]
    fn square_above_a_point_matches_the_closed_form() {
        for (h, z) in [(1.0, 1.0), (0.5, 3.0), (100.0, 0.25)] {
            let sum: f64 = ceiling(h, z).iter().map(|l| form_factor(l, Vec3::ZERO, Vec3::Z)).sum();
            assert!((sum - square_above(h, z)).abs() < 1e-12, "{h} {z}: {sum}");
            assert!((sum * 1.05 - square_above(h, z)).abs() > 1e-3, "the check can fail");
        }
    }

    #[test]
    fn half_a_wall_above_the_horizon_counts() {
        // A square wall at x = 1 that reaches as far below the horizon as above it: the lower half adds nothing.
        let wall = |low: f64| {
            let [a, b, c, d] = [[1.0, -2.0, low], [1.0, 2.0, low], [1.0, 2.0, 2.0], [1.0, -2.0, 2.0]];
            let halves = [light([a, c, b]), light([a, d, c])];
            halves.iter().map(|l| form_factor(l, Vec3::ZERO, Vec3::Z)).sum::<f64>()
        };
        assert!((wall(-2.0) - wall(0.0)).abs() < 1e-12);
        assert!(wall(0.0) > 0.1);
    }

    #[test]
    fn one_sided() {
        let [a, _] = ceiling(1.0, 1.0);
        assert_eq!(form_factor(&a, Vec3::new(0.0, 0.0, 2.0), -Vec3::Z), 0.0, "behind the light");
        assert_eq!(form_factor(&a, Vec3::ZERO, -Vec3::Z), 0.0, "below the horizon");
        assert_eq!(form_factor(&a, Vec3::new(0.0, 0.0, 1.0), Vec3::Z), 0.0, "in its plane");
    }

    #[test]
    fn a_closed_box_has_form_factors_that_sum_to_one() {
        // Six faces of the cube [-1, 1]^3, seen from inside.
        let x = Vec3::new(0.3, -0.2, 0.4);
        let mut sum = 0.0;
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let corner = |u: f64, v: f64| {
                    let mut p = DVec3::splat(side);
                    p[(axis + 1) % 3] = u * side;
                    p[(axis + 2) % 3] = v;
                    p
                };
                let [a, b, c, d] =
                    [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                let faces = [[a, c, b], [a, d, c]].map(LightGeometry::new);
                sum += faces.iter().map(|l| form_factor(l, x, Vec3::new(0.6, 0.0, 0.8))).sum::<f64>();
            }
        }
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");
    }
}

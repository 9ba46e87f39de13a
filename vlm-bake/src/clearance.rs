//! How far behind its surface a light must lie, and whether it lights what it stands for.

use glam::DVec3;

/// The clearance that a scene needs, in metres.
///
/// Two things can move a light against its surface after the bake. Rounding: a coordinate `p` in single precision is known to
/// `p 2^-24`, and a chain of a transform and a difference multiplies that by a few. Quantisation: an optimiser that stores
/// positions in 14 bits of the extent moves each vertex by up to half a step of `extent 2^-14`, the light's and
/// the surface's. Their sum, doubled for safety:
/// ```text
/// clearance = 2 (extent 2^-14 + 8 max|p| 2^-24)
/// ```
#[must_use]
pub fn required_clearance(bounds: [DVec3; 2]) -> f64 {
    let extent = (bounds[1] - bounds[0]).max_element();
    let farthest = bounds[0].abs().max(bounds[1].abs()).max_element();
    2.0 * (extent * 2f64.powi(-14) + 8.0 * farthest * 2f64.powi(-24))
}

/// How far a light reaches above the horizon of a place with that normal: the greatest height of a corner, negative where all lie
/// below.
#[must_use]
pub fn rise(light: &[DVec3; 3], place: DVec3, normal: DVec3) -> f64 {
    light.iter().map(|v| (*v - place).dot(normal)).fold(f64::NEG_INFINITY, f64::max)
}

/// By how much a light must move before it no longer lights a place with that normal, clearance included; 0 or less if it does
/// not. A light leaves a place dark if that lies behind its plane, or the light below the place's horizon.
#[must_use]
pub fn self_lighting(
    light: &[DVec3; 3],
    light_normal: DVec3,
    place: DVec3,
    normal: DVec3,
    clearance: f64,
) -> f64 {
    let before = (place - light[0]).dot(light_normal);
    rise(light, place, normal).min(before) + clearance
}

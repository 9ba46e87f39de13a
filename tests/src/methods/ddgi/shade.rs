//! Irradiance of a point from the eight probes around it (Majercik et al. 2019, section 5.2).

use glam::{UVec3, Vec3};
use vlm_bake::shade::SurfacePoint;

use super::octahedral::sample;
use super::probes::ProbeGrid;
use super::update::{IRRADIANCE_SIDE, MOMENTS_SIDE, ProbeLight};

/// Points look at probes from this share of the spacing in front of their surface. Higher values keep the visibility
/// test from shadowing a surface by itself and let light through thin walls.
const NORMAL_BIAS: f32 = 0.2;

/// Weights below this are crushed, as eyes see even little light that leaks into the dark.
const CRUSHED: f32 = 0.2;

/// Irradiance, lx, and the number of probes looked up.
#[must_use]
pub fn shade(grid: &ProbeGrid, probes: &[ProbeLight], point: &SurfacePoint) -> (Vec3, u64) {
    let biased = point.position + point.normal * (NORMAL_BIAS * grid.spacing);
    let at = ((biased - grid.origin) / grid.spacing).max(Vec3::ZERO);
    let base = at.as_uvec3().min(grid.corners - 2);
    let part = (at - base.as_vec3()).min(Vec3::ONE);
    let (mut sum, mut total, mut pairs) = (Vec3::ZERO, 0.0, 0);
    for corner in 0..8 {
        let offset = UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
        let index = grid.index(base + offset);
        let trilinear = Vec3::select(offset.cmpeq(UVec3::ONE), part, Vec3::ONE - part).element_product();
        let Some((position, probe)) = grid.positions[index].zip(probes.get(index)) else { continue };
        if trilinear <= 0.0 {
            continue;
        }
        pairs += 1;
        let seen = facing(position - point.position, point.normal) * visibility(probe, biased - position);
        let weight = crushed(seen.max(1e-6)) * trilinear;
        sum += sample(&probe.irradiance, IRRADIANCE_SIDE, point.normal) * weight;
        total += weight;
    }
    (if total > 0.0 { sum / total } else { Vec3::ZERO }, pairs)
}

/// Wrap shading: probes behind the surface count little, but smoothly so.
fn facing(to_probe: Vec3, normal: Vec3) -> f32 {
    let wrapped = 0.5 * (to_probe.normalize_or_zero().dot(normal) + 1.0);
    wrapped * wrapped + 0.2
}

/// The probability that the probe sees as far as the point: Chebyshev's bound, cubed against leaks (Donnelly and
/// Lauritzen 2006, "Variance shadow maps").
fn visibility(probe: &ProbeLight, from_probe: Vec3) -> f32 {
    let distance = from_probe.length();
    let moments = sample(&probe.moments, MOMENTS_SIDE, from_probe);
    let (mean, variance) = (moments.x, (moments.y - moments.x * moments.x).abs());
    if distance <= mean {
        return 1.0;
    }
    let bound = variance / (variance + (distance - mean) * (distance - mean));
    (bound * bound * bound).max(0.05)
}

fn crushed(weight: f32) -> f32 {
    if weight < CRUSHED { weight * weight * weight / (CRUSHED * CRUSHED) } else { weight }
}

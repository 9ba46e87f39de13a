//! The light around a probe in free space, as the irradiance that it gives to any normal.
//!
//! Irradiance is radiance convolved with the clamped cosine, which leaves little beyond the second band of spherical harmonics: nine
//! coefficients a colour hold it to a few hundredths (Ramamoorthi and Hanrahan, "An efficient representation for irradiance environment
//! maps", 2001).

use std::f32::consts::PI;

use glam::{Vec3, Vec4};
use vlm_format::Grid;

use super::refresh::FarSource;

/// Coefficients of real spherical harmonics up to the second band.
pub const COEFFICIENTS: usize = 9;

/// The clamped cosine, by band.
const COSINE: [f32; 3] = [PI, 2.0 * PI / 3.0, PI / 4.0];

/// Irradiance around a point of free space. 144 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FreeLight {
    /// Coefficients in the order of [`harmonics`], each red, green, blue in lx, and a number that is not used.
    pub coefficients: [Vec4; COEFFICIENTS],
}

impl FreeLight {
    /// Irradiance for a unit normal, lx, no less than 0.
    #[must_use]
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        let mut irradiance = Vec4::ZERO;
        for (coefficient, harmonic) in self.coefficients.iter().zip(harmonics(normal)) {
            irradiance += *coefficient * harmonic;
        }
        irradiance.truncate().max(Vec3::ZERO)
    }

    /// The band of a coefficient, 0 to 2.
    #[must_use]
    pub fn band(coefficient: usize) -> usize {
        match coefficient {
            0 => 0,
            1..4 => 1,
            _ => 2,
        }
    }

    /// What is left of each band of a source that fills this share of all directions: it counts as a disk.
    #[must_use]
    pub fn blur(share: f32) -> [f32; 3] {
        [1.0, 1.0 - share, (1.0 - share) * (1.0 - 2.0 * share)]
    }

    /// Adds the light of a source of this `radiosity` (lx) that fills the `share` of all directions around `direction` (a unit vector).
    pub fn add(&mut self, direction: Vec3, share: f32, radiosity: Vec3) {
        let harmonics = harmonics(direction);
        // Radiance is radiosity / pi, the solid angle 4 pi share.
        let strength = radiosity * (4.0 * share);
        let blur = Self::blur(share);
        for (i, (coefficient, harmonic)) in self.coefficients.iter_mut().zip(harmonics).enumerate() {
            let band = Self::band(i);
            *coefficient += (strength * (COSINE[band] * blur[band] * harmonic)).extend(0.0);
        }
    }
}

/// Real spherical harmonics of a unit vector: the constant; y, z, x; xy, yz, 3z^2 - 1, xz, x^2 - y^2, each of unit norm.
#[must_use]
pub fn harmonics(Vec3 { x, y, z }: Vec3) -> [f32; COEFFICIENTS] {
    const C0: f32 = 0.282_094_8;
    const C1: f32 = 0.488_602_5;
    const C2: f32 = 1.092_548_4;
    const C3: f32 = 0.315_391_57;
    const C4: f32 = 0.546_274_2;
    [
        C0,
        C1 * y,
        C1 * z,
        C1 * x,
        C2 * x * y,
        C2 * y * z,
        C3 * (3.0 * z * z - 1.0),
        C2 * x * z,
        C4 * (x * x - y * y),
    ]
}

/// The light around a probe, from its row; `radiosity` is that of the sources.
#[must_use]
pub fn free_light(grid: &Grid, number: usize, sources: &[FarSource], radiosity: &[Vec3]) -> FreeLight {
    let mut light = FreeLight::default();
    let Some(probe) = grid.probes.get(number) else { return light };
    for (source, weight) in grid.row(number) {
        let source = source as usize;
        let Some((source, &radiosity)) = sources.get(source).zip(radiosity.get(source)) else { continue };
        if let Some(direction) = (source.centroid - probe.position).try_normalize() {
            light.add(direction, (weight as f32 * probe.row_scale).min(1.0), radiosity);
        }
    }
    light
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_from_all_sides_is_the_same_for_every_normal() {
        let mut light = FreeLight::default();
        let sides = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        sides.iter().for_each(|&side| light.add(side, 1.0 / 6.0, Vec3::splat(3.0)));
        for normal in [Vec3::X, Vec3::new(0.6, 0.0, -0.8), Vec3::splat(1.0 / 3.0_f32.sqrt())] {
            assert!((light.irradiance(normal) - 3.0).abs().max_element() < 1e-4, "{light:?}");
        }
    }

    #[test]
    fn a_small_source_follows_the_cosine() {
        let mut light = FreeLight::default();
        let (direction, share) = (Vec3::new(0.48, 0.6, 0.64), 1e-4);
        light.add(direction, share, Vec3::ONE);
        // The second band errs by 3/8 of the mean at the horizon.
        for normal in [direction, -direction, Vec3::new(-0.8, 0.64, 0.0), Vec3::X, Vec3::Y, Vec3::Z] {
            let expected = 4.0 * share * direction.dot(normal).max(0.0);
            let found = light.irradiance(normal).x;
            assert!((found - expected).abs() < 0.4 * share, "{normal}: {found} {expected}");
        }
    }

    #[test]
    fn a_source_that_fills_half_of_the_directions_is_a_half_space() {
        let mut light = FreeLight::default();
        light.add(Vec3::Y, 0.5, Vec3::ONE);
        for (normal, expected) in [(Vec3::Y, 1.0), (Vec3::X, 0.5), (Vec3::NEG_Y, 0.0)] {
            assert!((light.irradiance(normal).x - expected).abs() < 1e-5);
        }
    }

    #[test]
    fn nothing_is_negative() {
        let mut light = FreeLight::default();
        light.add(Vec3::Z, 0.01, Vec3::ONE);
        let around = (0..200).map(|i| Vec3::new((i as f32 * 0.1).sin(), 0.0, (i as f32 * 0.1).cos()));
        assert!(around.map(|n| light.irradiance(n).min_element()).all(|e| e >= 0.0));
    }
}

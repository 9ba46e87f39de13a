//! Phase 1: how much each virtual light emits, from the direct light on the visible surface that it stands for.

use glam::Vec3;
use rayon::prelude::*;
use vlm_format::{Grid, Uncovered};

use super::upload::LightSet;

/// The radiosity of each light, lx: `B = emission + sum over its samples of reflectance * E`.
///
/// `irradiance(position, normal)` is the host's direct light with shadows at a point of the visible surface, lx, world
/// space.
#[must_use]
pub fn inject(lights: &LightSet, irradiance: impl Fn(Vec3, Vec3) -> Vec3 + Sync) -> Vec<Vec3> {
    radiosity(lights, &reflect(lights, irradiance))
}

/// What each sample adds to its light's radiosity, lx: `reflectance * E`.
#[must_use]
pub fn reflect(lights: &LightSet, irradiance: impl Fn(Vec3, Vec3) -> Vec3 + Sync) -> Vec<Vec3> {
    lights.samples.par_iter().map(|s| s.reflectance * irradiance(s.position, s.normal)).collect()
}

/// The radiosity of each light from what its samples reflect, one per sample.
#[must_use]
pub fn radiosity(lights: &LightSet, reflected: &[Vec3]) -> Vec<Vec3> {
    let radiosity = |light: usize| {
        let own = lights.sample_range(light).and_then(|range| reflected.get(range)).unwrap_or(&[]);
        lights.emission.get(light).copied().unwrap_or_default() + own.iter().sum::<Vec3>()
    };
    (0..lights.len()).into_par_iter().map(radiosity).collect()
}

/// The radiosity of each piece of surface for which no light stands, lx; `irradiance` as in [`inject`].
#[must_use]
pub fn uncovered_radiosity(
    uncovered: &[Uncovered],
    irradiance: impl Fn(Vec3, Vec3) -> Vec3 + Sync,
) -> Vec<Vec3> {
    let radiosity =
        |piece: &Uncovered| piece.reflectance * irradiance(piece.position, piece.normal) + piece.emission;
    uncovered.par_iter().map(radiosity).collect()
}

/// The radiosity of the grid's sources, lx: of the surface around each sample, of the surface of each light, and of surface for which
/// none stands.
#[must_use]
pub fn source_radiosity(grid: &Grid, lights: &LightSet, reflected: &[Vec3], uncovered: &[Vec3]) -> Vec<Vec3> {
    let mut sources = vec![Vec3::ZERO; lights.samples.len() + lights.len()];
    let (of_samples, of_lights) = sources.split_at_mut(lights.samples.len());
    let radiosity = radiosity(lights, reflected);
    for (light, (of_light, radiosity)) in of_lights.iter_mut().zip(radiosity).enumerate() {
        let gain = grid.surface_gains.get(light).copied().unwrap_or(0.0);
        *of_light = radiosity * gain;
        let emission = lights.emission.get(light).copied().unwrap_or_default();
        for sample in lights.sample_range(light).unwrap_or_default() {
            let share = grid.sample_shares.get(sample).copied().unwrap_or(1.0);
            if let Some((of_sample, reflected)) = of_samples.get_mut(sample).zip(reflected.get(sample)) {
                *of_sample = (*reflected / share + emission) * gain;
            }
        }
    }
    sources.extend_from_slice(uncovered);
    sources
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::form_factor::LightGeometry;
    use vlm_format::Sample;

    #[test]
    fn emission_and_reflection_add_up() {
        let sample = |x: f32, share: f32| Sample {
            position: Vec3::X * x,
            normal: Vec3::Z,
            reflectance: Vec3::new(0.8, 0.4, 0.2) * share,
        };
        let lights = LightSet {
            geometry: vec![LightGeometry::default(); 2],
            tags: vec![0; 2],
            emission: vec![Vec3::ZERO, Vec3::splat(5.0)],
            sample_starts: vec![0, 2, 2],
            samples: vec![sample(1.0, 0.25), sample(2.0, 0.75)],
        };
        let radiosity = inject(&lights, |position, _| Vec3::splat(position.x));
        let expected = Vec3::new(0.8, 0.4, 0.2) * (0.25 + 1.5);
        assert!((radiosity[0] - expected).length() < 1e-6);
        assert_eq!(radiosity[1], Vec3::splat(5.0));
    }
}

//! Phase 1: how much each virtual light emits, from the direct light on the visible surface that it stands for.

use glam::Vec3;
use rayon::prelude::*;

use super::upload::LightSet;

/// The radiosity of each light, lx: `B = emission + sum over its samples of reflectance * E`.
///
/// `irradiance(position, normal)` is the host's direct light with shadows at a point of the visible surface, lx, world
/// space.
#[must_use]
pub fn inject(lights: &LightSet, irradiance: impl Fn(Vec3, Vec3) -> Vec3 + Sync) -> Vec<Vec3> {
    let radiosity = |light: usize| {
        let samples = lights.samples_of(light).iter();
        let reflected: Vec3 = samples.map(|s| s.reflectance * irradiance(s.position, s.normal)).sum();
        lights.emission.get(light).copied().unwrap_or_default() + reflected
    };
    (0..lights.len()).into_par_iter().map(radiosity).collect()
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

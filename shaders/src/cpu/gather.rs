//! Phase 2: the irradiance that a list of virtual lights gives to a point.

use glam::Vec3;

use super::form_factor::{Receivers, form_factor, form_factors, is_behind};
use super::upload::LightSet;

/// A shaded point. 40 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Receiver {
    /// Metres, world space.
    pub position: Vec3,
    /// Unit shading normal: cosines use it.
    pub normal: Vec3,
    /// Unit normal of the surface itself: no light comes from behind it.
    pub geometric_normal: Vec3,
    /// 0 for none; lights of the same tag are skipped.
    pub tag: u32,
}

/// What a list of lights gives to a point, and what that took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gathered {
    /// Indirect irradiance, lx.
    pub irradiance: Vec3,
    /// Lights whose geometry was read: those of the list that are neither black nor of the receiver's tag.
    pub pairs: u64,
}

/// `E(x) = sum over the listed lights of F * B`; `radiosity` is phase 1's result, one per light, lx.
#[must_use]
pub fn gather(
    lights: &LightSet,
    radiosity: &[Vec3],
    list: impl IntoIterator<Item = u32>,
    receiver: &Receiver,
) -> Gathered {
    let mut gathered = Gathered::default();
    for light in list {
        let light = light as usize;
        let Some((geometry, &radiosity)) = lights.geometry.get(light).zip(radiosity.get(light)) else {
            continue;
        };
        let tag = lights.tags.get(light).copied().unwrap_or(0);
        if radiosity == Vec3::ZERO || (tag != 0 && tag == receiver.tag) {
            continue;
        }
        gathered.pairs += 1;
        if !is_behind(geometry, receiver.position, receiver.geometric_normal) {
            let form_factor = form_factor(geometry, receiver.position, receiver.normal);
            gathered.irradiance += radiosity * form_factor;
        }
    }
    gathered
}

/// Lights summed before they are added to the rest. A plain sum of `N` numbers in f32 errs by up to `N/2` roundings, one
/// of blocks by as many as a block and the number of blocks have; compensated sums do not survive GPU compilers.
const SUM_BLOCK: usize = 64;

/// [`gather`] for points that share a list: the lights one after the other, the points several at a time.
///
/// Sums differ from those of [`gather`] by rounding alone.
#[must_use]
pub fn gather_together(
    lights: &LightSet,
    radiosity: &[Vec3],
    list: &[u32],
    receivers: &[Receiver],
) -> Vec<Gathered> {
    let points = Receivers::on_surfaces(receivers.iter().map(|r| (r.position, r.normal, r.geometric_normal)));
    let mut gathered = vec![Gathered::default(); receivers.len()];
    let mut block = vec![Vec3::ZERO; receivers.len()];
    let mut form_factor = vec![0.0; receivers.len()];
    for lights_of_block in list.chunks(SUM_BLOCK) {
        block.fill(Vec3::ZERO);
        for &light in lights_of_block {
            let light = light as usize;
            let Some((geometry, &radiosity)) = lights.geometry.get(light).zip(radiosity.get(light)) else {
                continue;
            };
            if radiosity == Vec3::ZERO {
                continue;
            }
            form_factors(geometry, &points, &mut form_factor);
            let tag = lights.tags.get(light).copied().unwrap_or(0);
            for (i, receiver) in receivers.iter().enumerate() {
                if tag == 0 || tag != receiver.tag {
                    gathered[i].pairs += 1;
                    block[i] += radiosity * form_factor[i];
                }
            }
        }
        for (gathered, block) in gathered.iter_mut().zip(&block) {
            gathered.irradiance += *block;
        }
    }
    gathered
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::form_factor::LightGeometry;
    use glam::DVec3;

    fn lights(tags: Vec<u32>) -> LightSet {
        let light = LightGeometry::new([
            DVec3::new(0.0, 0.0, 1.0),
            DVec3::new(0.0, 1.0, 1.0),
            DVec3::new(1.0, 0.0, 1.0),
        ]);
        LightSet {
            geometry: vec![light; tags.len()],
            emission: vec![Vec3::ZERO; tags.len()],
            sample_starts: vec![0; tags.len() + 1],
            samples: Vec::new(),
            tags,
        }
    }

    fn receiver(tag: u32) -> Receiver {
        Receiver { position: Vec3::ZERO, normal: Vec3::Z, geometric_normal: Vec3::Z, tag }
    }

    #[test]
    fn tags_and_black_lights_are_skipped() {
        let lights = lights(vec![0, 7, 0]);
        let radiosity = [Vec3::ONE, Vec3::ONE, Vec3::ZERO];
        let untagged = gather(&lights, &radiosity, 0..3, &receiver(0));
        let tagged = gather(&lights, &radiosity, 0..3, &receiver(7));
        let other = gather(&lights, &radiosity, 0..3, &receiver(8));
        assert_eq!((untagged.pairs, tagged.pairs, other.pairs), (2, 1, 2));
        assert!((untagged.irradiance - 2.0 * tagged.irradiance).length() < 1e-6);
        assert_eq!(untagged, other);
        assert!(tagged.irradiance.x > 0.05);
    }

    #[test]
    fn nothing_comes_from_behind_the_surface() {
        let lights = lights(vec![0]);
        let behind = Receiver { geometric_normal: -Vec3::Z, ..receiver(0) };
        assert_eq!(gather(&lights, &[Vec3::ONE], 0..1, &behind).irradiance, Vec3::ZERO);
    }

    #[test]
    fn together_as_alone() {
        let lights = lights(vec![0, 7, 0, 0]);
        let radiosity = [Vec3::ONE, Vec3::X, Vec3::ZERO, Vec3::new(0.1, 0.2, 0.3)];
        let receivers: Vec<Receiver> = (0..100)
            .map(|i| Receiver {
                position: Vec3::new(i as f32 / 50.0 - 1.0, 0.3, 0.1),
                geometric_normal: if i % 5 == 0 { -Vec3::Z } else { Vec3::new(0.0, 0.6, 0.8) },
                ..receiver(7 * (i % 2))
            })
            .collect();
        let list = [0, 1, 2, 3, 99];
        let together = gather_together(&lights, &radiosity, &list, &receivers);
        let mut lit = 0;
        for (receiver, together) in receivers.iter().zip(together) {
            let alone = gather(&lights, &radiosity, list, receiver);
            assert_eq!(alone.pairs, together.pairs);
            assert!((alone.irradiance - together.irradiance).length() < 1e-6);
            lit += u32::from(alone.irradiance.y > 0.0);
        }
        assert_eq!(lit, 80);
    }

    #[test]
    fn numbers_out_of_range_add_nothing() {
        assert_eq!(gather(&lights(vec![0]), &[Vec3::ONE], [1, u32::MAX], &receiver(0)), Gathered::default());
    }
}

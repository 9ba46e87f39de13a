//! The lights of an asset in world space: the flat arrays that phases 1 and 2 read.

use glam::{DMat3, DMat4, DVec3, Vec3};
use vlm_format::{Sample, Vlm, VlmAsset};

use super::form_factor::LightGeometry;

/// Every light of an asset in world space. Arrays without another note have one element per light.
#[derive(Clone, Debug, Default)]
pub struct LightSet {
    /// Where the lights are.
    pub geometry: Vec<LightGeometry>,
    /// 0 for none: a receiver of the same tag is never lit.
    pub tags: Vec<u32>,
    /// Radiosity that a light emits by itself, lx.
    pub emission: Vec<Vec3>,
    /// One more than lights: samples of light `i` are `samples[sample_starts[i]..sample_starts[i + 1]]`.
    pub sample_starts: Vec<u32>,
    /// Points on the visible surface, world space.
    pub samples: Vec<Sample>,
}

impl LightSet {
    /// Moves an asset's lights and samples into world space. `world_from_node` gives a node's global transform by its
    /// index in the glTF file. Lights that belong to no VLM stay where they are.
    #[must_use]
    pub fn new(asset: &VlmAsset, world_from_node: impl Fn(u32) -> DMat4) -> Self {
        let light_count = asset.triangles.len();
        let mut set = Self {
            geometry: (0..light_count).map(|light| world_light(asset, light, DMat4::IDENTITY)).collect(),
            tags: asset.tags.clone(),
            emission: asset.emission.clone(),
            sample_starts: asset.sample_starts.clone(),
            samples: asset.samples.clone(),
        };
        set.tags.resize(light_count, 0);
        set.emission.resize(light_count, Vec3::ZERO);
        let last_sample = set.sample_starts.last().copied().unwrap_or(0);
        set.sample_starts.resize(light_count + 1, last_sample);
        for vlm in &asset.vlms {
            set.transform(asset, vlm, world_from_node(vlm.node));
        }
        set
    }

    /// Number of lights.
    #[must_use]
    pub fn len(&self) -> usize {
        self.geometry.len()
    }

    /// True if there are no lights.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.geometry.is_empty()
    }

    /// The samples of one light; none for a number out of range.
    #[must_use]
    pub fn samples_of(&self, light: usize) -> &[Sample] {
        self.sample_range(light).and_then(|range| self.samples.get(range)).unwrap_or(&[])
    }

    /// The numbers of the samples of one light.
    #[must_use]
    pub fn sample_range(&self, light: usize) -> Option<std::ops::Range<usize>> {
        let range = self.sample_starts.get(light).zip(self.sample_starts.get(light + 1));
        range.map(|(&start, &end)| start as usize..end as usize)
    }

    fn transform(&mut self, asset: &VlmAsset, vlm: &Vlm, world_from_node: DMat4) {
        let lights = vlm.lights[0] as usize..vlm.lights[0].saturating_add(vlm.lights[1]) as usize;
        for light in lights.clone() {
            if let Some(geometry) = self.geometry.get_mut(light) {
                *geometry = world_light(asset, light, world_from_node);
            }
        }
        let starts = self.sample_starts.get(lights.start).zip(self.sample_starts.get(lights.end));
        let Some((&start, &end)) = starts else { return };
        let Some(samples) = self.samples.get_mut(start as usize..end as usize) else { return };
        let normal_matrix = DMat3::from_mat4(world_from_node).inverse().transpose();
        for sample in samples {
            sample.position = world_from_node.transform_point3(sample.position.as_dvec3()).as_vec3();
            let normal = normal_matrix * sample.normal.as_dvec3();
            sample.normal = normal.try_normalize().map_or(sample.normal, |n| n.as_vec3());
        }
    }
}

/// A light without area, which lights nothing, where the asset's indices are out of range.
fn world_light(asset: &VlmAsset, light: usize, world_from_node: DMat4) -> LightGeometry {
    LightGeometry::new(world_corners(asset, light, world_from_node))
}

/// The corners of a light in world space, metres, counter-clockwise seen from the emitting side; the node's origin where the asset's
/// indices are out of range.
#[must_use]
pub fn world_corners(asset: &VlmAsset, light: usize, world_from_node: DMat4) -> [DVec3; 3] {
    let corner = |i: u32| asset.positions.get(i as usize).copied().unwrap_or_default().as_dvec3();
    let triangle = asset.triangles.get(light).copied().unwrap_or_default();
    let mut corners: [DVec3; 3] = triangle.map(|i| world_from_node.transform_point3(corner(i)));
    // A mirroring transform turns the winding, but the light still shines out of the object.
    if world_from_node.determinant() < 0.0 {
        corners.swap(1, 2);
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::form_factor::form_factor;

    fn asset() -> VlmAsset {
        VlmAsset {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            sample_starts: vec![0, 1],
            samples: vec![Sample { position: Vec3::X, normal: Vec3::Z, reflectance: Vec3::ONE }],
            vlms: vec![Vlm { lights: [0, 1], vertices: [0, 3], ..Vlm::default() }],
            ..VlmAsset::default()
        }
    }

    #[test]
    fn a_mirrored_node_keeps_its_light_shining_outward() {
        let receiver = Vec3::new(-0.2, 0.2, 1.0);
        let mirror = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        let set = LightSet::new(&asset(), |_| mirror);
        assert!(form_factor(&set.geometry[0], receiver, -Vec3::Z) > 0.05);
        assert_eq!(form_factor(&set.geometry[0], receiver * Vec3::new(1.0, 1.0, -1.0), Vec3::Z), 0.0);
        assert_eq!(set.samples[0].position, -Vec3::X);
        assert_eq!(set.samples[0].normal, Vec3::Z);
    }

    #[test]
    fn normals_stay_perpendicular_under_stretching() {
        let mut asset = asset();
        asset.samples[0].normal = Vec3::new(1.0, 1.0, 0.0).normalize_or_zero();
        let set = LightSet::new(&asset, |_| DMat4::from_scale(DVec3::new(2.0, 1.0, 1.0)));
        let tangent = Vec3::new(2.0, -1.0, 0.0);
        assert!(set.samples[0].normal.dot(tangent).abs() < 1e-6);
    }

    #[test]
    fn broken_indices_make_dark_lights() {
        let mut asset = asset();
        asset.triangles[0] = [0, 7, 9];
        asset.vlms[0].lights = [0, u32::MAX];
        asset.sample_starts = vec![0, 9];
        let set = LightSet::new(&asset, |_| DMat4::IDENTITY);
        assert_eq!(form_factor(&set.geometry[0], Vec3::Z, -Vec3::Z), 0.0);
        assert!(set.samples_of(0).is_empty() && set.samples_of(5).is_empty());
    }
}

//! The lights of an asset in world space.

use glam::DVec3;
use vlm_format::VlmAsset;
use vlm_shaders::cpu::upload::world_corners;

use crate::scene::Scene;
use crate::topology::{area, cross_of};

/// One element per light of the asset.
pub struct WorldLights {
    /// Counter-clockwise seen from the emitting side, metres.
    pub corners: Vec<[DVec3; 3]>,
    /// Unit normals on the emitting side; zero for a light without area.
    pub normals: Vec<DVec3>,
    /// Index into [`Scene::objects`]; `None` if the scene lacks the node.
    pub objects: Vec<Option<u32>>,
    /// Made by an artist.
    pub authored: Vec<bool>,
}

impl WorldLights {
    /// Moves the lights into world space.
    pub fn new(scene: &Scene, asset: &VlmAsset) -> Self {
        let count = asset.triangles.len();
        let mut lights = Self {
            corners: vec![[DVec3::ZERO; 3]; count],
            normals: vec![DVec3::ZERO; count],
            objects: vec![None; count],
            authored: vec![false; count],
        };
        for vlm in &asset.vlms {
            let object = scene.objects.iter().position(|o| o.node == vlm.node);
            let world_from_node = object.map(|o| scene.objects[o].world_from_node).unwrap_or_default();
            for l in (vlm.lights[0] as usize..).take(vlm.lights[1] as usize).take_while(|&l| l < count) {
                let corners = world_corners(asset, l, world_from_node);
                lights.corners[l] = corners;
                lights.normals[l] = cross_of(corners).normalize_or_zero();
                lights.objects[l] = object.map(|o| o as u32);
                lights.authored[l] = vlm.authored;
            }
        }
        lights
    }

    /// Area of a light, square metres.
    pub fn area(&self, light: usize) -> f64 {
        area(self.corners[light])
    }
}

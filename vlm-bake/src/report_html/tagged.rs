//! Which tag the visible surface bears.

use rustc_hash::FxHashMap;
use vlm_format::VlmAsset;

use crate::scene::Scene;

/// The tags of the scene's triangles.
pub struct SurfaceTags<'a> {
    scene: &'a Scene,
    by_primitive: FxHashMap<(u32, u32), u32>,
}

impl<'a> SurfaceTags<'a> {
    /// Collects the asset's tags of surface.
    pub fn new(scene: &'a Scene, asset: &VlmAsset) -> Self {
        let by_primitive =
            asset.primitive_tags.iter().map(|&(mesh, primitive, tag)| ((mesh, primitive), tag));
        Self { scene, by_primitive: by_primitive.collect() }
    }

    /// The tag of a triangle of the scene, 0 for none.
    pub fn of(&self, triangle: u32) -> u32 {
        let primitive = self.scene.triangle_primitive.get(triangle as usize);
        let primitive = primitive.and_then(|&p| self.scene.primitives.get(p as usize));
        primitive.and_then(|p| self.by_primitive.get(&(p.mesh, p.primitive))).copied().unwrap_or(0)
    }
}

//! What methods with virtual area lights share: their rays and their bytes.

use std::sync::Arc;

use glam::Vec3;
use vlm_bake::render::{RenderStats, world_lights};
use vlm_bake::shade::TraceScene;
use vlm_format::Sample;
use vlm_shaders::cpu::form_factor::LightGeometry;
use vlm_shaders::cpu::upload::LightSet;

use crate::method::{Baked, MethodError, Picture, Stage};

/// Lights of a bake, and what phase 1 does with them in every frame.
pub struct AreaLights {
    /// The lights in node space.
    pub baked: Arc<Baked>,
    /// The same in world space.
    pub world: LightSet,
    /// Shadow rays of phase 1.
    inject_rays: u64,
}

impl AreaLights {
    /// Moves the lights into world space and counts phase 1's rays.
    ///
    /// # Errors
    /// If a light belongs to no node of the scene.
    pub fn new(stage: &Stage<'_>, baked: Arc<Baked>) -> Result<Self, MethodError> {
        let world = world_lights(stage.trace.scene, &baked.asset)?;
        let rays = |s: &Sample| shadow_rays(stage.trace, s.position, s.normal, s.normal);
        let inject_rays = world.samples.iter().map(rays).sum();
        Ok(Self { baked, world, inject_rays })
    }

    /// What phases 1 and 2 keep, without any list: geometry, tags, emission, radiosity and samples, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let light = size_of::<LightGeometry>() + size_of::<u32>() + 2 * size_of::<Vec3>();
        let samples = self.world.samples.len() * size_of::<Sample>();
        (self.world.len() * light + self.world.sample_starts.len() * size_of::<u32>() + samples) as u64
    }

    /// A picture by these lights.
    #[must_use]
    pub fn picture(&self, (indirect, stats): (Vec<Vec3>, RenderStats)) -> Picture {
        Picture {
            indirect,
            seconds: stats.seconds,
            lights: stats.lights,
            pairs: stats.pairs_evaluated,
            rays: self.inject_rays,
        }
    }
}

/// The rays that [`TraceScene::direct_irradiance`] traces: one for each light in front of the surface.
#[must_use]
pub fn shadow_rays(scene: &TraceScene<'_>, position: Vec3, normal: Vec3, geometric_normal: Vec3) -> u64 {
    let is_in_front = |direction: Vec3| normal.dot(direction) > 0.0 && geometric_normal.dot(direction) > 0.0;
    let arriving = scene.lights.iter().filter_map(|light| light.incident(position));
    arriving.filter(|incident| is_in_front(incident.direction)).count() as u64
}

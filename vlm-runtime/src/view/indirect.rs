//! indirect: the virtual lights by one method: what the runtime crate does for a game.

use std::sync::Arc;

use glam::{Vec3, Vec4};
use vlm_bake::render::Method;
use vlm_bake::scene::Scene;
use wgpu::CommandEncoder;

use super::arguments::ShadowsArg;
use super::error::ViewError;
use super::gpu::Gpu;
use super::shadows::{Rays, Shadows};
use super::targets::FrameTargets;
use crate::{
    Frame, FrameStats, IrradianceFormat, PunctualLight, Settings, Targets, View, Visibility, VlmAsset,
    VlmRenderer,
};

/// A renderer with an asset, and the shadows of its points.
pub(crate) struct Indirect {
    renderer: VlmRenderer,
    shadows: Shadows,
    counts_pairs: bool,
}

impl Indirect {
    /// Loads the asset into a renderer of [`renderer`].
    pub(crate) fn new(
        mut renderer: VlmRenderer,
        asset: &VlmAsset,
        (shadows, on): (ShadowsArg, (&Gpu, &Arc<Scene>, &Rays)),
        counts_pairs: bool,
    ) -> Result<Self, ViewError> {
        renderer.load(asset)?;
        let shadows = Shadows::new(shadows, on, renderer.points()?);
        Ok(Self { renderer, shadows, counts_pairs })
    }

    /// The renderer, without an asset, for the next one.
    pub(crate) fn into_renderer(mut self) -> VlmRenderer {
        self.renderer.unload();
        self.renderer
    }

    /// Says what the next frame shows. Shadows that are still being traced come in a later frame, unless it `must_wait`.
    pub(crate) fn prepare(
        &mut self,
        gpu: &Gpu,
        (lights, tints): (&[PunctualLight], &[Vec3]),
        view: View,
        must_wait: bool,
    ) -> Result<(), ViewError> {
        self.shadows.update(lights, must_wait)?;
        self.renderer.set_tints(&gpu.queue, tints)?;
        let maps = self.shadows.maps();
        let visibility = maps.as_deref().map_or_else(|| self.shadows.visibility(), Visibility::Maps);
        Ok(self.renderer.prepare(&gpu.queue, &Frame { lights, visibility, view, ..Frame::default() })?)
    }

    /// Adds phase 1.
    pub(crate) fn record_light(&mut self, encoder: &mut CommandEncoder) -> Result<FrameStats, ViewError> {
        Ok(self.renderer.record_light(encoder)?)
    }

    /// Adds phase 2, into the plane of that number; `stats` are those of phase 1.
    pub(crate) fn record_gather(
        &mut self,
        encoder: &mut CommandEncoder,
        targets: &FrameTargets,
        plane: usize,
        stats: &mut FrameStats,
    ) -> Result<(), ViewError> {
        let gathered = self.renderer.record(
            encoder,
            &Targets {
                depth: &targets.depth.view,
                normal: &targets.normal.view,
                geometric_normal: Some(&targets.geometric_normal.view),
                tag: Some(&targets.tag.view),
                moving: None,
                irradiance: &targets.indirect[plane.min(1)].view,
            },
        )?;
        stats.passes.extend(gathered.passes);
        stats.bytes_uploaded += gathered.bytes_uploaded;
        Ok(())
    }

    /// Pairs of a pixel and a light that the last gather read; 0 where they are not counted. Waits for the device.
    pub(crate) fn pairs(&self, gpu: &Gpu) -> Result<u64, ViewError> {
        if self.counts_pairs { Ok(self.renderer.pairs_evaluated(&gpu.queue)?) } else { Ok(0) }
    }

    /// Radiosity of the lights after phase 1, lx. Waits for the device.
    pub(crate) fn radiosity(&self, gpu: &Gpu) -> Result<Vec<Vec4>, ViewError> {
        Ok(self.renderer.radiosity(&gpu.queue)?)
    }

    /// Better shadows are on their way.
    pub(crate) fn is_pending(&self) -> bool {
        self.shadows.is_pending()
    }
}

/// A renderer that gathers by a method.
pub(crate) fn renderer(gpu: &Gpu, method: Method, counts_pairs: bool) -> Result<VlmRenderer, ViewError> {
    let normal = Settings::default();
    let fewest = if method == Method::Brute { u32::MAX } else { normal.fewest_lights_for_grid };
    let settings = Settings {
        fewest_lights_for_grid: fewest,
        count_pairs: counts_pairs,
        format: IrradianceFormat::Float,
        ..normal
    };
    Ok(VlmRenderer::new(&gpu.device, settings)?)
}

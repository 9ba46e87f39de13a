//! viewer: a scene on the device, and its frames, stage by stage.

use std::sync::Arc;

use glam::Vec3;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::render::{PhaseSeconds, RenderStats, Rendering};
use vlm_bake::scene::{Camera, Scene};
use vlm_bake::shade::SurfacePoint;
use vlm_shaders::cpu::resolve::auto_exposure;
use wgpu::{TextureFormat, TextureUsages};

use super::arguments::ShadowsArg;
use super::controls::Controls;
use super::error::ViewError;
use super::eye::Eye;
use super::gpu::Gpu;
use super::indirect::Indirect;
use super::open::Opened;
use super::overlay::OverlayStage;
use super::pixel_light::PixelLightStage;
use super::readback::{elements, pixels};
use super::resolve::{ResolveStage, Screen};
use super::scene_buffers::SceneBuffers;
use super::shaders::Sources;
use super::shadows::Rays;
use super::shown::{Shown, Wanted, submit};
use super::surface::SurfaceStage;
use super::targets::{FrameTargets, Plane};
use super::times::{PassTimes, Stopwatch};
use crate::{FrameStats, VlmAsset, VlmRenderer};

/// The format of pictures without a window.
pub const PICTURE_FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;

/// Choices for a viewer's whole life.
#[derive(Clone, Copy, Debug)]
pub struct ViewerOptions {
    /// Of what is drawn to: four bytes without sRGB, since the viewer encodes by itself.
    pub format: TextureFormat,
    /// What finds shadows.
    pub shadows: ShadowsArg,
    /// Wait for each phase, take its time, and count pairs: for reports. Else a frame waits for nothing.
    pub measures: bool,
}

/// Draws frames of one scene after the other.
pub struct Viewer {
    gpu: Gpu,
    options: ViewerOptions,
    sources: Sources,
    surface: SurfaceStage,
    pixel_light: PixelLightStage,
    resolve: ResolveStage,
    overlay: OverlayStage,
    stopwatch: Stopwatch,
    targets: Option<FrameTargets>,
    shown: Option<Shown>,
    /// Renderers for the next scene; see [`Shown::spare`].
    spare: [Option<VlmRenderer>; 2],
    /// What the targets hold.
    done: Option<Wanted>,
    generation: u64,
}

/// What a frame took.
#[derive(Clone, Debug, Default)]
pub struct FrameReport {
    /// Of the first method that has virtual lights.
    pub stats: FrameStats,
    /// Where it was measured.
    pub seconds: PhaseSeconds,
    /// Where they were counted.
    pub pairs_evaluated: u64,
    /// Better shadows are on their way: ask for another frame.
    pub is_pending: bool,
    /// Something had changed since the last frame.
    pub is_new: bool,
}

impl Viewer {
    /// Compiles all passes.
    ///
    /// # Errors
    /// If the device lacks what they need.
    pub fn new(gpu: Gpu, sources: Sources, options: ViewerOptions) -> Result<Self, ViewError> {
        Ok(Self {
            surface: SurfaceStage::new(&gpu, &sources)?,
            pixel_light: PixelLightStage::new(&gpu, &sources)?,
            resolve: ResolveStage::new(&gpu, &sources, options.format)?,
            overlay: OverlayStage::new(&gpu, &sources, options.format)?,
            stopwatch: Stopwatch::new(&gpu),
            gpu,
            options,
            sources,
            targets: None,
            shown: None,
            spare: [None, None],
            done: None,
            generation: 0,
        })
    }

    /// The device.
    #[must_use]
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The scene that is shown.
    #[must_use]
    pub fn scene(&self) -> Option<&Scene> {
        self.shown.as_ref().map(|shown| shown.scene.as_ref())
    }

    /// The lights that are shown.
    #[must_use]
    pub fn asset(&self) -> Option<&VlmAsset> {
        self.shown.as_ref()?.asset.as_ref()
    }

    /// Puts a scene on the device in place of the last one, and takes it over into the controls. Where that fails, the last one stays.
    ///
    /// # Errors
    /// If it does not fit the device, or a method needs lights that there are not.
    pub fn show(&mut self, opened: Opened, controls: &mut Controls) -> Result<(), ViewError> {
        let buffers = SceneBuffers::new(&self.gpu, &self.surface, &opened)?;
        let scene = Arc::new(opened.scene);
        let rays = Rays::new(scene.clone(), controls.alpha_masks);
        let spare = std::mem::take(&mut self.spare);
        let mut shown = Shown { scene, asset: opened.asset, buffers, rays, indirect: [None, None], spare };
        for method in controls.methods() {
            shown.by(&self.gpu, method, self.options)?;
        }
        let overlays = self.overlay.load(&self.gpu, shown.asset.as_ref())?;
        self.gpu.check()?;
        self.overlay.take(overlays);
        controls.adopt(&shown.scene, opened.groups);
        let before = self.shown.replace(shown);
        if let Some(Shown { indirect: [vlm, brute], spare: [spare_vlm, spare_brute], .. }) = before {
            let renderer = |indirect: Option<Indirect>| indirect.map(Indirect::into_renderer);
            self.spare = [renderer(vlm).or(spare_vlm), renderer(brute).or(spare_brute)];
        }
        self.generation += 1;
        Ok(())
    }

    /// Compiles the viewer's own shaders anew; those with an error stay as they were.
    ///
    /// # Errors
    /// The first shader that does not compile.
    pub fn reload_shaders(&mut self) -> Result<(), ViewError> {
        self.done = None;
        let results = [
            self.surface.recompile(&self.gpu, &self.sources),
            self.pixel_light.recompile(&self.gpu, &self.sources),
            self.resolve.recompile(&self.gpu, &self.sources),
            self.overlay.recompile(&self.gpu, &self.sources),
        ];
        results.into_iter().collect()
    }

    /// Makes the light of a frame, as far as it is not there already. `must_wait` for its shadows.
    ///
    /// # Errors
    /// If nothing is shown, or the picture cannot be made.
    pub fn frame(
        &mut self,
        controls: &Controls,
        camera: &Camera,
        size: [u32; 2],
        must_wait: bool,
    ) -> Result<FrameReport, ViewError> {
        if self.targets.as_ref().is_none_or(|targets| targets.size != size) {
            self.targets = Some(FrameTargets::new(&self.gpu, size)?);
            self.done = None;
        }
        let Some(shown) = &self.shown else { return Err(crate::Error::NotLoaded.into()) };
        let wanted = Wanted {
            generation: self.generation,
            camera: camera.clone(),
            size,
            alpha_masks: controls.alpha_masks,
            lights: controls.real_lights(),
            tints: controls.tints(),
            methods: controls.methods(),
        };
        let before = self.done.take();
        let is_pending = shown.indirect.iter().flatten().any(Indirect::is_pending);
        if before.as_ref() == Some(&wanted) && !is_pending {
            self.done = before;
            return Ok(FrameReport::default());
        }
        let eye = Eye::new(camera, size, shown.buffers.bounds);
        self.stopwatch.begin();
        self.draw_surface(&wanted, &eye, before)?;
        let (Some(shown), Some(targets)) = (&mut self.shown, &self.targets) else {
            return Err(crate::Error::NotLoaded.into());
        };
        let (gpu, watch) = (&self.gpu, &mut self.stopwatch);
        let mut report = FrameReport::default();
        for plane in (0..wanted.methods.len()).rev() {
            let on = (gpu, self.options, &mut *watch);
            report = shown.light(on, (targets, plane), (&wanted, &eye), must_wait)?;
        }
        submit(gpu, |encoder| {
            watch.end(encoder);
            Ok(())
        })?;
        self.gpu.check()?;
        report.is_pending = shown.indirect.iter().flatten().any(Indirect::is_pending);
        self.done = Some(wanted);
        Ok(report)
    }

    /// The visible surface and the real lights on it, as far as they are not what the targets hold.
    fn draw_surface(&mut self, wanted: &Wanted, eye: &Eye, before: Option<Wanted>) -> Result<(), ViewError> {
        let (Some(shown), Some(targets)) = (&self.shown, &self.targets) else { return Ok(()) };
        let (gpu, watch) = (&self.gpu, &mut self.stopwatch);
        let is_same_surface = before.as_ref().is_some_and(|before| before.same_surface(wanted));
        submit(gpu, |encoder| {
            if !is_same_surface {
                watch.lap(encoder, "surface");
                let masks = (eye, wanted.alpha_masks);
                self.surface.record(gpu, encoder, &shown.buffers, targets, masks);
            }
            if !is_same_surface || before.is_none_or(|before| before.lights != wanted.lights) {
                watch.lap(encoder, "pixel light");
                let on = (&shown.buffers, targets);
                self.pixel_light.record(gpu, encoder, on, (eye, &wanted.lights))?;
            }
            Ok(())
        })
    }

    /// Shows the last frame, with overlays.
    ///
    /// # Errors
    /// If there was none, or the device is lost.
    pub fn present(
        &mut self,
        controls: &Controls,
        camera: &Camera,
        screen: Screen<'_>,
    ) -> Result<(), ViewError> {
        let (Some(targets), Some(shown)) = (&self.targets, &self.shown) else {
            return Err(crate::Error::NotLoaded.into());
        };
        let gpu = &self.gpu;
        let eye = Eye::new(camera, targets.size, shown.buffers.bounds);
        let radiosity = match shown.indirect.iter().flatten().next() {
            Some(indirect) if controls.overlays.radiosity => indirect.radiosity(gpu)?,
            _ => Vec::new(),
        };
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.resolve.record(gpu, &mut encoder, targets, (screen, controls));
        if controls.overlays.any() {
            let on = (targets, &eye, shown.buffers.extent());
            self.overlay.record(gpu, &mut encoder, on, (screen, controls), &radiosity)?;
        }
        gpu.queue.submit([encoder.finish()]);
        self.gpu.check()
    }

    /// The last frame as `present` shows it, rows of RGB from the top.
    ///
    /// # Errors
    /// As [`Viewer::present`].
    pub fn picture(&mut self, controls: &Controls, camera: &Camera) -> Result<Vec<[u8; 3]>, ViewError> {
        let size = self.targets.as_ref().map_or([1, 1], |targets| targets.size);
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
        let plane = Plane::new(&self.gpu, "picture", size, self.options.format, usage);
        self.present(controls, camera, Screen { view: &plane.view, origin: [0, 0] })?;
        let pixels = pixels(&self.gpu, &plane.texture)?;
        self.gpu.check()?;
        Ok(pixels.iter().map(|p| [p.x as u8, p.y as u8, p.z as u8]).collect())
    }

    /// The last frame as the light that it is made of. Of its surface only albedo and emission are known.
    ///
    /// # Errors
    /// If there was none, or the device is lost.
    pub fn rendering(&self, report: &FrameReport) -> Result<Rendering, ViewError> {
        let Some(targets) = &self.targets else { return Err(crate::Error::NotLoaded.into()) };
        let gpu = &self.gpu;
        let [albedo, emission, indirect] = [&targets.albedo, &targets.emission, &targets.indirect[0]]
            .map(|plane| pixels(gpu, &plane.texture));
        let direct: Vec<[f32; 4]> = elements(gpu, &targets.direct)?;
        let (albedo, emission) = (albedo?, emission?);
        let points = albedo.iter().zip(&emission).map(|(albedo, emission)| {
            let (albedo, emission) = (albedo.w > 0.0).then_some((albedo.truncate(), emission.truncate()))?;
            Some(SurfacePoint { albedo, emission, ..NOWHERE })
        });
        let [width, height] = targets.size;
        let points: Vec<_> = points.collect();
        let direct = direct.iter().take(points.len()).map(|&[x, y, z, _]| Vec3::new(x, y, z)).collect();
        let stats = RenderStats {
            seconds: report.seconds,
            pairs_evaluated: report.pairs_evaluated,
            lights: self.asset().map_or(0, |asset| asset.lights().len() as u32),
        };
        let indirect = indirect?.iter().map(|light| light.truncate()).collect();
        Ok(Rendering { gbuffer: GBuffer { width, height, points }, direct, indirect, stats })
    }

    /// The exposure that shows the last frame's mean brightness as middle grey. Waits for the device.
    ///
    /// # Errors
    /// As [`Viewer::rendering`].
    pub fn auto_exposure(&self) -> Result<f32, ViewError> {
        let rendering = self.rendering(&FrameReport::default())?;
        Ok(auto_exposure(&vlm_bake::picture::radiance(&rendering)))
    }

    /// What the passes of the last frames took, where the device tells.
    pub fn pass_times(&mut self) -> Option<PassTimes> {
        self.stopwatch.read(&self.gpu)
    }
}

const NOWHERE: SurfacePoint = SurfacePoint {
    triangle: 0,
    position: Vec3::ZERO,
    normal: Vec3::Z,
    geometric_normal: Vec3::Z,
    albedo: Vec3::ZERO,
    emission: Vec3::ZERO,
};

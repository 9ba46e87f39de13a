//! The renderer: which passes a frame needs, in order.

use glam::Vec3;
use vlm_format::Grid;
use vlm_shaders::cpu::direct::Point;
use vlm_shaders::wgsl::Gathering;
use wgpu::{BindGroup, BindGroupLayout, CommandEncoder, Device, Queue};

use crate::changes::Changes;
use crate::dependents::Dependents;
use crate::device::check_limits;
use crate::direct::{Direct, DirectPipeline};
use crate::error::Error;
use crate::frame::{Frame, Settings, Targets};
use crate::gather::Gather;
use crate::inject::{Inject, InjectPipeline};
use crate::load::VlmAsset;
use crate::loaded::{Loaded, reflectances, shining};
use crate::pass::{Buffers, Compiled, Passes, group, layout, storage, uniform};
use crate::refresh::Refresh;
use crate::shadow::{Shadow, ShadowPipeline};
use crate::stats::{FrameStats, FrameTimes};
use crate::timer::Timer;
use crate::upload::Uploaded;

/// Finds the indirect light of frames, on one device.
///
/// [`VlmRenderer::load`] an asset, then for each frame [`VlmRenderer::prepare`] and [`VlmRenderer::record`], and submit the encoder before the next
/// frame is prepared.
pub struct VlmRenderer {
    device: Device,
    settings: Settings,
    /// Bind group 0 of the passes over the grid.
    common: BindGroupLayout,
    shadow: ShadowPipeline,
    direct: DirectPipeline,
    inject: InjectPipeline,
    timer: Option<Timer>,
    /// Those that only some assets need.
    compiled: Compiled,
    loaded: Option<Loaded>,
}

impl VlmRenderer {
    /// Compiles the passes that every asset needs.
    ///
    /// # Errors
    /// [`Error::Limit`] where the device's limits are below WebGPU's defaults.
    pub fn new(device: &Device, settings: Settings) -> Result<Self, Error> {
        check_limits(&device.limits())?;
        let common = layout(device, "common", &[(0, uniform()), (1, storage(true))]);
        Ok(Self {
            shadow: ShadowPipeline::new(device),
            direct: DirectPipeline::new(device),
            inject: InjectPipeline::new(device, &common),
            device: device.clone(),
            timer: settings.time_passes.then(|| Timer::new(device)).flatten(),
            settings,
            common,
            compiled: Compiled::default(),
            loaded: None,
        })
    }

    /// Puts an asset on the device, in place of the last one, and compiles what it needs beyond the common passes. Where it fails, the last
    /// one stays.
    ///
    /// # Errors
    /// [`Error::Limit`] where it is too large for the device.
    pub fn load(&mut self, asset: &VlmAsset) -> Result<(), Error> {
        let buffers = &mut Buffers { device: &self.device, bytes: 0 };
        let grid = asset.grid(self.settings.fewest_lights_for_grid);
        let listed = if grid.is_some() { Vec::new() } else { shining(asset) };
        let (uploaded, host) = Uploaded::new(buffers, &asset.lights, grid, &listed)?;
        let header = [(0, &uploaded.header), (1, &uploaded.indices)];
        let pieces: Vec<Vec3> = grid.map_or_else(Vec::new, reflectances);
        let changes = Changes::new(&asset.lights, &pieces, &host.points);
        let (points, spans) = (host.points.len(), changes.span_count());
        let gathering = self.gathering(asset, grid);
        let refresh = uploaded.grid.as_ref().zip(grid).map(|(buffers, grid)| {
            let dependents = Dependents::new(grid, &asset.lights);
            let on = (&self.device, &mut self.compiled);
            Refresh::new(on, &self.common, &uploaded, buffers, (&host.header, dependents))
        });
        let mut loaded = Loaded {
            common: group(&self.device, "common", &self.common, &header),
            shadow: Shadow::default(),
            direct: Direct::new(&self.direct, buffers, &uploaded, points, spans)?,
            inject: Inject::new(&self.device, &self.inject, &uploaded, &host.header)?,
            refresh: refresh.transpose()?,
            gather: Gather::new(
                (buffers, &mut self.compiled),
                &self.common,
                &uploaded,
                gathering,
                &self.settings,
            )?,
            asset: asset.clone(),
            host,
            uploaded,
            changes,
            moved: Vec::new(),
            tints: Vec::new(),
            is_stale: true,
            is_prepared: false,
            stats: FrameStats::default(),
        };
        loaded.stats = FrameStats {
            lights: asset.lights.len() as u32,
            bytes_uploaded: buffers.bytes,
            uses_grid: gathering.grid,
            uses_tags: gathering.tags,
            uses_free_probes: gathering.free,
            probes: grid.map_or(0, |grid| grid.probes.len() as u32),
            ..FrameStats::default()
        };
        self.loaded = Some(loaded);
        Ok(())
    }

    /// Frees the asset. What was compiled for it stays, and serves the next one.
    pub fn unload(&mut self) {
        self.loaded = None;
    }

    fn gathering(&self, asset: &VlmAsset, grid: Option<&Grid>) -> Gathering {
        let listed = grid.is_none() || self.settings.moving_nodes;
        let tags = listed && asset.lights.tags.iter().any(|tag| *tag != 0);
        let free = grid.is_some_and(|grid| grid.probes.len() > grid.surface_probes as usize);
        Gathering { grid: grid.is_some(), listed, tags, free }
    }

    /// The points for which [`crate::Visibility`] is given, world space: the lights' samples, then surface without a light.
    ///
    /// # Errors
    /// [`Error::NotLoaded`].
    pub fn points(&self) -> Result<&[Point], Error> {
        Ok(&self.loaded()?.host.points)
    }

    /// Multiplies what each of the asset's lights reflects and emits, in their order, from now on; by 1 where there is no factor. Surface for
    /// which no light stands keeps its own.
    ///
    /// # Errors
    /// [`Error::NotLoaded`]; [`Error::NotFinite`], and then nothing changes.
    pub fn set_tints(&mut self, queue: &Queue, tints: &[Vec3]) -> Result<(), Error> {
        let loaded = self.loaded.as_mut().ok_or(Error::NotLoaded)?;
        if let Some(number) = tints.iter().position(|tint| !tint.is_finite()) {
            return Err(Error::NotFinite { what: format!("the tint of virtual light {number}") });
        }
        let bytes = loaded.tint(queue, tints) + loaded.plan(queue);
        loaded.stats.bytes_uploaded += bytes;
        Ok(())
    }

    /// Says what the next frame shows, and writes what changed since the last one to the device.
    ///
    /// # Errors
    /// [`Error::NotLoaded`]; [`Error::VisibilityLength`]; [`Error::UnknownLight`] and [`Error::Target`] for shadow maps; [`Error::MovingOff`] and [`Error::UnknownNode`] for nodes that cannot move;
    /// [`Error::NotFinite`]; [`Error::Limit`] for too many lights. The last frame then stays prepared.
    pub fn prepare(&mut self, queue: &Queue, frame: &Frame<'_>) -> Result<(), Error> {
        let moving_nodes = self.settings.moving_nodes;
        let loaded = self.loaded.as_mut().ok_or(Error::NotLoaded)?;
        let buffers = Buffers { device: &self.device, bytes: 0 };
        loaded.check(frame, &buffers, moving_nodes)?;
        if let Some(timer) = &mut self.timer {
            timer.collect(&self.device, queue)?;
        }
        let mut bytes = loaded.move_nodes(queue, frame.moved)?;
        bytes += loaded.write_direct(queue, &buffers, (&self.shadow, &self.direct), frame)?;
        bytes += loaded.plan(queue);
        bytes += loaded.gather.write_view(queue, frame.view);
        loaded.stats.bytes_uploaded += bytes;
        loaded.is_prepared = true;
        Ok(())
    }

    /// Adds a frame's passes: those that what changed needs, then the gather of every pixel.
    ///
    /// # Errors
    /// [`Error::NotLoaded`], [`Error::NotPrepared`], and [`Error::Target`] for textures that do not fit; then nothing is added.
    pub fn record(
        &mut self,
        encoder: &mut CommandEncoder,
        targets: &Targets<'_>,
    ) -> Result<FrameStats, Error> {
        self.loaded()?.gather.check(targets, &self.device)?;
        self.record_frame(encoder, Some(targets))
    }

    /// [`VlmRenderer::record`] without the gather, for forward shaders that call `indirect` themselves.
    ///
    /// # Errors
    /// [`Error::NotLoaded`], [`Error::NotPrepared`].
    pub fn record_light(&mut self, encoder: &mut CommandEncoder) -> Result<FrameStats, Error> {
        self.record_frame(encoder, None)
    }

    fn record_frame(
        &mut self,
        encoder: &mut CommandEncoder,
        targets: Option<&Targets<'_>>,
    ) -> Result<FrameStats, Error> {
        let loaded = self.loaded.as_mut().ok_or(Error::NotLoaded)?;
        if !loaded.is_prepared {
            return Err(Error::NotPrepared);
        }
        let mut stats = loaded.take_stats();
        stats.times = self.timer.as_ref().and_then(Timer::newest).cloned();
        let mut passes = Passes::new(encoder, self.timer.as_mut());
        stats.shadow_maps = loaded.shadow.record(&mut passes, &self.shadow);
        loaded.direct.record(&mut passes, &self.direct);
        loaded.inject.record(&mut passes, &self.inject, &loaded.common);
        if let Some(refresh) = &mut loaded.refresh {
            stats.probes_refreshed = refresh.record(&mut passes, &loaded.common);
        }
        if let Some(targets) = targets {
            loaded.gather.record(&mut passes, &self.device, &loaded.common, targets);
        }
        stats.passes = passes.finish(stats.frame);
        Ok(stats)
    }

    /// The WGSL function `indirect(position, normal, geometric_normal, tag) -> Gathered` for a forward shader, which binds
    /// [`VlmRenderer::forward_groups`] at `first_group` and the next; and `indirect_moving` of the same parameters for what moves, as
    /// [`Targets::moving`] says. `Gathered.irradiance` is in lx.
    ///
    /// # Errors
    /// [`Error::NotLoaded`].
    pub fn forward_module(&self, first_group: u32) -> Result<String, Error> {
        Ok(self.loaded()?.gather.gathering.forward(first_group))
    }

    /// The layouts of [`VlmRenderer::forward_groups`].
    ///
    /// # Errors
    /// [`Error::NotLoaded`].
    pub fn forward_layouts(&self) -> Result<[&BindGroupLayout; 2], Error> {
        Ok([&self.common, &self.loaded()?.gather.scene_layout])
    }

    /// What a forward shader binds; good until the next [`VlmRenderer::load`].
    ///
    /// # Errors
    /// [`Error::NotLoaded`].
    pub fn forward_groups(&self) -> Result<[&BindGroup; 2], Error> {
        let loaded = self.loaded()?;
        Ok([&loaded.common, &loaded.gather.scene_group])
    }

    /// Pairs of a pixel and a light whose geometry the last submitted deferred gather read. Waits for the device.
    ///
    /// # Errors
    /// [`Error::CountingOff`] without [`Settings::count_pairs`], [`Error::NotLoaded`], [`Error::Device`] if the device is lost.
    pub fn pairs_evaluated(&self, queue: &Queue) -> Result<u64, Error> {
        let counted = self.loaded()?.gather.pair_count.as_ref().ok_or(Error::CountingOff)?;
        let halves: Vec<u32> = self.read(queue, counted)?;
        let half = |i: usize| u64::from(halves.get(i).copied().unwrap_or(0));
        Ok(half(0) + (half(1) << 32))
    }

    /// Radiosity of the lights after phase 1, lx: red, green, blue and a number that is not used. Waits for the device.
    ///
    /// # Errors
    /// [`Error::NotLoaded`], [`Error::Device`] if the device is lost.
    pub fn radiosity(&self, queue: &Queue) -> Result<Vec<glam::Vec4>, Error> {
        let loaded = self.loaded()?;
        let mut radiosity = self.read(queue, &loaded.uploaded.light_radiosity)?;
        radiosity.truncate(loaded.host.lights.len());
        Ok(radiosity)
    }

    /// Direct irradiance at [`VlmRenderer::points`], lx, likewise. Stays 0 at points that reflect nothing.
    ///
    /// # Errors
    /// [`Error::NotLoaded`], [`Error::Device`] if the device is lost.
    pub fn direct_irradiance(&self, queue: &Queue) -> Result<Vec<glam::Vec4>, Error> {
        let loaded = self.loaded()?;
        let mut irradiance = self.read(queue, &loaded.uploaded.irradiance)?;
        irradiance.truncate(loaded.host.points.len());
        Ok(irradiance)
    }

    /// The share of each real light that each point sees: `light * points + point`, as it was given or as shadow maps gave it; empty before the
    /// first. Waits for the device.
    ///
    /// # Errors
    /// [`Error::NotLoaded`], [`Error::Device`] if the device is lost.
    pub fn visibility(&self, queue: &Queue) -> Result<Vec<f32>, Error> {
        let loaded = self.loaded()?;
        let mut visibility = self.read(queue, loaded.direct.points_and_visibility().1)?;
        visibility.truncate(loaded.changes.visibility_len());
        Ok(visibility)
    }

    /// The times of the newest frame that was submitted, of those with [`Settings::time_passes`]; waits for the device, which
    /// [`FrameStats::times`] does not. `None` where no frame was timed.
    ///
    /// # Errors
    /// [`Error::Device`] if the device is lost.
    pub fn wait_for_times(&mut self, queue: &Queue) -> Result<Option<FrameTimes>, Error> {
        let Some(timer) = &mut self.timer else { return Ok(None) };
        timer.wait(&self.device, queue)?;
        Ok(timer.newest().cloned())
    }

    fn read<T: bytemuck::Pod>(&self, queue: &Queue, buffer: &wgpu::Buffer) -> Result<Vec<T>, Error> {
        let failed = |error: &dyn std::fmt::Display| Error::Device(error.to_string());
        let back = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("back"),
            size: buffer.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &back, 0, buffer.size());
        queue.submit([encoder.finish()]);
        back.map_async(wgpu::MapMode::Read, .., |_| {});
        let wait = wgpu::PollType::Wait { submission_index: None, timeout: None };
        self.device.poll(wait).map_err(|error| failed(&error))?;
        let mapped = back.get_mapped_range(..).map_err(|error| failed(&error))?;
        Ok(bytemuck::pod_collect_to_vec(&mapped))
    }

    fn loaded(&self) -> Result<&Loaded, Error> {
        self.loaded.as_ref().ok_or(Error::NotLoaded)
    }
}

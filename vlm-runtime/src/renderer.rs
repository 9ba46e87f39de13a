//! The renderer: which passes a frame needs, in order.

use std::ops::Range;

use glam::{DMat4, Vec3};
use vlm_format::Grid;
use vlm_shaders::cpu::direct::{Point, points};
use vlm_shaders::tables::LightSurface;
use vlm_shaders::wgsl::Gathering;
use wgpu::{BindGroup, BindGroupLayout, CommandEncoder, Device, Queue};

use crate::changes::Changes;
use crate::device::check_limits;
use crate::direct::{Direct, DirectPipeline, write};
use crate::error::Error;
use crate::frame::{Frame, MovedNode, Settings, Targets, Visibility};
use crate::gather::Gather;
use crate::inject::{Inject, InjectPipeline};
use crate::load::{VlmAsset, world_lights};
use crate::pass::{Buffers, Compiled, group, layout, storage, uniform};
use crate::refresh::Refresh;
use crate::stats::FrameStats;
use crate::upload::{Host, Uploaded, check_listed, check_real_lights, list_words};

/// Finds the indirect light of frames, on one device.
///
/// [`VlmRenderer::load`] an asset, then for each frame [`VlmRenderer::prepare`] and [`VlmRenderer::record`].
pub struct VlmRenderer {
    device: Device,
    settings: Settings,
    /// Bind group 0 of the passes over the grid.
    common: BindGroupLayout,
    direct: DirectPipeline,
    inject: InjectPipeline,
    /// Those that only some assets need.
    compiled: Compiled,
    loaded: Option<Loaded>,
}

/// An asset on the device.
struct Loaded {
    asset: VlmAsset,
    host: Host,
    uploaded: Uploaded,
    common: BindGroup,
    direct: Direct,
    inject: Inject,
    refresh: Option<Refresh>,
    gather: Gather,
    changes: Changes,
    /// Nodes that are not at rest.
    moved: Vec<MovedNode>,
    /// Factors of the lights; 1 where there is none.
    tints: Vec<Vec3>,
    /// The radiosity of lights is to be found anew.
    is_stale: bool,
    is_prepared: bool,
    stats: FrameStats,
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
            direct: DirectPipeline::new(device),
            inject: InjectPipeline::new(device, &common),
            device: device.clone(),
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
        let elements = asset.lights.len() + pieces.len();
        let gathering = self.gathering(asset, grid);
        let refresh = uploaded.grid.as_ref().zip(grid).map(|(buffers, grid)| {
            let on = (&self.device, &mut self.compiled);
            Refresh::new(on, &self.common, &uploaded, buffers, grid.probes.len())
        });
        let mut loaded = Loaded {
            common: group(&self.device, "common", &self.common, &header),
            direct: Direct::new(&self.direct, buffers, &uploaded, points, spans)?,
            inject: Inject::new(&self.device, &self.inject, &uploaded, elements)?,
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
        Gathering { grid: grid.is_some(), listed, tags }
    }

    /// The points for which [`Visibility`] is given, world space: the lights' samples, then surface without a light.
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
        loaded.stats.bytes_uploaded += loaded.tint(queue, tints);
        Ok(())
    }

    /// Says what the next frame shows, and writes what changed since the last one to the device.
    ///
    /// # Errors
    /// [`Error::NotLoaded`]; [`Error::VisibilityLength`]; [`Error::MovingOff`] and [`Error::UnknownNode`] for nodes that cannot move;
    /// [`Error::NotFinite`]; [`Error::Limit`] for too many lights. The last frame then stays prepared.
    pub fn prepare(&mut self, queue: &Queue, frame: &Frame<'_>) -> Result<(), Error> {
        let moving_nodes = self.settings.moving_nodes;
        let loaded = self.loaded.as_mut().ok_or(Error::NotLoaded)?;
        let buffers = Buffers { device: &self.device, bytes: 0 };
        loaded.check(frame, moving_nodes)?;
        if let Visibility::Given(visibility) = frame.visibility {
            buffers.check("visibility", size_of_val(visibility) as u64)?;
        }
        let mut bytes = loaded.move_nodes(queue, frame.moved)?;
        bytes += loaded.write_direct(queue, (&buffers, &self.direct), frame)?;
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
        let mut stats = self.record_light(encoder)?;
        let loaded = self.loaded.as_ref().ok_or(Error::NotLoaded)?;
        loaded.gather.record(encoder, &self.device, &loaded.common, targets);
        stats.passes.push("gather");
        Ok(stats)
    }

    /// [`VlmRenderer::record`] without the gather, for forward shaders that call `indirect` themselves.
    ///
    /// # Errors
    /// [`Error::NotLoaded`], [`Error::NotPrepared`].
    pub fn record_light(&mut self, encoder: &mut CommandEncoder) -> Result<FrameStats, Error> {
        let loaded = self.loaded.as_mut().ok_or(Error::NotLoaded)?;
        if !loaded.is_prepared {
            return Err(Error::NotPrepared);
        }
        let mut stats = loaded.take_stats();
        if loaded.direct.record(encoder, &self.direct) {
            stats.passes.push("direct");
        }
        if std::mem::take(&mut loaded.is_stale) {
            loaded.inject.record(encoder, &self.inject, &loaded.common);
            stats.passes.push("inject");
            if let Some(refresh) = &loaded.refresh {
                refresh.record(encoder, &loaded.common);
                stats.passes.push("refresh");
            }
        }
        Ok(stats)
    }

    /// The WGSL function `indirect(position, normal, geometric_normal, tag) -> Gathered` for a forward shader, which binds
    /// [`VlmRenderer::forward_groups`] at `first_group` and the next. `Gathered.irradiance` is in lx.
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

impl Loaded {
    fn check(&self, frame: &Frame<'_>, moving_nodes: bool) -> Result<(), Error> {
        check_finite(frame)?;
        check_real_lights(frame.lights.len())?;
        let (lights, points) = (frame.lights.len(), self.host.points.len());
        let found = match frame.visibility {
            Visibility::Given(visibility) => Some(visibility.len()),
            Visibility::Kept => self.changes.has_visibility().then(|| self.changes.visibility_len()),
        };
        if let Some(found) = found.filter(|&found| found != lights * points) {
            let (found, lights, points) = (found as u64, lights as u32, points as u32);
            return Err(Error::VisibilityLength { found, lights, points });
        }
        if !frame.moved.is_empty() && !moving_nodes {
            return Err(Error::MovingOff);
        }
        let vlms = &self.asset.asset.vlms;
        match frame.moved.iter().find(|moved| !vlms.iter().any(|vlm| vlm.node == moved.node)) {
            Some(&MovedNode { node, .. }) => Err(Error::UnknownNode { node }),
            None => Ok(()),
        }
    }

    /// Writes the real lights and their visibility where they changed, and which points that lights anew; bytes written.
    fn write_direct(
        &mut self,
        queue: &Queue,
        on: (&Buffers, &DirectPipeline),
        frame: &Frame<'_>,
    ) -> Result<u64, Error> {
        let mut bytes = 0;
        if self.changes.light(frame.lights) {
            bytes += self.direct.write_lights(queue, frame.lights);
        }
        if let Visibility::Given(visibility) = frame.visibility {
            let changed = self.changes.see(visibility);
            bytes += self.direct.write_visibility(queue, on, visibility, &changed)?;
        }
        let spans = self.changes.dirty();
        self.is_stale |= !spans.is_empty();
        let header = (frame.lights.len(), self.changes.has_visibility());
        Ok(bytes + self.direct.write_spans(queue, on.0.device, &spans, header)?)
    }

    /// Moves the lights of nodes that are elsewhere than in the last frame; bytes written.
    fn move_nodes(&mut self, queue: &Queue, moved: &[MovedNode]) -> Result<u64, Error> {
        let at_rest = |m: &&MovedNode| self.rest(m.node) != Some(m.world_from_node);
        let moved: Vec<MovedNode> = moved.iter().filter(at_rest).copied().collect();
        if moved == self.moved {
            return Ok(0);
        }
        let listed = self.lights_of(&moved);
        if self.refresh.is_some() {
            check_listed(listed.len())?;
        }
        let place =
            |moved: &[MovedNode], node: u32| moved.iter().find(|m| m.node == node).map(|m| m.world_from_node);
        let elsewhere: Vec<Range<u32>> = self
            .asset
            .asset
            .vlms
            .iter()
            .filter(|vlm| place(&moved, vlm.node) != place(&self.moved, vlm.node))
            .map(|vlm| vlm.lights[0]..vlm.lights[0].saturating_add(vlm.lights[1]))
            .collect();
        let now = |node| place(&moved, node).or_else(|| self.rest(node));
        self.host.lights = world_lights(&self.asset.asset, now);
        let uncovered =
            self.host.points.split_off(self.host.lights.samples.len().min(self.host.points.len()));
        self.host.points = points(&self.host.lights, &[]);
        self.host.points.extend(uncovered);
        self.moved = moved;
        self.is_stale = true;
        let bytes: u64 = elsewhere.into_iter().map(|lights| self.write_moved(queue, lights)).sum();
        Ok(bytes + self.write_listed(queue, &listed))
    }

    /// Writes the reflectances and emissions of the lights from the first to the last whose tint changed; bytes written.
    fn tint(&mut self, queue: &Queue, tints: &[Vec3]) -> u64 {
        let of = |tints: &[Vec3], light: usize| tints.get(light).copied().unwrap_or(Vec3::ONE);
        let changes = |light: &usize| of(tints, *light) != of(&self.tints, *light);
        let set = &self.asset.lights;
        let (first, last) = ((0..set.len()).find(changes), (0..set.len()).rfind(changes));
        self.tints = tints.to_vec();
        let Some((first, last)) = first.zip(last) else { return 0 };
        let start = |light: usize| set.sample_starts.get(light).map_or(0, |&start| start as usize);
        let mut samples = set.samples.get(start(first)..start(last + 1)).unwrap_or(&[]).to_vec();
        for light in first..=last {
            let tint = of(tints, light);
            let own = start(light) - start(first)..start(light + 1) - start(first);
            samples.get_mut(own).unwrap_or_default().iter_mut().for_each(|s| s.reflectance *= tint);
            if let Some(surface) = self.host.light_surfaces.get_mut(light) {
                surface.emission = set.emission.get(light).copied().unwrap_or_default() * tint;
            }
        }
        self.is_stale = true;
        let listed = self.lights_of(&self.moved);
        write(queue, &self.uploaded.samples, start(first), &samples)
            + write(queue, &self.uploaded.light_surfaces, 0, &self.host.light_surfaces)
            + self.write_listed(queue, &listed)
    }

    fn rest(&self, node: u32) -> Option<DMat4> {
        self.asset.world_from_node.get(node as usize).copied()
    }

    fn lights_of(&self, moved: &[MovedNode]) -> Vec<u32> {
        let is_moved = |node| moved.iter().any(|m| m.node == node);
        let vlms = self.asset.asset.vlms.iter().filter(|vlm| is_moved(vlm.node));
        vlms.flat_map(|vlm| vlm.lights[0]..vlm.lights[0].saturating_add(vlm.lights[1])).collect()
    }

    /// Writes where some lights are, and their points; bytes written.
    fn write_moved(&mut self, queue: &Queue, lights: Range<u32>) -> u64 {
        let Host { lights: set, points, .. } = &self.host;
        let starts = |light: u32| set.sample_starts.get(light as usize).map_or(0, |&start| start as usize);
        let (first, samples) = (lights.start as usize, starts(lights.start)..starts(lights.end));
        let geometry = set.geometry.get(first..lights.end as usize).unwrap_or(&[]);
        let own_points = points.get(samples.clone()).unwrap_or(&[]);
        let bytes = write(queue, &self.uploaded.geometry, first, geometry)
            + write(queue, &self.uploaded.points, samples.start, own_points);
        self.changes.moved(lights, points);
        bytes
    }

    /// Lists the lights that moved, and takes them out of the grid, which has their light where they were; bytes written.
    fn write_listed(&self, queue: &Queue, listed: &[u32]) -> u64 {
        if self.refresh.is_none() {
            return 0;
        }
        let mut surfaces: Vec<LightSurface> = self.host.light_surfaces.clone();
        for &light in listed {
            if let Some(surface) = surfaces.get_mut(light as usize) {
                surface.gain = 0.0;
            }
        }
        write(queue, &self.uploaded.light_surfaces, 0, &surfaces)
            + write(queue, &self.uploaded.listed, 0, &list_words(listed))
    }

    /// The numbers of this frame; those of the next begin at 0.
    fn take_stats(&mut self) -> FrameStats {
        let (lights_injected, lights_skipped) = self.changes.counts();
        self.changes.clean();
        let stats = FrameStats { lights_injected, lights_skipped, ..self.stats.clone() };
        self.stats.bytes_uploaded = 0;
        stats
    }
}

fn reflectances(grid: &Grid) -> Vec<Vec3> {
    grid.uncovered.iter().map(|piece| piece.reflectance).collect()
}

/// The lights that may ever shine.
fn shining(asset: &VlmAsset) -> Vec<u32> {
    let set = &asset.lights;
    let shines = |&light: &u32| {
        let emits = set.emission.get(light as usize).is_some_and(|emission| *emission != Vec3::ZERO);
        emits || set.samples_of(light as usize).iter().any(|sample| sample.reflectance != Vec3::ZERO)
    };
    (0..set.len() as u32).filter(shines).collect()
}

/// All numbers of a frame count, since one that is not finite spreads over the picture.
fn check_finite(frame: &Frame<'_>) -> Result<(), Error> {
    let finite =
        |what: String, is_finite: bool| if is_finite { Ok(()) } else { Err(Error::NotFinite { what }) };
    for (number, light) in frame.lights.iter().enumerate() {
        let vectors = [light.position, light.direction, light.intensity].iter().all(|v| v.is_finite());
        let cone = light.cone_scale.is_finite() && light.cone_offset.is_finite() && !light.range.is_nan();
        finite(format!("light {number}"), vectors && cone)?;
    }
    for moved in frame.moved {
        finite(format!("the transform of node {}", moved.node), moved.world_from_node.is_finite())?;
    }
    finite("the camera".to_owned(), frame.view.world_from_clip.is_finite())?;
    finite("the exposure".to_owned(), frame.view.exposure.is_finite())
}

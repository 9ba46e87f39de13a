//! The methods on the graphics card, with the same bakes, knobs and pictures as on the processor.
//!
//! Phase 1 is what the device does until all lights shine; the shadow rays that tell which light reaches which sample are not in it, as a
//! game has shadow maps anyway. Phase 2 is the indirect light of every pixel. Both are timed from submission until the device is
//! done.

pub mod brute;
pub mod thesis;
pub mod vlm;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use vlm_bake::render::{PhaseSeconds, triangle_tags};
use vlm_runtime::{Frame, IrradianceFormat, Settings, Targets, Visibility, VlmAsset};
use wgpu::{CommandEncoder, CommandEncoderDescriptor, TextureViewDescriptor};

use super::Entry;
use super::area_lights::AreaLights;
use crate::method::{Backend, Baked, Cost, Method, MethodError, Picture, Prepared, Stage, View};
use crate::runtime_gpu::{Host, Pictures, view as camera_view, visibility};

/// Every method there is on the graphics card.
pub const ALL: [Entry; 3] = [brute::ENTRY, thesis::ENTRY, vlm::ENTRY];

/// A method of the processor as it is on the graphics card.
pub struct OnGpu<M> {
    method: M,
    prepare: Prepare<M>,
}

type Prepare<M> = fn(&M, &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError>;

impl<M: Method + 'static> OnGpu<M> {
    fn boxed(method: M, prepare: Prepare<M>) -> Box<dyn Method> {
        Box::new(Self { method, prepare })
    }
}

impl<M: Method> Method for OnGpu<M> {
    fn name(&self) -> &'static str {
        self.method.name()
    }

    fn knob(&self) -> String {
        self.method.knob()
    }

    fn backends(&self) -> &'static [Backend] {
        &[Backend::Gpu]
    }

    fn prepare(&self, stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError> {
        (self.prepare)(&self.method, stage)
    }
}

/// Lights that the runtime sums, by their grid or without.
struct Ready {
    lights: AreaLights,
    renderer: Renderer,
    cost: Cost,
}

impl Ready {
    fn boxed(stage: &Stage<'_>, lights: AreaLights, cost: Cost) -> Result<Box<dyn Prepared>, MethodError> {
        Ok(Box::new(Self { renderer: Renderer::new(stage, &lights)?, lights, cost }))
    }
}

impl Prepared for Ready {
    fn render(&self, view: &View<'_>, _frame: u32) -> Result<Picture, MethodError> {
        self.renderer.render(view)
    }

    fn cost(&self) -> Cost {
        self.cost
    }

    fn area_lights(&self) -> Option<Arc<Baked>> {
        Some(Arc::clone(&self.lights.baked))
    }

    fn device(&self) -> String {
        self.renderer.device()
    }
}

/// The runtime's renderer, with lights that shine anew in every frame.
struct Renderer {
    asset: VlmAsset,
    host: RefCell<Host>,
    /// Tag of each of the scene's triangles.
    tags: Vec<u32>,
    /// Which lights the renderer's points see.
    visibility: Vec<f32>,
    /// Pairs by camera: counting them takes time, so a frame that is timed doesn't.
    pairs: RefCell<BTreeMap<String, u64>>,
}

impl Renderer {
    fn new(stage: &Stage<'_>, lights: &AreaLights) -> Result<Self, MethodError> {
        let scene = stage.trace.scene;
        let last = scene.objects.iter().map(|object| object.node as usize + 1).max().unwrap_or(0);
        let mut world_from_nodes = vec![glam::DMat4::IDENTITY; last];
        for object in &scene.objects {
            world_from_nodes[object.node as usize] = object.world_from_node;
        }
        let asset = VlmAsset::new(lights.baked.asset.clone(), world_from_nodes);
        let host = Host::new(&asset, settings(false))?;
        Ok(Self {
            tags: triangle_tags(scene, asset.data()),
            visibility: visibility(stage.trace, host.renderer.points()?),
            host: RefCell::new(host),
            asset,
            pairs: RefCell::default(),
        })
    }

    /// The adapter, in its driver's words.
    fn device(&self) -> String {
        self.host.borrow().device.adapter_info().name
    }

    /// Lights all lights; seconds.
    fn phase_1(&self, view: &View<'_>) -> Result<f64, MethodError> {
        let host = &mut *self.host.borrow_mut();
        self.prepare(host, view)?;
        let mut encoder = encoder(host);
        host.renderer.record_light(&mut encoder)?;
        finish(host, encoder)
    }

    /// Both phases of a frame.
    fn render(&self, view: &View<'_>) -> Result<Picture, MethodError> {
        let inject = self.phase_1(view)?;
        let host = &mut *self.host.borrow_mut();
        let pictures = self.upload(host, view);
        let gather = gather(host, &pictures)?;
        let seconds = PhaseSeconds { inject, gather };
        let (indirect, pairs) = (host.read(&pictures.irradiance)?, self.pairs(view)?);
        Ok(Picture { indirect, seconds, lights: self.asset.lights().len() as u32, pairs, rays: 0 })
    }

    /// Says that the lights went out and on again, so that nothing is skipped.
    fn prepare(&self, host: &mut Host, view: &View<'_>) -> Result<(), MethodError> {
        let dark = Frame { visibility: Visibility::Given(&[]), ..Frame::default() };
        host.renderer.prepare(&host.queue, &dark)?;
        let lit = Frame {
            lights: view.trace.lights(),
            visibility: Visibility::Given(&self.visibility),
            view: camera_view(&view.camera, &view.gbuffer, 1.0),
            ..Frame::default()
        };
        Ok(host.renderer.prepare(&host.queue, &lit)?)
    }

    fn upload(&self, host: &Host, view: &View<'_>) -> Pictures {
        let tag = |triangle: u32| self.tags.get(triangle as usize).copied().unwrap_or(0);
        host.upload(&view.gbuffer, &view.camera, tag)
    }

    fn pairs(&self, view: &View<'_>) -> Result<u64, MethodError> {
        if let Some(&pairs) = self.pairs.borrow().get(&view.camera.name) {
            return Ok(pairs);
        }
        let host = &mut Host::new(&self.asset, settings(true))?;
        self.prepare(host, view)?;
        let mut encoder = encoder(host);
        host.renderer.record_light(&mut encoder)?;
        finish(host, encoder)?;
        let pictures = self.upload(host, view);
        gather(host, &pictures)?;
        let pairs = host.renderer.pairs_evaluated(&host.queue)?;
        self.pairs.borrow_mut().insert(view.camera.name.clone(), pairs);
        Ok(pairs)
    }
}

fn settings(count_pairs: bool) -> Settings {
    Settings { count_pairs, format: IrradianceFormat::Float, ..Settings::default() }
}

fn encoder(host: &Host) -> CommandEncoder {
    host.device.create_command_encoder(&CommandEncoderDescriptor::default())
}

/// Phase 2 of a frame; seconds.
fn gather(host: &mut Host, pictures: &Pictures) -> Result<f64, MethodError> {
    let irradiance = pictures.irradiance.create_view(&TextureViewDescriptor::default());
    let targets: Targets<'_> = pictures.targets(&irradiance);
    let mut encoder = encoder(host);
    host.renderer.record(&mut encoder, &targets)?;
    finish(host, encoder)
}

/// From submission until the device is done; seconds.
fn finish(host: &Host, encoder: CommandEncoder) -> Result<f64, MethodError> {
    let start = Instant::now();
    host.queue.submit([encoder.finish()]);
    let wait = wgpu::PollType::Wait { submission_index: None, timeout: None };
    host.device.poll(wait).map_err(|error| MethodError::Gpu(error.to_string()))?;
    Ok(start.elapsed().as_secs_f64())
}

//! shown: a scene on the device, and its light by the methods that are asked for.

use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use vlm_bake::render::{Method, PhaseSeconds, RenderError};
use vlm_bake::scene::{Camera, Scene};
use wgpu::CommandEncoder;

use super::bindings::attachment;
use super::error::ViewError;
use super::eye::Eye;
use super::gpu::Gpu;
use super::indirect::{Indirect, renderer};
use super::scene_buffers::SceneBuffers;
use super::shadows::Rays;
use super::targets::FrameTargets;
use super::times::Stopwatch;
use super::viewer::{FrameReport, ViewerOptions};
use crate::{PunctualLight, VlmAsset, VlmRenderer};

/// A scene on the device.
pub(crate) struct Shown {
    pub scene: Arc<Scene>,
    pub asset: Option<VlmAsset>,
    pub buffers: SceneBuffers,
    pub rays: Rays,
    /// By `vlm` and by `brute`, once they are asked for.
    pub indirect: [Option<Indirect>; 2],
    /// Renderers of the scene before, by the same methods: what they compiled need not be compiled again.
    pub spare: [Option<VlmRenderer>; 2],
}

/// What a frame was made from: what did not change is not made again.
#[derive(Clone, PartialEq)]
pub(crate) struct Wanted {
    pub generation: u64,
    pub camera: Camera,
    pub size: [u32; 2],
    pub alpha_masks: bool,
    pub lights: Vec<PunctualLight>,
    pub tints: Vec<Vec3>,
    pub methods: Vec<Method>,
}

impl Shown {
    /// Makes the light of one of the methods.
    pub(crate) fn light(
        &mut self,
        (gpu, options, watch): (&Gpu, ViewerOptions, &mut Stopwatch),
        (targets, plane): (&FrameTargets, usize),
        (wanted, eye): (&Wanted, &Eye),
        must_wait: bool,
    ) -> Result<FrameReport, ViewError> {
        let Some(&method) = wanted.methods.get(plane) else { return Ok(FrameReport::default()) };
        let Some(indirect) = self.by(gpu, method, options)? else {
            clear(gpu, targets, plane)?;
            return Ok(FrameReport { is_new: true, ..FrameReport::default() });
        };
        let start = Instant::now();
        indirect.prepare(gpu, (&wanted.lights, &wanted.tints), eye.view(), must_wait)?;
        let mut stats = submit(gpu, |encoder| {
            watch.lap(encoder, "inject");
            indirect.record_light(encoder)
        })?;
        let inject = seconds(gpu, options, start)?;
        let start = Instant::now();
        submit(gpu, |encoder| {
            watch.lap(encoder, "gather");
            indirect.record_gather(encoder, targets, plane, &mut stats)
        })?;
        let gather = seconds(gpu, options, start)?;
        let pairs_evaluated = indirect.pairs(gpu)?;
        let seconds = PhaseSeconds { inject, gather };
        let is_pending = indirect.is_pending();
        Ok(FrameReport { stats, seconds, pairs_evaluated, is_pending, is_new: true })
    }

    /// The lights by a method; `None` for direct light alone.
    pub(crate) fn by(
        &mut self,
        gpu: &Gpu,
        method: Method,
        options: ViewerOptions,
    ) -> Result<Option<&mut Indirect>, ViewError> {
        let place = match method {
            Method::Vlm => 0,
            Method::Brute => 1,
            Method::Direct | Method::Reference => return Ok(None),
        };
        let slot = &mut self.indirect[place];
        if slot.is_none() {
            let source = RenderError::NoLights;
            let none = || ViewError::Render { file: "the scene".to_owned(), source };
            let asset = self.asset.as_ref().ok_or_else(none)?;
            let renderer = match self.spare[place].take() {
                Some(spare) => spare,
                None => renderer(gpu, method, options.measures)?,
            };
            let shadows = (options.shadows, (gpu, &self.scene, &self.rays));
            *slot = Some(Indirect::new(renderer, asset, shadows, options.measures)?);
        }
        Ok(slot.as_mut())
    }
}

impl Wanted {
    /// The same surface at the same pixels.
    pub(crate) fn same_surface(&self, other: &Self) -> bool {
        self.generation == other.generation
            && self.camera == other.camera
            && self.size == other.size
            && self.alpha_masks == other.alpha_masks
    }
}

/// Records an encoder and submits it.
pub(crate) fn submit<T>(
    gpu: &Gpu,
    record: impl FnOnce(&mut CommandEncoder) -> Result<T, ViewError>,
) -> Result<T, ViewError> {
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let recorded = record(&mut encoder)?;
    gpu.queue.submit([encoder.finish()]);
    Ok(recorded)
}

/// Since `start`, with all that was submitted done; 0 where nothing is measured.
fn seconds(gpu: &Gpu, options: ViewerOptions, start: Instant) -> Result<f64, ViewError> {
    if !options.measures {
        return Ok(0.0);
    }
    gpu.wait()?;
    Ok(start.elapsed().as_secs_f64())
}

/// No indirect light.
fn clear(gpu: &Gpu, targets: &FrameTargets, plane: usize) -> Result<(), ViewError> {
    submit(gpu, |encoder| {
        let plane = &targets.indirect[plane.min(1)].view;
        drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("no indirect light"),
            color_attachments: &[attachment(plane, Some(wgpu::Color::TRANSPARENT))],
            ..wgpu::RenderPassDescriptor::default()
        }));
        Ok(())
    })
}

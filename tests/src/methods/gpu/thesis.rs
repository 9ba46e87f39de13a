//! [`crate::methods::thesis`] on the graphics card, as its author had it: the grid of lists is built there, too.

use std::sync::Arc;
use std::time::Instant;

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use vlm_bake::options::Preset;
use vlm_bake::render::PhaseSeconds;
use wgpu::{BufferUsages, CommandEncoderDescriptor};

use super::{OnGpu, Renderer};
use crate::active_hemisphere::{ActiveHemisphere, Lattice};
use crate::form_factor::gpu::TEXTBOOK_POLYGON;
use crate::gpu::Gpu;
use crate::method::{Baked, Cost, Method, MethodError, Picture, Prepared, Stage, View};
use crate::methods::area_lights::AreaLights;
use crate::methods::thesis::Thesis;
use crate::methods::{Entry, thesis};
use crate::thesis::ThesisOptions;

/// The method's line in the table.
pub const ENTRY: Entry = Entry {
    sweep: |stage| thesis::settings(stage).into_iter().map(on_gpu).collect(),
    proof: || on_gpu(thesis::whole()),
    ..thesis::ENTRY
};

/// Invocations of a workgroup, as in the shader.
const WORKGROUP: u32 = 64;

/// The method at one setting.
#[must_use]
pub fn on_gpu(thesis: Thesis) -> Box<dyn Method> {
    OnGpu::boxed(thesis, prepare)
}

fn prepare(thesis: &Thesis, stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError> {
    let lights = AreaLights::new(stage, stage.baked(&stage.without_grid(Preset::Game, thesis.lights))?)?;
    let lists = GpuLists::new(&lights, stage.bounds(), &thesis.options)?;
    Ok(Box::new(Ready { renderer: Renderer::new(stage, &lights)?, lights, lists }))
}

struct Ready {
    lights: AreaLights,
    /// Finds phase 1's radiosity, as for all methods with area lights.
    renderer: Renderer,
    lists: GpuLists,
}

impl Prepared for Ready {
    fn render(&self, view: &View<'_>, _frame: u32) -> Result<Picture, MethodError> {
        let inject = self.renderer.phase_1(view)?;
        let radiosity = {
            let host = self.renderer.host.borrow();
            host.renderer.radiosity(&host.queue)?
        };
        let receivers = receivers(view, &self.renderer.tags);
        let (results, gather) = self.lists.gather(&radiosity, &receivers)?;
        Ok(Picture {
            indirect: results.iter().map(|r| r.truncate()).collect(),
            seconds: PhaseSeconds { inject, gather },
            lights: self.lights.world.len() as u32,
            pairs: results.iter().map(|r| u64::from(r.w.to_bits())).sum(),
            rays: 0,
        })
    }

    fn cost(&self) -> Cost {
        Cost {
            prepare_seconds: self.lights.baked.lights_seconds + self.lists.build_seconds,
            bytes: self.lights.bytes() + self.lists.lists.size(),
        }
    }

    fn area_lights(&self) -> Option<Arc<Baked>> {
        Some(Arc::clone(&self.lights.baked))
    }

    fn device(&self) -> String {
        self.lists.gpu.name.clone()
    }
}

/// `Params` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Params {
    low: Vec3,
    cells: u32,
    cell: Vec3,
    list: u32,
}

/// `Light` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Light {
    v0: Vec3,
    tag: u32,
    v1: Vec3,
    radius: f32,
    v2: Vec3,
    padding: f32,
    normal: Vec3,
    padding_2: f32,
    centre: Vec3,
    padding_3: f32,
}

/// `Receiver` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Receiver {
    position: Vec3,
    tag: u32,
    normal: Vec3,
    is_hit: u32,
}

fn receivers(view: &View<'_>, tags: &[u32]) -> Vec<Receiver> {
    let receiver = |point: &Option<vlm_bake::shade::SurfacePoint>| {
        point.as_ref().map_or(Receiver::zeroed(), |point| Receiver {
            position: point.position,
            tag: tags.get(point.triangle as usize).copied().unwrap_or(0),
            normal: point.normal,
            is_hit: 1,
        })
    };
    view.gbuffer.points.iter().map(receiver).collect()
}

/// The grid of lists on the device.
pub struct GpuLists {
    gpu: Gpu,
    gather: wgpu::ComputePipeline,
    params: wgpu::Buffer,
    lights: wgpu::Buffer,
    lists: wgpu::Buffer,
    /// Wall time of the build, seconds.
    pub build_seconds: f64,
}

impl GpuLists {
    /// Builds the lists over the box `low..high`.
    ///
    /// # Errors
    /// Where there is no device, or it is lost.
    pub fn new(
        lights: &AreaLights,
        (low, high): (Vec3, Vec3),
        options: &ThesisOptions,
    ) -> Result<Self, MethodError> {
        let gpu = Gpu::new()?;
        let lattice = Lattice::over(low, high, options.grid);
        let list = options.list.max(1);
        let params = Params { low: lattice.low, cells: lattice.cells, cell: lattice.cell, list };
        let params = gpu.filled("params", bytemuck::bytes_of(&params), BufferUsages::UNIFORM);
        let cells = lattice.count() as u64;
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let lists = gpu.buffer("lists", 4 * cells * u64::from(list), usage);
        let lights = gpu.input("lights", bytemuck::cast_slice(&shader_lights(lights, options.range)));
        let source = &[include_str!("thesis.wgsl"), TEXTBOOK_POLYGON].join("\n");
        let build = gpu.pipeline(source, "build");
        let gather = gpu.pipeline(source, "gather");
        let group = gpu.group(&build, 0, &[&params, &lights, &lists]);
        let groups = (cells as u32).div_ceil(WORKGROUP);
        let start = Instant::now();
        submit(&gpu, &build, &group, groups);
        gpu.wait()?;
        let build_seconds = start.elapsed().as_secs_f64();
        Ok(Self { gpu, gather, params, lights, lists, build_seconds })
    }

    /// The lists, as [`crate::thesis::ThesisGrid`] has them up to the end of each.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn read(&self) -> Result<Vec<u32>, MethodError> {
        Ok(self.read_back(&self.lists)?)
    }

    /// Irradiance and pairs of each receiver, and seconds.
    fn gather(&self, radiosity: &[Vec4], receivers: &[Receiver]) -> Result<(Vec<Vec4>, f64), MethodError> {
        let gpu = &self.gpu;
        let radiosity = gpu.input("radiosity", bytemuck::cast_slice(radiosity));
        let points = gpu.input("receivers", bytemuck::cast_slice(receivers));
        let size = size_of::<Vec4>() as u64 * receivers.len() as u64;
        let results = gpu.buffer("results", size, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let bound = [&self.params, &self.lights, &self.lists, &radiosity, &points, &results];
        let group = gpu.group(&self.gather, 0, &bound);
        let start = Instant::now();
        submit(gpu, &self.gather, &group, (receivers.len() as u32).div_ceil(WORKGROUP));
        gpu.wait()?;
        let seconds = start.elapsed().as_secs_f64();
        Ok((self.read_back(&results)?, seconds))
    }

    fn read_back<T: Pod>(&self, buffer: &wgpu::Buffer) -> Result<Vec<T>, crate::gpu::GpuError> {
        let back = self.gpu.buffer("back", buffer.size(), BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        let mut encoder = self.gpu.device.create_command_encoder(&CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &back, 0, buffer.size());
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.read(&back)
    }
}

fn shader_lights(lights: &AreaLights, range: f32) -> Vec<Light> {
    let world = &lights.world;
    let hemispheres = ActiveHemisphere::of_all(&world.geometry, range);
    let light = |((geometry, hemisphere), &tag): (
        (&vlm_shaders::cpu::form_factor::LightGeometry, &ActiveHemisphere),
        &u32,
    )| {
        let [v0, v1, v2] = geometry.corners();
        Light {
            v0,
            tag,
            v1,
            radius: hemisphere.radius,
            v2,
            normal: geometry.normal,
            centre: hemisphere.centre,
            ..Light::zeroed()
        }
    };
    world.geometry.iter().zip(&hemispheres).zip(&world.tags).map(light).collect()
}

fn submit(gpu: &Gpu, pipeline: &wgpu::ComputePipeline, group: &wgpu::BindGroup, groups: u32) {
    let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.dispatch_workgroups(groups, 1, 1);
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
}

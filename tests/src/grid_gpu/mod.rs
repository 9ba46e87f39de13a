//! The static grid on a GPU: each pass by itself, over buffers as the shaders bind them.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use vlm_format::{Grid, MOST_PROBES};
use vlm_shaders::cpu::free_light::FreeLight;
use vlm_shaders::cpu::gather::{Gathered, Receiver};
use vlm_shaders::cpu::grid::Blend;
use vlm_shaders::cpu::refresh::{Arrived, FarLight, far_sources, near_entries, near_of_entries};
use vlm_shaders::cpu::upload::LightSet;
use vlm_shaders::tables::GridTables;
use vlm_shaders::wgsl;
use wgpu::{BindGroup, Buffer, BufferUsages, ComputePipeline};

use crate::gpu::{Gpu, GpuError};

/// Invocations per workgroup, as in the shaders.
const WORKGROUP: u32 = 64;

/// A device with the grid's passes compiled.
pub struct GridPasses {
    gpu: Gpu,
    inject: ComputePipeline,
    refresh: ComputePipeline,
    refresh_free: ComputePipeline,
    gather: ComputePipeline,
    gather_free: ComputePipeline,
    places: ComputePipeline,
}

/// A grid, its lights, and what all passes bind of them.
pub struct Uploaded<'a> {
    grid: &'a Grid,
    lights: &'a LightSet,
    light_surfaces: Buffer,
    header: Buffer,
    indices: Buffer,
    probes: Buffer,
}

/// Phase 1's result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Radiosity {
    /// Of the lights themselves, lx.
    pub lights: Vec<Vec3>,
    /// Of the grid's sources, lx.
    pub sources: Vec<Vec3>,
}

/// What a pixel finds, as the shader writes it.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct GatheredWords {
    irradiance: Vec3,
    pairs: u32,
}

/// A point's leaf and weights, as the shader writes them.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Place {
    leaf: u32,
    first: u32,
    count: u32,
    weights: [f32; MOST_PROBES],
}

impl GridPasses {
    /// The passes on the first Vulkan adapter.
    ///
    /// # Errors
    /// Where there is none or it gives no device.
    pub fn new() -> Result<Self, GpuError> {
        let gpu = Gpu::new()?;
        let places = [wgsl::GRID, wgsl::BLEND, include_str!("places.wgsl")].join("\n");
        Ok(Self {
            inject: gpu.pipeline(&wgsl::inject(), "inject"),
            refresh: gpu.pipeline(&wgsl::refresh(), "refresh"),
            refresh_free: gpu.pipeline(&wgsl::refresh_free(), "refresh_free"),
            gather: gpu.pipeline(&wgsl::gather_static(), "gather"),
            gather_free: gpu.pipeline(&wgsl::gather_free(), "gather_moving"),
            places: gpu.pipeline(&places, "find_places"),
            gpu,
        })
    }

    /// Puts a grid and its lights where all passes find them.
    #[must_use]
    pub fn upload<'a>(&self, grid: &'a Grid, lights: &'a LightSet) -> Uploaded<'a> {
        let GridTables { header, indices, light_surfaces } = GridTables::new(grid, lights);
        let gpu = &self.gpu;
        Uploaded {
            grid,
            lights,
            light_surfaces: gpu.input("light_surfaces", bytemuck::cast_slice(&light_surfaces)),
            header: gpu.filled("header", bytemuck::bytes_of(&header), BufferUsages::UNIFORM),
            indices: gpu.input("indices", bytemuck::cast_slice(&indices)),
            probes: gpu.input("probes", bytemuck::cast_slice(&grid.probes)),
        }
    }

    /// Phase 1: the radiosity of lights and sources, from direct light at the samples, then at the pieces without a light.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn inject(&self, scene: &Uploaded, irradiance: &[Vec3]) -> Result<Radiosity, GpuError> {
        let (gpu, Uploaded { grid, lights, .. }) = (&self.gpu, scene);
        let sources = lights.samples.len() + lights.len() + grid.uncovered.len();
        let of_lights = self.output::<Vec4>("light_radiosity", lights.len());
        let of_sources = self.output::<Vec4>("source_radiosity", sources);
        let group = [
            &gpu.input("samples", bytemuck::cast_slice(&lights.samples)),
            &gpu.input("uncovered", bytemuck::cast_slice(&grid.uncovered)),
            &self.vectors("irradiance", irradiance),
            &scene.light_surfaces,
            &gpu.input("sample_shares", bytemuck::cast_slice(&grid.sample_shares)),
            &of_lights,
            &of_sources,
        ];
        let groups = [self.common(&self.inject, scene), gpu.group(&self.inject, 1, &group)];
        self.dispatch(&self.inject, &groups, lights.len() + grid.uncovered.len());
        Ok(Radiosity { lights: self.read_vectors(&of_lights)?, sources: self.read_vectors(&of_sources)? })
    }

    /// What arrives at the probes.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn refresh(&self, scene: &Uploaded, radiosity: &[Vec3]) -> Result<Arrived, GpuError> {
        let (gpu, Uploaded { grid, lights, .. }) = (&self.gpu, scene);
        let far = self.output::<FarLight>("far", grid.surface_probes as usize);
        let near = self.output::<Vec4>("near_radiosities", grid.near.len());
        let group = [
            &scene.probes,
            &gpu.input("rows", bytemuck::cast_slice(&grid.rows)),
            &gpu.input("near_form_factors", bytemuck::cast_slice(&grid.near_form_factors)),
            &gpu.input("sources", bytemuck::cast_slice(&far_sources(lights, &grid.uncovered))),
            &self.vectors("radiosity", radiosity),
            &far,
            &near,
        ];
        let groups = [self.common(&self.refresh, scene), gpu.group(&self.refresh, 1, &group)];
        self.dispatch(&self.refresh, &groups, grid.probes.len());
        let (far, near) = (self.read(&far)?, near_of_entries(grid, &self.read::<Vec4>(&near)?));
        Ok(Arrived { far, near, free: self.refresh_free(scene, radiosity)? })
    }

    /// What arrives at the probes in free space.
    fn refresh_free(&self, scene: &Uploaded, radiosity: &[Vec3]) -> Result<Vec<FreeLight>, GpuError> {
        let (gpu, Uploaded { grid, lights, .. }) = (&self.gpu, scene);
        let count = grid.probes.len() - grid.surface_probes as usize;
        if count == 0 {
            return Ok(Vec::new());
        }
        let free = self.output::<FreeLight>("free", count);
        let group = [
            (0, &scene.probes),
            (1, &gpu.input("rows", bytemuck::cast_slice(&grid.rows))),
            (3, &gpu.input("sources", bytemuck::cast_slice(&far_sources(lights, &grid.uncovered)))),
            (4, &self.vectors("radiosity", radiosity)),
            (5, &free),
        ];
        let groups = [self.common(&self.refresh_free, scene), gpu.group_at(&self.refresh_free, 1, &group)];
        self.dispatch(&self.refresh_free, &groups, count);
        self.read(&free)
    }

    /// Phase 2 by the grid at every receiver.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn gather(
        &self,
        scene: &Uploaded,
        arrived: &Arrived,
        receivers: &[Receiver],
    ) -> Result<Vec<Gathered>, GpuError> {
        self.gather_by(&self.gather, &[], scene, arrived, receivers)
    }

    /// Phase 2 at receivers that move; the grid must have probes in free space.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn gather_free(
        &self,
        scene: &Uploaded,
        arrived: &Arrived,
        receivers: &[Receiver],
    ) -> Result<Vec<Gathered>, GpuError> {
        let free = self.gpu.input("free", bytemuck::cast_slice(&arrived.free));
        self.gather_by(&self.gather_free, &[(6, &free)], scene, arrived, receivers)
    }

    fn gather_by(
        &self,
        pipeline: &ComputePipeline,
        more: &[(u32, &Buffer)],
        scene: &Uploaded,
        arrived: &Arrived,
        receivers: &[Receiver],
    ) -> Result<Vec<Gathered>, GpuError> {
        let gpu = &self.gpu;
        let gathered = self.output::<GatheredWords>("gathered", receivers.len());
        let (lights, far, near) = (
            gpu.input("lights", bytemuck::cast_slice(&scene.lights.geometry)),
            gpu.input("far", bytemuck::cast_slice(&arrived.far)),
            gpu.input("near_radiosities", bytemuck::cast_slice(&near_entries(scene.grid, &arrived.near))),
        );
        let mut group: Vec<(u32, &Buffer)> = (0..).zip([&scene.probes, &lights, &far, &near]).collect();
        group.extend_from_slice(more);
        let points = [&gpu.input("receivers", bytemuck::cast_slice(receivers)), &gathered];
        let groups = [
            self.common(pipeline, scene),
            gpu.group_at(pipeline, 1, &group),
            gpu.group(pipeline, 2, &points),
        ];
        self.dispatch(pipeline, &groups, receivers.len());
        let gathered: Vec<GatheredWords> = self.read(&gathered)?;
        let widened = |g: GatheredWords| Gathered { irradiance: g.irradiance, pairs: u64::from(g.pairs) };
        Ok(gathered.into_iter().map(widened).collect())
    }

    /// The leaf of every receiver, and the weights of its probes there.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn places(
        &self,
        scene: &Uploaded,
        receivers: &[Receiver],
    ) -> Result<Vec<(Option<u32>, Blend)>, GpuError> {
        let places = self.output::<Place>("places", receivers.len());
        let points: Vec<Vec3> = receivers.iter().flat_map(|r| [r.position, r.normal]).collect();
        let points = self.vectors("points", &points);
        let groups = [
            self.common(&self.places, scene),
            self.gpu.group(&self.places, 1, &[&scene.probes]),
            self.gpu.group(&self.places, 2, &[&points, &places]),
        ];
        self.dispatch(&self.places, &groups, receivers.len());
        let places: Vec<Place> = self.read(&places)?;
        let unpacked = |place: Place| {
            let Place { leaf, first, count, weights } = place;
            ((leaf != u32::MAX).then_some(leaf), Blend { first, count, weights })
        };
        Ok(places.into_iter().map(unpacked).collect())
    }

    fn common(&self, pipeline: &ComputePipeline, scene: &Uploaded) -> BindGroup {
        self.gpu.group(pipeline, 0, &[&scene.header, &scene.indices])
    }

    fn dispatch(&self, pipeline: &ComputePipeline, groups: &[BindGroup], invocations: usize) {
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        (0..).zip(groups).for_each(|(number, group)| pass.set_bind_group(number, group, &[]));
        pass.dispatch_workgroups((invocations as u32).div_ceil(WORKGROUP), 1, 1);
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// A buffer that a shader writes `count` elements into.
    fn output<T>(&self, label: &str, count: usize) -> Buffer {
        let size = (size_of::<T>() * count.max(1)) as u64;
        self.gpu.buffer(label, size, BufferUsages::STORAGE | BufferUsages::COPY_SRC)
    }

    /// Vectors, each filled up to 16 bytes.
    fn vectors(&self, label: &str, vectors: &[Vec3]) -> Buffer {
        let vectors: Vec<Vec4> = vectors.iter().map(|v| v.extend(0.0)).collect();
        self.gpu.input(label, bytemuck::cast_slice(&vectors))
    }

    fn read_vectors(&self, buffer: &Buffer) -> Result<Vec<Vec3>, GpuError> {
        Ok(self.read::<Vec4>(buffer)?.into_iter().map(Vec4::truncate).collect())
    }

    fn read<T: Pod>(&self, buffer: &Buffer) -> Result<Vec<T>, GpuError> {
        let back = self.gpu.buffer("back", buffer.size(), BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &back, 0, buffer.size());
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.read(&back)
    }
}

//! The form factor on a GPU: the WGSL shell over the same cases.

use std::time::Instant;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use vlm_shaders::cpu::form_factor::{ErrorBound, LightGeometry};
use vlm_shaders::wgsl;

use super::case::Case;
use super::textbook::EdgeForm;
use crate::gpu::Gpu;
pub use crate::gpu::GpuError;

/// The textbook form factor, for shaders that say what an edge adds (`edge_term`).
pub const TEXTBOOK_POLYGON: &str = include_str!("textbook_polygon.wgsl");

/// Invocations per workgroup, as in the shader.
const WORKGROUP: u32 = 64;

/// A receiver, as the shader reads it.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Receiver {
    x: [f32; 3],
    n: [f32; 3],
    padding: [f32; 2],
}

impl Receiver {
    fn new(x: Vec3, n: Vec3) -> Self {
        Self { x: x.to_array(), n: n.to_array(), padding: [0.0; 2] }
    }
}

/// Buffers of one dispatch.
struct Task {
    group: wgpu::BindGroup,
    results: wgpu::Buffer,
    back: wgpu::Buffer,
    count: u32,
}

/// A device with the shader compiled.
pub struct GpuFormFactor {
    /// The adapter, in its driver's words.
    pub name: String,
    /// It runs on the processor.
    pub is_software: bool,
    gpu: Gpu,
    pipeline: wgpu::ComputePipeline,
}

impl GpuFormFactor {
    /// The project's form factor on the first Vulkan adapter.
    ///
    /// # Errors
    /// Where there is none or it gives no device.
    pub fn new() -> Result<Self, GpuError> {
        Self::with_shader(&wgsl::form_factor_cases())
    }

    /// The textbook forms, see [`GpuFormFactor::evaluate_textbook`].
    ///
    /// # Errors
    /// As [`GpuFormFactor::new`].
    pub fn textbook() -> Result<Self, GpuError> {
        let shader = include_str!("textbook.wgsl");
        Self::with_shader(&[wgsl::FORM_FACTOR, wgsl::RECEIVERS, shader, TEXTBOOK_POLYGON].join("\n"))
    }

    /// The sum over lights at each point, see [`GpuFormFactor::measure_sums`].
    ///
    /// # Errors
    /// As [`GpuFormFactor::new`].
    pub fn sums() -> Result<Self, GpuError> {
        Self::with_shader(&wgsl::form_factor_sums())
    }

    fn with_shader(source: &str) -> Result<Self, GpuError> {
        let gpu = Gpu::new()?;
        let pipeline = gpu.pipeline(source, "main");
        Ok(Self { name: gpu.name.clone(), is_software: gpu.is_software, gpu, pipeline })
    }

    /// One exact form factor per case.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn evaluate(&self, cases: &[Case]) -> Result<Vec<f32>, GpuError> {
        self.evaluate_within(cases, &ErrorBound::default())
    }

    /// One form factor per case by a textbook form; only after [`GpuFormFactor::textbook`].
    ///
    /// # Errors
    /// If the device is lost.
    pub fn evaluate_textbook(&self, form: EdgeForm, cases: &[Case]) -> Result<Vec<f32>, GpuError> {
        let choice = match form {
            EdgeForm::Acos => 0.0,
            EdgeForm::Atan2 => 1.0,
            EdgeForm::LtcFit => 2.0,
        };
        self.evaluate_within(cases, &ErrorBound { centroid: choice, second_moment: 0.0 })
    }

    /// One form factor per case, by the cheapest form that keeps within `bound`.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn evaluate_within(&self, cases: &[Case], bound: &ErrorBound) -> Result<Vec<f32>, GpuError> {
        if cases.is_empty() {
            return Ok(Vec::new());
        }
        let lights: Vec<LightGeometry> = cases.iter().map(Case::light).collect();
        let receivers: Vec<Receiver> = cases.iter().map(|case| Receiver::new(case.x, case.n)).collect();
        let task = self.upload(&lights, &receivers, Some(bound));
        self.submit(&task, 1);
        self.gpu.read(&task.back)
    }

    /// The sums of all lights' form factors at each point, and pairs per second from submission to completion; only after
    /// [`GpuFormFactor::sums`].
    ///
    /// # Errors
    /// If the device is lost.
    pub fn measure_sums(
        &self,
        lights: &[LightGeometry],
        points: &[(Vec3, Vec3)],
    ) -> Result<(Vec<f32>, f64), GpuError> {
        const ROUNDS: u32 = 4;
        let receivers: Vec<Receiver> = points.iter().map(|&(x, n)| Receiver::new(x, n)).collect();
        let task = self.upload(lights, &receivers, None);
        // The first run compiles.
        self.submit(&task, 1);
        self.gpu.wait()?;
        let start = Instant::now();
        self.submit(&task, ROUNDS);
        self.gpu.wait()?;
        let pairs = f64::from(ROUNDS) * (lights.len() * points.len()) as f64;
        let rate = pairs / start.elapsed().as_secs_f64();
        Ok((self.gpu.read(&task.back)?, rate))
    }

    fn upload(&self, lights: &[LightGeometry], receivers: &[Receiver], bound: Option<&ErrorBound>) -> Task {
        let count = receivers.len() as u32;
        let size = 4 * u64::from(count);
        let gpu = &self.gpu;
        let lights = gpu.input("lights", bytemuck::cast_slice(lights));
        let receivers = gpu.input("receivers", bytemuck::cast_slice(receivers));
        let results = gpu.buffer("results", size, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        let back = gpu.buffer("back", size, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        let bound = bound.map(|bound| gpu.input("bound", bytemuck::bytes_of(bound)));
        let bindings = [Some(&lights), Some(&receivers), Some(&results), bound.as_ref()];
        let group = gpu.group(&self.pipeline, 0, &bindings.into_iter().flatten().collect::<Vec<_>>());
        Task { group, results, back, count }
    }

    fn submit(&self, task: &Task, rounds: u32) {
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for _ in 0..rounds {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &task.group, &[]);
            pass.dispatch_workgroups(task.count.div_ceil(WORKGROUP), 1, 1);
        }
        encoder.copy_buffer_to_buffer(&task.results, 0, &task.back, 0, task.back.size());
        self.gpu.queue.submit([encoder.finish()]);
    }
}

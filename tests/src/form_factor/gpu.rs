//! The form factor on a GPU: the WGSL shell over the same cases.

use std::time::Instant;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use vlm_shaders::cpu::form_factor::{ErrorBound, LightGeometry};
use vlm_shaders::wgsl;
use wgpu::util::DeviceExt as _;

use super::case::Case;
use super::textbook::EdgeForm;

/// Invocations per workgroup, as in the shader.
const WORKGROUP: u32 = 64;

/// Why there is nothing from the GPU.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No Vulkan adapter, not even a software one.
    #[error("no Vulkan adapter: install a driver (Debian: mesa-vulkan-drivers and libvulkan1): {0}")]
    NoAdapter(String),
    /// The adapter gives no device or lost it.
    #[error("the GPU failed: {0}")]
    Device(String),
}

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
    device: wgpu::Device,
    queue: wgpu::Queue,
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
        Self::with_shader(&[wgsl::FORM_FACTOR, wgsl::RECEIVERS, include_str!("textbook.wgsl")].join("\n"))
    }

    /// The sum over lights at each point, see [`GpuFormFactor::measure_sums`].
    ///
    /// # Errors
    /// As [`GpuFormFactor::new`].
    pub fn sums() -> Result<Self, GpuError> {
        Self::with_shader(&wgsl::form_factor_sums())
    }

    fn with_shader(source: &str) -> Result<Self, GpuError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::VULKAN;
        let instance = wgpu::Instance::new(descriptor);
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
            .map_err(|error| GpuError::NoAdapter(error.to_string()))?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default()))
            .map_err(|error| GpuError::Device(error.to_string()))?;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("form_factor_cases"),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("form_factor_cases"),
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let info = adapter.get_info();
        let is_software = info.device_type == wgpu::DeviceType::Cpu;
        Ok(Self { name: info.name, is_software, device, queue, pipeline })
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
        self.read(&task.back)
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
        self.wait()?;
        let start = Instant::now();
        self.submit(&task, ROUNDS);
        self.wait()?;
        let pairs = f64::from(ROUNDS) * (lights.len() * points.len()) as f64;
        let rate = pairs / start.elapsed().as_secs_f64();
        Ok((self.read(&task.back)?, rate))
    }

    fn upload(&self, lights: &[LightGeometry], receivers: &[Receiver], bound: Option<&ErrorBound>) -> Task {
        let count = receivers.len() as u32;
        let size = 4 * u64::from(count);
        let lights = self.input("lights", bytemuck::cast_slice(lights));
        let receivers = self.input("receivers", bytemuck::cast_slice(receivers));
        let results =
            self.buffer("results", size, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        let back = self.buffer("back", size, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        let bound = bound.map(|bound| self.input("bound", bytemuck::bytes_of(bound)));
        let bindings = [Some(&lights), Some(&receivers), Some(&results), bound.as_ref()];
        let entries: Vec<_> = (0..)
            .zip(bindings.into_iter().flatten())
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        Task { group, results, back, count }
    }

    fn submit(&self, task: &Task, rounds: u32) {
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for _ in 0..rounds {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &task.group, &[]);
            pass.dispatch_workgroups(task.count.div_ceil(WORKGROUP), 1, 1);
        }
        encoder.copy_buffer_to_buffer(&task.results, 0, &task.back, 0, task.back.size());
        self.queue.submit([encoder.finish()]);
    }

    fn wait(&self) -> Result<(), GpuError> {
        let wait = wgpu::PollType::Wait { submission_index: None, timeout: None };
        self.device.poll(wait).map(|_| ()).map_err(|error| GpuError::Device(error.to_string()))
    }

    fn input(&self, label: &str, contents: &[u8]) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::STORAGE;
        self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(label),
            contents,
            usage,
        })
    }

    fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let descriptor =
            wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
        self.device.create_buffer(&descriptor)
    }

    fn read(&self, buffer: &wgpu::Buffer) -> Result<Vec<f32>, GpuError> {
        let failed = |error: &dyn std::fmt::Display| GpuError::Device(error.to_string());
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        self.wait()?;
        let mapped = buffer.get_mapped_range(..).map_err(|error| failed(&error))?;
        Ok(bytemuck::cast_slice(&mapped).to_vec())
    }
}

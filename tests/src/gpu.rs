//! A Vulkan device for compute shaders, with WebGPU's default limits and no optional features.

use wgpu::util::DeviceExt as _;

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

/// A device and its queue.
pub struct Gpu {
    /// The adapter, in its driver's words.
    pub name: String,
    /// It runs on the processor.
    pub is_software: bool,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
}

impl Gpu {
    /// The first Vulkan adapter's device.
    ///
    /// # Errors
    /// Where there is none or it gives no device.
    pub fn new() -> Result<Self, GpuError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::VULKAN;
        let instance = wgpu::Instance::new(descriptor);
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
            .map_err(|error| GpuError::NoAdapter(error.to_string()))?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default()))
            .map_err(|error| GpuError::Device(error.to_string()))?;
        let info = adapter.get_info();
        let is_software = info.device_type == wgpu::DeviceType::Cpu;
        Ok(Self { name: info.name, is_software, device, queue })
    }

    /// A compute pipeline whose layout is what the entry point binds.
    pub(crate) fn pipeline(&self, source: &str, entry_point: &str) -> wgpu::ComputePipeline {
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(entry_point),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry_point),
            layout: None,
            module: &module,
            entry_point: Some(entry_point),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        })
    }

    /// Buffers as the bindings 0, 1, ... of a group.
    pub(crate) fn group(
        &self,
        pipeline: &wgpu::ComputePipeline,
        number: u32,
        buffers: &[&wgpu::Buffer],
    ) -> wgpu::BindGroup {
        let numbered: Vec<_> = (0..).zip(buffers.iter().copied()).collect();
        self.group_at(pipeline, number, &numbered)
    }

    /// Buffers as the bindings of these numbers of a group.
    pub(crate) fn group_at(
        &self,
        pipeline: &wgpu::ComputePipeline,
        number: u32,
        buffers: &[(u32, &wgpu::Buffer)],
    ) -> wgpu::BindGroup {
        let mut entries = Vec::with_capacity(buffers.len());
        for &(binding, buffer) in buffers {
            entries.push(wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() });
        }
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(number),
            entries: &entries,
        })
    }

    /// A buffer that shaders read.
    pub(crate) fn input(&self, label: &str, contents: &[u8]) -> wgpu::Buffer {
        self.filled(label, contents, wgpu::BufferUsages::STORAGE)
    }

    /// A buffer with contents; zeros for an element of any shader's where it would be empty, since nothing empty can be bound.
    pub(crate) fn filled(&self, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let contents = if contents.is_empty() { &[0; 256] } else { contents };
        let label = Some(label);
        self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage })
    }

    /// A buffer of zeros.
    pub(crate) fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let descriptor =
            wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
        self.device.create_buffer(&descriptor)
    }

    /// Waits until all that was submitted is done.
    pub(crate) fn wait(&self) -> Result<(), GpuError> {
        let wait = wgpu::PollType::Wait { submission_index: None, timeout: None };
        self.device.poll(wait).map(|_| ()).map_err(|error| GpuError::Device(error.to_string()))
    }

    /// What a buffer holds that the processor may map.
    pub(crate) fn read<T: bytemuck::Pod>(&self, buffer: &wgpu::Buffer) -> Result<Vec<T>, GpuError> {
        let failed = |error: &dyn std::fmt::Display| GpuError::Device(error.to_string());
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        self.wait()?;
        let mapped = buffer.get_mapped_range(..).map_err(|error| failed(&error))?;
        Ok(bytemuck::pod_collect_to_vec(&mapped))
    }
}

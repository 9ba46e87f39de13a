//! Layouts, pipelines and buffers, with the limits that they keep.

use wgpu::util::DeviceExt as _;
use wgpu::{BindGroup, BindGroupLayout, BindingType, Buffer, BufferUsages, ComputePipeline, Device};

use crate::error::{Error, within};

/// Invocations per workgroup of the passes over lights and probes, as in the shaders.
const WORKGROUP: u32 = 64;

/// Size of a buffer that holds nothing, since nothing empty can be bound: an element of any shader's.
const LEAST_BYTES: u64 = 256;

/// Bindings 0, 1, ... of a group, some of which may be left out.
pub(crate) fn layout(device: &Device, label: &str, bindings: &[(u32, BindingType)]) -> BindGroupLayout {
    let entry = |&(binding, ty): &(u32, BindingType)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: visibility(ty),
        ty,
        count: None,
    };
    let entries: Vec<_> = bindings.iter().map(entry).collect();
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// What shaders only read, forward shaders read too.
fn visibility(ty: BindingType) -> wgpu::ShaderStages {
    let read_only = matches!(
        ty,
        BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform | wgpu::BufferBindingType::Storage { read_only: true },
            ..
        }
    );
    if read_only {
        wgpu::ShaderStages::COMPUTE | wgpu::ShaderStages::FRAGMENT
    } else {
        wgpu::ShaderStages::COMPUTE
    }
}

/// A buffer that shaders only read, or also write.
pub(crate) fn storage(read_only: bool) -> BindingType {
    buffer_type(wgpu::BufferBindingType::Storage { read_only })
}

/// A uniform buffer.
pub(crate) fn uniform() -> BindingType {
    buffer_type(wgpu::BufferBindingType::Uniform)
}

fn buffer_type(ty: wgpu::BufferBindingType) -> BindingType {
    BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

/// A compute pipeline over these groups.
pub(crate) fn pipeline(
    device: &Device,
    entry_point: &str,
    source: &str,
    groups: &[&BindGroupLayout],
) -> ComputePipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(entry_point),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let groups: Vec<_> = groups.iter().map(|group| Some(*group)).collect();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(entry_point),
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry_point),
        layout: Some(&layout),
        module: &module,
        entry_point: Some(entry_point),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}

/// Pipelines by their source, so that another asset compiles nothing that was compiled before.
#[derive(Default)]
pub(crate) struct Compiled(Vec<(String, ComputePipeline)>);

impl Compiled {
    /// As [`pipeline`]; layouts of the same source are taken to be the same.
    pub(crate) fn pipeline(
        &mut self,
        device: &Device,
        entry_point: &str,
        source: &str,
        groups: &[&BindGroupLayout],
    ) -> ComputePipeline {
        if let Some((_, known)) = self.0.iter().find(|(known, _)| known == source) {
            return known.clone();
        }
        let made = pipeline(device, entry_point, source, groups);
        self.0.push((source.to_owned(), made.clone()));
        made
    }
}

/// Buffers at their bindings.
pub(crate) fn group<'a>(
    device: &Device,
    label: &str,
    layout: &BindGroupLayout,
    buffers: &[(u32, &'a Buffer)],
) -> BindGroup {
    let entry = |(binding, buffer): (u32, &'a Buffer)| wgpu::BindGroupEntry {
        binding,
        resource: buffer.as_entire_binding(),
    };
    let entries: Vec<_> = buffers.iter().copied().map(entry).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

/// Makes buffers within the device's limits and counts what they hold.
pub(crate) struct Buffers<'a> {
    pub device: &'a Device,
    pub bytes: u64,
}

impl Buffers<'_> {
    /// A buffer with contents that shaders read and the host may change.
    pub(crate) fn input<T: bytemuck::Pod>(&mut self, label: &str, contents: &[T]) -> Result<Buffer, Error> {
        self.filled(label, bytemuck::cast_slice(contents), BufferUsages::STORAGE)
    }

    /// A uniform buffer with contents.
    pub(crate) fn uniform(&mut self, label: &str, contents: &[u8]) -> Result<Buffer, Error> {
        self.filled(label, contents, BufferUsages::UNIFORM)
    }

    fn filled(&mut self, label: &str, contents: &[u8], usage: BufferUsages) -> Result<Buffer, Error> {
        let contents = if contents.is_empty() { &[0; LEAST_BYTES as usize] } else { contents };
        self.check(label, contents.len() as u64)?;
        self.bytes += contents.len() as u64;
        let usage = usage | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let label = Some(label);
        Ok(self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage }))
    }

    /// A buffer of zeros that shaders read or write.
    pub(crate) fn zeros(&self, label: &str, size: u64) -> Result<Buffer, Error> {
        let size = size.max(LEAST_BYTES);
        self.check(label, size)?;
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let descriptor =
            wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
        Ok(self.device.create_buffer(&descriptor))
    }

    /// An error where a buffer of this size would not fit.
    pub(crate) fn check(&self, label: &str, size: u64) -> Result<(), Error> {
        let limits = self.device.limits();
        let what = format!("the buffer `{label}` (bytes)");
        within(&what, "max_buffer_size", size, limits.max_buffer_size)?;
        within(&what, "max_storage_buffer_binding_size", size, limits.max_storage_buffer_binding_size)
    }
}

/// How many workgroups a pass of one invocation per element takes.
pub(crate) fn workgroups(device: &Device, what: &str, elements: usize) -> Result<u32, Error> {
    let groups = (elements as u64).div_ceil(u64::from(WORKGROUP));
    let limit = device.limits().max_compute_workgroups_per_dimension;
    within(
        &format!("`{what}` (workgroups)"),
        "max_compute_workgroups_per_dimension",
        groups,
        u64::from(limit),
    )?;
    Ok(u32::try_from(groups).unwrap_or(u32::MAX))
}

/// Adds one dispatch.
pub(crate) fn dispatch(
    encoder: &mut wgpu::CommandEncoder,
    label: &str,
    pipeline: &ComputePipeline,
    groups: &[&BindGroup],
    [x, y]: [u32; 2],
) {
    let descriptor = wgpu::ComputePassDescriptor { label: Some(label), timestamp_writes: None };
    let mut pass = encoder.begin_compute_pass(&descriptor);
    pass.set_pipeline(pipeline);
    (0..).zip(groups).for_each(|(number, group)| pass.set_bind_group(number, *group, &[]));
    pass.dispatch_workgroups(x, y, 1);
}

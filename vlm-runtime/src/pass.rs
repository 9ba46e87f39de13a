//! Layouts, pipelines and buffers, with the limits that they keep.

use wgpu::util::DeviceExt as _;
use wgpu::{BindGroup, BindGroupLayout, BindingType, Buffer, BufferUsages, ComputePipeline, Device, Queue};

use crate::direct::write;
use crate::error::{Error, within};
use crate::timer::Timer;
use crate::upload::list_words;
use vlm_shaders::tables::ALL;

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
        self.bytes += contents.len() as u64;
        self.contents(label, contents, usage)
    }

    /// A buffer with contents, not empty, whose bytes are not counted.
    pub(crate) fn contents(
        &self,
        label: &str,
        contents: &[u8],
        usage: BufferUsages,
    ) -> Result<Buffer, Error> {
        self.check(label, contents.len() as u64)?;
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

/// A list of what a pass works on, at a place of `indices`: as `listed` in the shaders reads it.
pub(crate) struct Worklist {
    /// Where it begins.
    start: u32,
    /// All that there are.
    total: usize,
    /// How long the list on the device is, or [`ALL`].
    on_device: u32,
    /// How many the next pass works on; 0 for no pass.
    planned: usize,
}

impl Worklist {
    pub(crate) fn new(start: u32, total: usize) -> Self {
        Self { start, total, on_device: ALL, planned: 0 }
    }

    /// The next pass works on these, or on all; bytes written.
    pub(crate) fn plan(&mut self, queue: &Queue, indices: &Buffer, list: Option<&[u32]>) -> u64 {
        self.planned = list.map_or(self.total, <[u32]>::len);
        let Some(list) = list else {
            if self.on_device == ALL {
                return 0;
            }
            self.on_device = ALL;
            return write(queue, indices, self.start as usize, &[ALL]);
        };
        if list.is_empty() {
            return 0;
        }
        self.on_device = list.len() as u32;
        write(queue, indices, self.start as usize, &list_words(list))
    }

    /// How many the next pass works on, once.
    pub(crate) fn take(&mut self) -> usize {
        std::mem::take(&mut self.planned)
    }

    /// All that there are.
    pub(crate) fn total(&self) -> usize {
        self.total
    }

    /// Whether the next pass works on all.
    pub(crate) fn is_all(&self) -> bool {
        self.on_device == ALL
    }
}

/// How many workgroups of a pass these elements take, which fit the device all together.
pub(crate) fn some_workgroups(elements: usize) -> u32 {
    u32::try_from((elements as u64).div_ceil(u64::from(WORKGROUP))).unwrap_or(u32::MAX)
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

/// The passes of a frame, as they are added to an encoder.
pub(crate) struct Passes<'a> {
    encoder: &'a mut wgpu::CommandEncoder,
    timer: Option<&'a mut Timer>,
    /// Of this frame, in order.
    pub names: Vec<&'static str>,
}

impl<'a> Passes<'a> {
    pub(crate) fn new(encoder: &'a mut wgpu::CommandEncoder, timer: Option<&'a mut Timer>) -> Self {
        Self { encoder, timer, names: Vec::new() }
    }

    /// Adds a pass of one dispatch.
    pub(crate) fn add(
        &mut self,
        name: &'static str,
        pipeline: &ComputePipeline,
        groups: &[&BindGroup],
        workgroups: [u32; 2],
    ) {
        self.add_each(name, pipeline, &[groups], workgroups);
    }

    /// Adds a pass of a dispatch for each of several lists of groups, one after the other.
    pub(crate) fn add_each(
        &mut self,
        name: &'static str,
        pipeline: &ComputePipeline,
        dispatches: &[&[&BindGroup]],
        [x, y]: [u32; 2],
    ) {
        let timestamp_writes = self.timer.as_ref().and_then(|timer| timer.writes(self.names.len()));
        let descriptor = wgpu::ComputePassDescriptor { label: Some(name), timestamp_writes };
        let mut pass = self.encoder.begin_compute_pass(&descriptor);
        pass.set_pipeline(pipeline);
        for groups in dispatches {
            (0..).zip(*groups).for_each(|(number, group)| pass.set_bind_group(number, *group, &[]));
            pass.dispatch_workgroups(x, y, 1);
        }
        drop(pass);
        self.names.push(name);
    }

    /// Sets a buffer to zeros.
    pub(crate) fn clear(&mut self, buffer: &Buffer) {
        self.encoder.clear_buffer(buffer, 0, None);
    }

    /// Sends the times back; the names of the passes.
    pub(crate) fn finish(self, frame: u64) -> Vec<&'static str> {
        if let Some(timer) = self.timer {
            timer.finish(self.encoder, frame, &self.names);
        }
        self.names
    }
}

//! Layouts, groups and buffers of the viewer's passes.

use wgpu::util::DeviceExt as _;
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, BindingType, Buffer, BufferBindingType, BufferUsages,
    ColorTargetState, ColorWrites, PipelineLayout, ShaderStages, TextureSampleType, TextureView,
};

use super::error::ViewError;
use super::gpu::Gpu;
use crate::error::within;

/// A uniform buffer.
pub(crate) const UNIFORM: BindingType = buffer(BufferBindingType::Uniform);
/// A buffer that shaders read.
pub(crate) const READ: BindingType = buffer(BufferBindingType::Storage { read_only: true });
/// A buffer that shaders write.
pub(crate) const WRITE: BindingType = buffer(BufferBindingType::Storage { read_only: false });
/// A texture whose texels are read one by one.
pub(crate) const TEXELS: BindingType = texture(TextureSampleType::Float { filterable: false });
/// A texture that is sampled.
pub(crate) const SAMPLED: BindingType = texture(TextureSampleType::Float { filterable: true });
/// A texture of whole numbers.
pub(crate) const NUMBERS: BindingType = texture(TextureSampleType::Uint);
/// How a texture is sampled.
pub(crate) const SAMPLER: BindingType = BindingType::Sampler(wgpu::SamplerBindingType::Filtering);

const fn buffer(ty: BufferBindingType) -> BindingType {
    BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

const fn texture(sample_type: TextureSampleType) -> BindingType {
    BindingType::Texture { sample_type, view_dimension: wgpu::TextureViewDimension::D2, multisampled: false }
}

/// Bindings 0, 1, ... of a group, for these stages.
pub(crate) fn layout(
    gpu: &Gpu,
    label: &str,
    visibility: ShaderStages,
    types: &[BindingType],
) -> BindGroupLayout {
    let entry = |(binding, &ty): (u32, &BindingType)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty,
        count: None,
    };
    let entries: Vec<_> = (0..).zip(types).map(entry).collect();
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries };
    gpu.device.create_bind_group_layout(&descriptor)
}

/// Resources as bindings 0, 1, ...
pub(crate) fn group(
    gpu: &Gpu,
    label: &str,
    layout: &BindGroupLayout,
    resources: Vec<BindingResource<'_>>,
) -> BindGroup {
    let entries: Vec<_> =
        (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    let descriptor = wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries };
    gpu.device.create_bind_group(&descriptor)
}

/// A texture as a resource.
pub(crate) fn view(view: &TextureView) -> BindingResource<'_> {
    BindingResource::TextureView(view)
}

/// The layout of a pipeline over these groups.
pub(crate) fn pipeline_layout(gpu: &Gpu, label: &str, groups: &[&BindGroupLayout]) -> PipelineLayout {
    let groups: Vec<_> = groups.iter().map(|group| Some(*group)).collect();
    let descriptor =
        wgpu::PipelineLayoutDescriptor { label: Some(label), bind_group_layouts: &groups, immediate_size: 0 };
    gpu.device.create_pipeline_layout(&descriptor)
}

/// A buffer with contents; one element of zeros where there are none, as nothing empty can be bound.
pub(crate) fn filled<T: bytemuck::Pod>(
    gpu: &Gpu,
    label: &str,
    contents: &[T],
    usage: BufferUsages,
) -> Result<Buffer, ViewError> {
    let bytes: &[u8] = bytemuck::cast_slice(contents);
    let bytes = if bytes.is_empty() { &[0; 256] } else { bytes };
    check_size(gpu, label, bytes.len() as u64)?;
    let label = Some(label);
    let usage = usage | BufferUsages::COPY_DST;
    let descriptor = wgpu::util::BufferInitDescriptor { label, contents: bytes, usage };
    Ok(gpu.device.create_buffer_init(&descriptor))
}

/// A buffer of zeros.
pub(crate) fn zeros(gpu: &Gpu, label: &str, size: u64, usage: BufferUsages) -> Result<Buffer, ViewError> {
    let size = size.max(256);
    check_size(gpu, label, size)?;
    let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
    Ok(gpu.device.create_buffer(&descriptor))
}

fn check_size(gpu: &Gpu, label: &str, size: u64) -> Result<(), ViewError> {
    let limits = gpu.device.limits();
    let what = format!("the buffer `{label}` (bytes)");
    within(&what, "max_buffer_size", size, limits.max_buffer_size)?;
    let limit = limits.max_storage_buffer_binding_size;
    Ok(within(&what, "max_storage_buffer_binding_size", size, limit)?)
}

/// What a pass writes to a texture of that format; what is there stays where `blends`.
pub(crate) fn target(format: wgpu::TextureFormat, blends: bool) -> Option<ColorTargetState> {
    let blend = blends.then_some(wgpu::BlendState::ALPHA_BLENDING);
    Some(ColorTargetState { format, blend, write_mask: ColorWrites::ALL })
}

/// Draws to all of a texture, or over what is there.
pub(crate) fn attachment(
    view: &TextureView,
    clear: Option<wgpu::Color>,
) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    let load = clear.map_or(wgpu::LoadOp::Load, wgpu::LoadOp::Clear);
    let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
    Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
}

//! materials: what colours a scene's surfaces, on the device: textures with their mip levels, and a group per material.

use glam::Vec4;
use vlm_bake::scene::texture::{Texture as Image, Wrap};
use vlm_bake::scene::{Material, Scene};
use wgpu::{AddressMode, BindGroup, BufferUsages, FilterMode, MipmapFilterMode, Sampler, TextureView};

use super::bindings::{filled, group, view};
use super::error::ViewError;
use super::gpu::Gpu;
use super::surface::SurfaceStage;
use crate::error::within;

/// As `Material` in the shader. 48 bytes.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Packed {
    pub(super) base_color: Vec4,
    pub(super) emission: Vec4,
    pub(super) is_masked: u32,
    pub(super) padding: [u32; 3],
}

/// A texture on the device, and how it is sampled.
struct Sampled {
    view: TextureView,
    sampler: Sampler,
}

/// A group for each material of a scene.
pub(crate) fn material_groups(
    gpu: &Gpu,
    stage: &SurfaceStage,
    scene: &Scene,
) -> Result<Vec<BindGroup>, ViewError> {
    let white = upload(gpu, &Image::white())?;
    let textures: Vec<Sampled> =
        scene.textures.iter().map(|image| upload(gpu, image)).collect::<Result<_, _>>()?;
    let texture = |index: Option<u32>| index.and_then(|i| textures.get(i as usize)).unwrap_or(&white);
    let of = |material: &Material| {
        let image = material.base_color_texture.and_then(|i| scene.textures.get(i as usize));
        let packed = pack(material, image.is_some_and(Image::is_masked));
        let uniform = filled(gpu, "material", &[packed], BufferUsages::UNIFORM)?;
        let (base, glow) = (texture(material.base_color_texture), texture(material.emissive_texture));
        let resources = vec![
            uniform.as_entire_binding(),
            view(&base.view),
            wgpu::BindingResource::Sampler(&base.sampler),
            view(&glow.view),
            wgpu::BindingResource::Sampler(&glow.sampler),
        ];
        Ok(group(gpu, "material", &stage.material_layout, resources))
    };
    scene.materials.iter().map(of).collect()
}

fn pack(material: &Material, is_masked: bool) -> Packed {
    Packed {
        base_color: material.base_color.extend(material.alpha_factor),
        emission: material.emission.extend(material.alpha_cutoff.unwrap_or(-1.0)),
        is_masked: u32::from(is_masked),
        padding: [0; 3],
    }
}

fn upload(gpu: &Gpu, image: &Image) -> Result<Sampled, ViewError> {
    let [width, height] = image.size();
    let limit = u64::from(gpu.device.limits().max_texture_dimension_2d);
    within("a texture (texels)", "max_texture_dimension_2d", u64::from(width.max(height)), limit)?;
    let levels: Vec<_> = image.srgb8_levels().collect();
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("image"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: levels.len().max(1) as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (mip_level, (width, height, texels)) in (0..).zip(&levels) {
        let to = wgpu::TexelCopyTextureInfo { mip_level, ..texture.as_image_copy() };
        let rows =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * width), rows_per_image: None };
        let size = wgpu::Extent3d { width: *width, height: *height, depth_or_array_layers: 1 };
        gpu.queue.write_texture(to, bytemuck::cast_slice(texels), rows, size);
    }
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    Ok(Sampled { view, sampler: sampler(gpu, image) })
}

fn sampler(gpu: &Gpu, image: &Image) -> Sampler {
    let sampling = image.sampling();
    let address = |wrap: Wrap| match wrap {
        Wrap::Repeat => AddressMode::Repeat,
        Wrap::Mirror => AddressMode::MirrorRepeat,
        Wrap::Clamp => AddressMode::ClampToEdge,
    };
    gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("image"),
        address_mode_u: address(sampling.wrap[0]),
        address_mode_v: address(sampling.wrap[1]),
        mag_filter: if sampling.nearest { FilterMode::Nearest } else { FilterMode::Linear },
        min_filter: FilterMode::Linear,
        mipmap_filter: MipmapFilterMode::Linear,
        ..wgpu::SamplerDescriptor::default()
    })
}

//! targets: the textures of a frame, from the visible surface to its light.

use wgpu::{Buffer, BufferUsages, Texture, TextureFormat, TextureUsages, TextureView};

use super::bindings::zeros;
use super::error::ViewError;
use super::gpu::Gpu;
use crate::error::within;

/// Of depth; reversed, so that it is exact far away.
pub(crate) const DEPTH: TextureFormat = TextureFormat::Depth32Float;
/// Of normals and of light.
pub(crate) const FLOATS: TextureFormat = TextureFormat::Rgba32Float;
/// Of albedo.
pub(crate) const ALBEDO: TextureFormat = TextureFormat::Rgba16Float;
/// Of tags.
pub(crate) const TAG: TextureFormat = TextureFormat::R32Uint;

/// A texture with a view of all of it.
pub(crate) struct Plane {
    pub texture: Texture,
    pub view: TextureView,
}

/// The textures of a frame of one size.
pub(crate) struct FrameTargets {
    pub size: [u32; 2],
    pub depth: Plane,
    pub normal: Plane,
    pub geometric_normal: Plane,
    pub albedo: Plane,
    pub emission: Plane,
    pub tag: Plane,
    /// Irradiance by real lights, lx, row by row.
    pub direct: Buffer,
    /// Irradiance by the virtual lights, by one method and the other.
    pub indirect: [Plane; 2],
}

impl FrameTargets {
    pub(crate) fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, ViewError> {
        let limit = u64::from(gpu.device.limits().max_texture_dimension_2d);
        let longest = u64::from(size[0].max(size[1]));
        within("the picture (pixels of a side)", "max_texture_dimension_2d", longest, limit)?;
        let drawn = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
        let read = drawn | TextureUsages::COPY_SRC;
        let lit = read | TextureUsages::STORAGE_BINDING;
        let plane = |label, format, usage| Plane::new(gpu, label, size, format, usage);
        let bytes = u64::from(size[0]) * u64::from(size[1]) * size_of::<[f32; 4]>() as u64;
        let light = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        Ok(Self {
            size,
            depth: plane("depth", DEPTH, drawn),
            normal: plane("normal", FLOATS, drawn),
            geometric_normal: plane("geometric normal", FLOATS, drawn),
            albedo: plane("albedo", ALBEDO, read),
            emission: plane("emission", FLOATS, read),
            tag: plane("tag", TAG, drawn),
            direct: zeros(gpu, "direct", bytes, light)?,
            indirect: [plane("indirect", FLOATS, lit), plane("other indirect", FLOATS, lit)],
        })
    }
}

impl Plane {
    pub(crate) fn new(
        gpu: &Gpu,
        label: &str,
        [width, height]: [u32; 2],
        format: TextureFormat,
        usage: TextureUsages,
    ) -> Self {
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self { texture, view }
    }
}

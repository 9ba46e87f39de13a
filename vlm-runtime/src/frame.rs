//! What a host says of itself and of each frame.

use glam::{DMat4, Mat4};
use vlm_shaders::cpu::punctual::PunctualLight;
use vlm_shaders::cpu::view::View;

/// Choices for a renderer's whole life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Below this many lights the grid is left out and every light is summed at every pixel. Higher values save the passes of small grids,
    /// and lose their shadows and time in larger ones.
    pub fewest_lights_for_grid: u32,
    /// Nodes that bear a VLM may move. Costs the gather a list of the lights that moved, empty at rest.
    pub moving_nodes: bool,
    /// Count pairs of a pixel and a light, for [`crate::VlmRenderer::pairs_evaluated`]. Costs the deferred gather an atomic addition a pixel.
    pub count_pairs: bool,
    /// Time each pass, for [`crate::FrameStats::times`], on devices made with `TIMESTAMP_QUERY`. Costs two timestamps a pass and a copy of some
    /// bytes a frame.
    pub time_passes: bool,
    /// What the deferred gather writes.
    pub format: IrradianceFormat,
}

/// The format of the irradiance that the deferred gather writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum IrradianceFormat {
    /// `Rgba16Float`: eleven bits, 8 bytes a pixel.
    #[default]
    Half,
    /// `Rgba32Float`: nothing is rounded, 16 bytes a pixel.
    Float,
}

impl IrradianceFormat {
    /// As wgpu names it.
    #[must_use]
    pub fn texture_format(self) -> wgpu::TextureFormat {
        match self {
            Self::Half => wgpu::TextureFormat::Rgba16Float,
            Self::Float => wgpu::TextureFormat::Rgba32Float,
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            fewest_lights_for_grid: 40,
            moving_nodes: false,
            count_pairs: false,
            time_passes: false,
            format: IrradianceFormat::Half,
        }
    }
}

/// What a frame shows, and by which lights. Compared with the frame before: what stays the same costs nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frame<'a> {
    /// The real lights, world space.
    pub lights: &'a [PunctualLight],
    /// Their shadows on the visible surface.
    pub visibility: Visibility<'a>,
    /// The nodes that are not where the file has them.
    pub moved: &'a [MovedNode],
    /// The camera, for the deferred gather.
    pub view: View,
}

/// Which real lights the points of [`crate::VlmRenderer::points`] see.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Visibility<'a> {
    /// As in the frame before; every point sees every light where none was ever given.
    #[default]
    Kept,
    /// The share of a light that a point sees, 0 to 1: `light * points + point`. By shadow maps, ray queries, rays on the CPU.
    Given(&'a [f32]),
    /// By shadow maps of the host, which the pass `shadow` reads at the points on the device. Only maps that changed are read again, and again
    /// by nodes that moved. Lights without a map are seen by every point.
    Maps(&'a [ShadowMap<'a>]),
}

/// A shadow map of a real light: the depth of what it sees.
///
/// A spot light has one map, a directional light one or more (as cascades), a point light six, one for each face of a cube: views of single
/// layers of a cube's texture, or of textures of their own, with a field of view of 90 degrees. Where several maps of a light hold a point, the
/// first in order counts, so put the finest first; where none does, the point sees the light.
///
/// The share of a light that a point sees is filtered over three texels. Surface that shadows itself ("acne") wants higher offsets, light under
/// contacts ("peter-panning") lower ones, or more texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowMap<'a> {
    /// The light's number in [`Frame::lights`].
    pub light: u32,
    /// Depth in red, of a depth or float format without multisampling, as a two-dimensional view of one layer; formats with stencil by their
    /// depth aspect. With `TEXTURE_BINDING`. The pass of [`crate::VlmRenderer::record`] reads it, so it must have been drawn by then.
    pub depth: &'a wgpu::TextureView,
    /// To the map's clip space, as WebGPU has it: y up, depth 0 to 1.
    pub clip_from_world: Mat4,
    /// What is nearer has more depth.
    pub is_reversed: bool,
    /// How far points move along their normal before they are looked up, in texels as large as they are where the point lies, times the sine of
    /// the angle between normal and light. 0 or more. The filter reaches two texels: from 2 on most planes do not shadow themselves, from 2.8 on
    /// none; higher values lose the shadows of thin things.
    pub normal_offset: f32,
    /// How far points move toward the light, metres, 0 or more. Higher values hide that depth is rounded (to `2^-16` of the map's extent in a
    /// `Depth16Unorm`) or drawn of other triangles than the points lie on; they lose shadows of what lies closer.
    pub depth_bias: f32,
    /// Of the map's contents: another number than in the frame before says that they changed.
    pub revision: u64,
}

impl<'a> ShadowMap<'a> {
    /// A map whose depth grows away from the light, with an offset of 2 texels and a bias of 1 mm.
    #[must_use]
    pub fn new(light: u32, depth: &'a wgpu::TextureView, clip_from_world: Mat4) -> Self {
        Self {
            light,
            depth,
            clip_from_world,
            is_reversed: false,
            normal_offset: 2.0,
            depth_bias: 1e-3,
            revision: 0,
        }
    }
}

/// A node that bears a VLM, and where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovedNode {
    /// Index of the glTF node.
    pub node: u32,
    /// Its global transform, metres.
    pub world_from_node: DMat4,
}

/// The textures of the deferred gather, all of one size.
#[derive(Clone, Copy, Debug)]
pub struct Targets<'a> {
    /// Depth in red; a depth format, or a float one.
    pub depth: &'a wgpu::TextureView,
    /// Shading normals in world space, of any length, 0 where nothing was drawn; any float format that holds negative numbers.
    pub normal: &'a wgpu::TextureView,
    /// Normals of the triangles, likewise: no light comes from behind them. The shading normals where there are none.
    pub geometric_normal: Option<&'a wgpu::TextureView>,
    /// Tags of the surface (see [`vlm_format::VlmAsset::tag_of`]) in red; an integer format. Untagged without. Not read by assets without
    /// tags, or where all light comes through a grid, whose probes know the tags.
    pub tag: Option<&'a wgpu::TextureView>,
    /// What moves, not 0 in red; an integer format. Such pixels get light from the grid's probes in free space, where the file has boxes of them
    /// (`extras.vlm.volume` on a mesh), since probes on surface know nothing of what is not surface. Nothing moves without. Not read by assets
    /// without such probes.
    pub moving: Option<&'a wgpu::TextureView>,
    /// Out, of the format of [`Settings::format`] with `STORAGE_BINDING`: irradiance in lx times [`View::exposure`].
    pub irradiance: &'a wgpu::TextureView,
}

//! What a host says of itself and of each frame.

use glam::DMat4;
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
    /// Out, of the format of [`Settings::format`] with `STORAGE_BINDING`: irradiance in lx times [`View::exposure`].
    pub irradiance: &'a wgpu::TextureView,
}

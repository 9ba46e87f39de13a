//! A Virtual Light Mesh in memory: flat arrays, as a GPU reads them.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::grid::Grid;
use crate::tags::TriangleTags;

/// All the Virtual Light Meshes of one glTF file, with the static grid over them.
///
/// Every light (a triangle) has a number: its index into `triangles`, `albedo`, `emission` and `tags`. The lights of one
/// [`Vlm`] are contiguous, and so are its vertices and samples. Positions, normals and samples are in the space of
/// the node that bears the VLM, so that a transform moves the lights with their object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VlmAsset {
    /// The tool that made this asset and its version, such as `vlm-bake 0.1.0`.
    pub generator: String,
    /// The options of the bake.
    pub settings: Settings,
    /// One VLM per node that has lights, in the order of the nodes.
    pub vlms: Vec<Vlm>,
    /// Vertices of the lights, in metres, node space.
    pub positions: Vec<Vec3>,
    /// Three indices into `positions` per light, counter-clockwise seen from the emitting side.
    pub triangles: Vec<[u32; 3]>,
    /// Mean linear albedo of the surface that each light stands for, 0 to 1 per channel (more where an artist wants it).
    pub albedo: Vec<Vec3>,
    /// Radiosity that each light emits by itself, `pi * L_e` in lx. Empty when nothing emits.
    pub emission: Vec<Vec3>,
    /// The tag of each light, 0 for none: a receiver of the same tag is never lit by it. Empty when nothing is tagged.
    pub tags: Vec<u32>,
    /// `triangles.len() + 1` offsets: the samples of light `i` are `samples[sample_starts[i]..sample_starts[i + 1]]`.
    pub sample_starts: Vec<u32>,
    /// Points on the visible surface that phase 1 lights.
    pub samples: Vec<Sample>,
    /// Tags of visible primitives as wholes, `(mesh, primitive, tag)`, sorted, tag never 0.
    pub primitive_tags: Vec<(u32, u32, u32)>,
    /// Tags of the visible primitives whose triangles differ, sorted by mesh and primitive; none of them is in
    /// `primitive_tags`.
    pub triangle_tags: Vec<TriangleTags>,
    /// Tags of visible nodes as wholes, `(node, tag)`, sorted, tag never 0. They win over those of the node's primitives,
    /// which other nodes may share. See [`VlmAsset::tag_of`].
    pub node_tags: Vec<(u32, u32)>,
    /// The static grid, in world space, or `None` when the asset has none.
    pub grid: Option<Grid>,
}

/// The lights of one node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vlm {
    /// Unique within the file; nodes refer to it.
    pub id: String,
    /// Index of the glTF node that bears it.
    pub node: u32,
    /// First light and number of lights.
    pub lights: [u32; 2],
    /// First vertex and number of vertices.
    pub vertices: [u32; 2],
    /// True if an artist made the mesh, false if the baker derived it from the visible surface.
    pub authored: bool,
}

/// One point on the visible surface; phase 1 finds its direct irradiance `E`.
///
/// A light's radiosity is `emission + sum(reflectance * E)` over its samples.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Sample {
    /// On the visible surface, metres, node space.
    pub position: Vec3,
    /// Unit normal of the visible surface, node space.
    pub normal: Vec3,
    /// Albedo times the share of the light's area for which the sample stands, times tint and intensity.
    pub reflectance: Vec3,
}

/// The options of a bake, kept in the file so that a rebake can repeat them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct Settings {
    /// `draft`, `game` or `quality`.
    pub preset: String,
    /// Asked number of lights for the whole scene.
    pub lights: u32,
    /// Edge of the grid's coarsest cells, metres.
    pub cell_size: f32,
    /// Asked number of probes on surface.
    pub probes: u32,
    /// Directions traced from each probe.
    pub rays: u32,
    /// The most near lights of a probe.
    pub near: u32,
    /// Samples per light.
    pub samples: u32,
}

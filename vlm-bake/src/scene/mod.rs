//! The visible scene: world-space triangles, materials, punctual lights and cameras, read from glTF.

use glam::{DMat4, DVec3, Vec2, Vec3};

/// Everything that the stages after this one know of the glTF file.
///
/// Vertices are in world space (metres), triangles counter-clockwise seen from their front, whatever the sign of the
/// node's scale. All arrays called `triangle_*` are as long as `triangles`; all called `vertex_*` as long as `positions`.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// World-space vertices.
    pub positions: Vec<Vec3>,
    /// Unit shading normals in world space; the face's own where the file has none.
    pub vertex_normals: Vec<Vec3>,
    /// Texture coordinates of the base colour texture, after KHR_texture_transform; 0 where there is none.
    pub vertex_uvs: Vec<Vec2>,
    /// Texture coordinates of the emissive texture, likewise.
    pub vertex_emissive_uvs: Vec<Vec2>,
    /// Linear COLOR_0 (rgb), 1 where there is none.
    pub vertex_colors: Vec<Vec3>,
    /// Three indices into the vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Index into `primitives` for each triangle.
    pub triangle_primitive: Vec<u32>,
    /// For each triangle its index within the glTF primitive as drawn, where those that are left out count, too.
    pub triangle_in_primitive: Vec<u32>,
    /// One per glTF primitive and node (and instance).
    pub primitives: Vec<ScenePrimitive>,
    /// One per node that has visible or authored geometry.
    pub objects: Vec<Object>,
    /// At least one: the last is glTF's default material.
    pub materials: Vec<Material>,
    /// Decoded base colour and emissive images, linear; materials index them.
    pub textures: Vec<texture::Texture>,
    /// Punctual lights.
    pub lights: Vec<PunctualLight>,
    /// Cameras of the file.
    pub cameras: Vec<Camera>,
    /// Authored light meshes: they are not part of the visible triangles.
    pub authored: Vec<AuthoredMesh>,
    /// Boxes in which moving objects need light, least and largest corner of each in world space, metres: those around meshes that
    /// `extras.vlm.volume` marks, which are no part of the visible triangles.
    pub volumes: Vec<[DVec3; 2]>,
    /// Triangles of the file that were left out because their area is within the rounding of their coordinates.
    pub degenerate_triangles: usize,
    /// What was left out or guessed, for the user to read: place and reason.
    pub notes: Vec<String>,
}

/// A run of triangles with one material.
#[derive(Clone, Debug)]
pub struct ScenePrimitive {
    /// Index into [`Scene::objects`].
    pub object: u32,
    /// glTF mesh.
    pub mesh: u32,
    /// Index of the primitive within the mesh.
    pub primitive: u32,
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// First triangle and number of triangles.
    pub triangles: [u32; 2],
    /// Triangles that the glTF primitive draws, those that are left out counted.
    pub drawn_triangles: u32,
}

/// A node with geometry.
#[derive(Clone, Debug)]
pub struct Object {
    /// glTF node.
    pub node: u32,
    /// Names from the root down, such as `Room/Table/Leg`; unnamed nodes read `node 7`.
    pub path: String,
    /// The node's global transform (f64: chains of transforms lose nothing).
    pub world_from_node: DMat4,
    /// What `extras.vlm` of the node or its mesh asks for.
    pub steering: Steering,
}

/// `extras.vlm` on a node or mesh, or its defaults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steering {
    /// Multiplies the light's radiosity. Default 1.
    pub intensity: f32,
    /// Multiplies the light's radiosity per channel. Default 1.
    pub tint: Vec3,
    /// A tag chosen by the artist; wins over automatic tags.
    pub tag: Option<u32>,
    /// The object makes no lights (it still blocks and receives).
    pub exclude: bool,
    /// Multiplies the number of lights per area. Default 1.
    pub density: f32,
}

impl Default for Steering {
    fn default() -> Self {
        Self { intensity: 1.0, tint: Vec3::ONE, tag: None, exclude: false, density: 1.0 }
    }
}

impl Steering {
    /// What multiplies each channel of the light: intensity times tint, at most a billion, so that no product leaves single precision.
    #[must_use]
    pub fn strength(&self) -> Vec3 {
        (self.tint * self.intensity).min(Vec3::splat(1e9))
    }
}

/// A mesh that an artist made to be a VLM.
#[derive(Clone, Debug, Default)]
pub struct AuthoredMesh {
    /// Index into [`Scene::objects`].
    pub object: u32,
    /// Whether its triangles become lights, remove lights, or both.
    pub mode: AuthoredMode,
    /// World-space vertices.
    pub positions: Vec<Vec3>,
    /// Triangles, counter-clockwise seen from the emitting side.
    pub triangles: Vec<[u32; 3]>,
    /// Linear albedo per triangle, from its own material (base colour factor x texture x COLOR_0), or `None` without a
    /// material: then the lights take the albedo of the visible surface in front of them.
    pub albedo: Option<Vec<Vec3>>,
    /// Radiosity by its own emission, lx, per triangle.
    pub emission: Vec<Vec3>,
}

/// What an authored VLM does; `extras.vlm.mode` says so.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AuthoredMode {
    /// Its triangles become lights beside the derived ones (`"add"`).
    #[default]
    Add,
    /// Derived lights inside it vanish; its own triangles are no lights (`"subtract"`).
    Subtract,
    /// Derived lights inside it vanish, and its triangles take their place (`"both"`, `"replace"`).
    Both,
}

/// What a surface does with light.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The file's name for it, or `material 3`.
    pub name: String,
    /// Linear base colour factor.
    pub base_color: Vec3,
    /// Index into [`Scene::textures`].
    pub base_color_texture: Option<u32>,
    /// Emitted radiance in cd/m^2 (nt): factor times KHR_materials_emissive_strength.
    pub emission: Vec3,
    /// Index into [`Scene::textures`].
    pub emissive_texture: Option<u32>,
    /// Both sides reflect.
    pub two_sided: bool,
    /// `Some(cutoff)` for alphaMode MASK; compared with `alpha_factor` times the texture's alpha.
    pub alpha_cutoff: Option<f32>,
    /// Base colour factor's alpha.
    pub alpha_factor: f32,
    /// False for alphaMode BLEND and KHR_materials_transmission: the surface makes no lights.
    pub reflects: bool,
}

/// A light of KHR_lights_punctual, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PunctualLight {
    /// Which kind, with its shape.
    pub kind: PunctualKind,
    /// Metres; unused for directional lights.
    pub position: Vec3,
    /// Unit vector in which the light shines; unused for point lights.
    pub direction: Vec3,
    /// Linear colour times intensity: cd for point and spot, lx for directional.
    pub intensity: Vec3,
    /// Beyond this distance (metres) there is no light; infinite where the file gives none.
    pub range: f32,
}

/// The kinds of KHR_lights_punctual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PunctualKind {
    /// Shines along its direction from infinitely far away.
    Directional,
    /// Shines into all directions.
    Point,
    /// Shines into a cone; cosines of the inner and outer half angles.
    Spot {
        /// Cosine of the half angle within which the light is full.
        cos_inner: f32,
        /// Cosine of the half angle beyond which there is none.
        cos_outer: f32,
    },
}

/// A perspective or orthographic camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The node's name, else the camera's, else `camera 0`.
    pub name: String,
    /// Rigid: looks along -z, y up.
    pub world_from_view: DMat4,
    /// Vertical field of view in radians (perspective) or half height in metres (orthographic).
    pub projection: Projection,
}

/// How a camera projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Vertical field of view in radians, 0 to pi.
    Perspective(f32),
    /// Half of the picture's height in metres.
    Orthographic(f32),
}

mod load;
mod node;
mod steering;
mod material;
mod geometry;
mod deform;
mod decode;
pub mod texture;
mod surface;
mod authored;
mod volume;
mod light;
mod camera;
mod defaults;

#[cfg(test)]
mod tests;

pub use authored::Volume;
pub use defaults::look;
pub use load::{Error, LoadOptions, load};
pub use surface::Surface;

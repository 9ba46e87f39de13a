//! scene_buffers: the visible geometry on the device, and the tree over it for shadow rays.

use std::ops::Range;

use glam::{DVec3, Vec3, Vec4};
use vlm_bake::bvh::FlatBvh;
use vlm_bake::scene::Scene;
use wgpu::{BindGroup, Buffer, BufferUsages};

use super::bindings::filled;
use super::error::ViewError;
use super::gpu::Gpu;
use super::materials::material_groups;
use super::open::Opened;
use super::surface::SurfaceStage;

/// As `Vertex` in the shader. 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Vertex {
    pub(super) position_u: Vec4,
    pub(super) normal_v: Vec4,
    pub(super) color_u: Vec4,
    pub(super) v: Vec4,
}

/// Triangles that are drawn at once.
pub(crate) struct Draw {
    pub material: usize,
    pub is_two_sided: bool,
    /// Corners, three to a triangle.
    pub corners: Range<u32>,
}

/// A scene on the device.
pub(crate) struct SceneBuffers {
    pub vertices: Buffer,
    /// Three vertices and the tag of each triangle.
    pub triangles: Buffer,
    pub materials: Vec<BindGroup>,
    /// In the order of the triangles, so that the first of coincident ones shows, as with rays.
    pub draws: Vec<Draw>,
    pub nodes: Buffer,
    pub node_count: u32,
    pub corners: Buffer,
    pub leave_distance: f32,
    /// Least and largest corner, metres.
    pub bounds: [DVec3; 2],
}

impl SceneBuffers {
    pub(crate) fn new(gpu: &Gpu, stage: &SurfaceStage, opened: &Opened) -> Result<Self, ViewError> {
        let Opened { scene, triangle_tags, blockers, .. } = opened;
        let FlatBvh { nodes, corners, leave_distance } = blockers;
        let tag = |triangle: usize| triangle_tags.get(triangle).copied().unwrap_or(0);
        let triangles: Vec<[u32; 4]> =
            scene.triangles.iter().enumerate().map(|(i, &[a, b, c])| [a, b, c, tag(i)]).collect();
        let corners: Vec<Vec4> = corners.iter().flatten().map(|corner| corner.extend(0.0)).collect();
        Ok(Self {
            vertices: filled(gpu, "vertices", &vertices(scene), BufferUsages::STORAGE)?,
            triangles: filled(gpu, "triangles", &triangles, BufferUsages::STORAGE)?,
            materials: material_groups(gpu, stage, scene)?,
            draws: draws(scene),
            nodes: filled(gpu, "nodes", nodes, BufferUsages::STORAGE)?,
            node_count: nodes.len() as u32,
            corners: filled(gpu, "corners", &corners, BufferUsages::STORAGE)?,
            leave_distance: *leave_distance,
            bounds: bounds(&scene.positions),
        })
    }

    /// Metres across.
    pub(crate) fn extent(&self) -> f64 {
        (self.bounds[1] - self.bounds[0]).length().max(f64::MIN_POSITIVE)
    }
}

fn vertices(scene: &Scene) -> Vec<Vertex> {
    let at = |i: usize| {
        let uv = scene.vertex_uvs.get(i).copied().unwrap_or_default();
        let emissive_uv = scene.vertex_emissive_uvs.get(i).copied().unwrap_or_default();
        let color = scene.vertex_colors.get(i).copied().unwrap_or(Vec3::ONE);
        let normal = scene.vertex_normals.get(i).copied().unwrap_or_default();
        let position = scene.positions.get(i).copied().unwrap_or_default();
        Vertex {
            position_u: position.extend(uv.x),
            normal_v: normal.extend(uv.y),
            color_u: color.extend(emissive_uv.x),
            v: Vec4::new(emissive_uv.y, 0.0, 0.0, 0.0),
        }
    };
    (0..scene.positions.len()).map(at).collect()
}

/// Runs of triangles of one material; what is blended or transmissive is not drawn.
fn draws(scene: &Scene) -> Vec<Draw> {
    let mut draws: Vec<Draw> = Vec::new();
    for primitive in &scene.primitives {
        let Some(material) = scene.materials.get(primitive.material as usize) else { continue };
        let [first, count] = primitive.triangles;
        let corners = 3 * first..3 * first.saturating_add(count);
        if !material.reflects || count == 0 {
            continue;
        }
        match draws.last_mut() {
            Some(last)
                if last.material == primitive.material as usize && last.corners.end == corners.start =>
            {
                last.corners.end = corners.end;
            }
            _ => draws.push(Draw {
                material: primitive.material as usize,
                is_two_sided: material.two_sided,
                corners,
            }),
        }
    }
    draws
}

fn bounds(positions: &[Vec3]) -> [DVec3; 2] {
    let (mut least, mut most) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for position in positions {
        least = least.min(*position);
        most = most.max(*position);
    }
    if least.cmple(most).all() { [least.as_dvec3(), most.as_dvec3()] } else { [DVec3::ZERO; 2] }
}

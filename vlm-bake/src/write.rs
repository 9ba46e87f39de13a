//! Stage 12: the finished lights as a [`VlmAsset`], in the spaces of their nodes.

use glam::{DMat3, DMat4, DVec3, Vec3};
use rustc_hash::FxHashMap;
use vlm_format::{Sample, Settings, Vlm, VlmAsset};

use crate::options::BakeOptions;
use crate::samples::BakedLight;
use crate::scene::Scene;
use crate::slivers::MAX_ASPECT;
use crate::tag::Tags;
use crate::topology::aspect_ratio;

/// The tool's name and version as files carry it.
pub const GENERATOR: &str = concat!("vlm-bake ", env!("CARGO_PKG_VERSION"));

/// Puts lights in the order in which an asset holds them: by object, authored ones last within it.
pub fn order(lights: &mut [BakedLight]) {
    lights.sort_by_key(|light| (light.object, light.authored));
}

/// Collects ordered lights and tags into an asset without a grid. Lights of an object whose transform has no inverse are left out.
#[must_use]
pub fn assemble(scene: &Scene, lights: &[BakedLight], tags: &Tags, options: &BakeOptions) -> VlmAsset {
    let (primitive_tags, triangle_tags) = tags.of_primitives(scene);
    let mut asset = VlmAsset {
        generator: GENERATOR.to_owned(),
        settings: settings(options),
        primitive_tags,
        triangle_tags,
        node_tags: tags.nodes.clone(),
        sample_starts: vec![0],
        ..VlmAsset::default()
    };
    let mut ids: FxHashMap<String, u32> = FxHashMap::default();
    for run in lights.chunk_by(|a, b| (a.object, a.authored) == (b.object, b.authored)) {
        append(&mut asset, scene, run, &mut ids);
    }
    if asset.emission.iter().all(|&e| e == Vec3::ZERO) {
        asset.emission.clear();
    }
    if asset.tags.iter().all(|&t| t == 0) {
        asset.tags.clear();
    }
    asset
}

fn settings(options: &BakeOptions) -> Settings {
    Settings {
        preset: options.preset.name().to_owned(),
        lights: options.lights,
        cell_size: options.grid.cell_size.unwrap_or(0.0),
        probes: options.grid.probes,
        rays: options.grid.rays,
        near: options.grid.near,
        samples: options.samples,
    }
}

/// Appends the lights of one object.
fn append(asset: &mut VlmAsset, scene: &Scene, run: &[BakedLight], ids: &mut FxHashMap<String, u32>) {
    let Some(first) = run.first() else { return };
    let object = &scene.objects[first.object as usize];
    let to_node = NodeSpace::new(object.world_from_node);
    let lights = [asset.triangles.len() as u32, run.len() as u32];
    let first_vertex = asset.positions.len() as u32;
    let mut vertex_of: FxHashMap<[u32; 3], u32> = FxHashMap::default();
    for light in run {
        let mut corners = light.corners.map(|p| {
            let p = to_node.point(p);
            *vertex_of.entry(p.to_array().map(f32::to_bits)).or_insert_with(|| {
                asset.positions.push(p);
                asset.positions.len() as u32 - 1
            })
        });
        if to_node.mirrored {
            corners.swap(1, 2);
        }
        asset.triangles.push(corners);
        asset.albedo.push(light.albedo);
        asset.emission.push(light.emission);
        asset.tags.push(light.tag);
        asset.samples.extend(light.samples.iter().map(|s| Sample {
            position: to_node.point(s.position),
            normal: to_node.normal(s.normal),
            reflectance: s.reflectance,
        }));
        asset.sample_starts.push(asset.samples.len() as u32);
    }
    asset.vlms.push(Vlm {
        id: unique(if object.path.is_empty() { "scene" } else { &object.path }, ids),
        node: object.node,
        lights,
        vertices: [first_vertex, asset.positions.len() as u32 - first_vertex],
        authored: first.authored,
    });
}

/// An id that no other VLM of the file has.
fn unique(path: &str, ids: &mut FxHashMap<String, u32>) -> String {
    let uses = ids.entry(path.to_owned()).or_insert(0);
    *uses += 1;
    if *uses == 1 { path.to_owned() } else { unique(&format!("{path}#{uses}"), ids) }
}

/// A light's corners after a round trip through the file: single precision in the node's space. As they are where the transform has no
/// inverse.
#[must_use]
pub fn as_stored(world_from_node: DMat4, corners: [DVec3; 3]) -> [DVec3; 3] {
    if world_from_node.determinant() == 0.0 {
        return corners;
    }
    let to_node = NodeSpace::new(world_from_node);
    corners.map(|p| world_from_node.transform_point3(to_node.point(p).as_dvec3()))
}

/// World space to a node's.
struct NodeSpace {
    node_from_world: DMat4,
    /// Normals go by the transpose of the opposite transform.
    node_from_world_normal: DMat3,
    /// The transform turns triangles round.
    mirrored: bool,
}

impl NodeSpace {
    fn new(world_from_node: DMat4) -> Self {
        Self {
            node_from_world: world_from_node.inverse(),
            node_from_world_normal: DMat3::from_mat4(world_from_node).transpose(),
            mirrored: world_from_node.determinant() < 0.0,
        }
    }

    fn point(&self, p_world: DVec3) -> Vec3 {
        self.node_from_world.transform_point3(p_world).as_vec3()
    }

    fn normal(&self, n_world: DVec3) -> Vec3 {
        (self.node_from_world_normal * n_world).normalize_or_zero().as_vec3()
    }
}

/// True if a light survives the way into the file: its node's transform has an inverse, and in the node's space, in single
/// precision, it is no thinner than a light may be, nor once that is back in the world.
#[must_use]
pub fn placeable(scene: &Scene, light: &BakedLight) -> bool {
    let world_from_node = scene.objects[light.object as usize].world_from_node;
    let to_node = NodeSpace::new(world_from_node);
    let stored = light.corners.map(|p| to_node.point(p));
    world_from_node.determinant() != 0.0
        && stored.iter().all(|p| p.is_finite())
        && [stored.map(|p| p.as_dvec3()), light.corners, as_stored(world_from_node, light.corners)]
            .into_iter()
            .all(|corners| aspect_ratio(corners) <= MAX_ASPECT)
}

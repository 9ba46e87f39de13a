//! A small valid Virtual Light Mesh for any file: what it says about the scene is nonsense, but every array is in use.
//! And a small scene to put it in.

use base64::Engine;
use glam::Vec3;
use serde_json::json;
use vlm_format::{
    GltfFile, Grid, Leaf, Probe, RowWriter, Sample, Settings, TriangleTags, Uncovered, Vlm, VlmAsset,
};

/// Two lights for each of the first two nodes with a mesh, with samples, tags, emission and a grid. The first primitive that
/// draws triangles is tagged as a whole, the second by triangle, the first bearer and the last node as nodes.
pub fn quads(file: &GltfFile) -> VlmAsset {
    many_quads(file, 1)
}

/// [`quads`] with so many times the lights, cells and pieces of uncovered surface.
pub fn many_quads(file: &GltfFile, times: u32) -> VlmAsset {
    let mut asset = VlmAsset {
        generator: String::from("sample 1.0"),
        settings: Settings {
            preset: String::from("draft"),
            lights: 4,
            cell_size: 0.1,
            probes: 2,
            rays: 16,
            near: 1,
            samples: 1,
        },
        sample_starts: vec![0],
        ..VlmAsset::default()
    };
    let bearers = file.document().nodes().filter(|node| node.mesh().is_some()).take(2);
    for node in bearers {
        push_quads(&mut asset, node.index() as u32, times);
    }
    tag_surface(&mut asset, file);
    asset.grid = Some(grid(asset.triangles.len() as u32, asset.samples.len(), times));
    asset
}

/// Two cells of 24 times `times`, one divided, over a probe on surface and one in free space.
fn grid(lights: u32, samples: usize, times: u32) -> Grid {
    let mut rows = RowWriter::default();
    rows.push(0, (0..lights).map(|light| (light, 200)));
    rows.push(0, (0..lights.min(1)).map(|light| (light, 1)));
    (0..lights.min(1)).for_each(|light| rows.push(0, [(light, 100)]));
    let probe = Probe {
        position: Vec3::new(0.01, 0.3, 0.01),
        row_scale: 0.001,
        normal: Vec3::Y,
        reach_up: 0.05,
        tangent: Vec3::X,
        reach_down: 0.05,
        reach: [0.1, 0.2, 0.1, 0.1],
    };
    let roots = 24 * times as usize;
    let mut cells = vec![0; roots + 8];
    (cells[1], cells[roots - 1], cells[roots]) = (1, 48 * times, 3);
    let piece = |i: u32| Uncovered {
        position: Vec3::splat(i as f32),
        normal: Vec3::Y,
        reflectance: Vec3::splat(0.5),
        ..Uncovered::default()
    };
    Grid {
        origin: Vec3::new(-0.1, 0.2, 1e-7),
        cell_size: 0.1,
        dimensions: [2, 3, 4 * times],
        cells,
        leaves: vec![
            Leaf { probes: 0, free_probes: 1 },
            Leaf { probes: 2, free_probes: 3 },
            Leaf { probes: 3, free_probes: 3 },
        ],
        leaf_probes: vec![0, 1, 0],
        near_starts: vec![0, lights.min(1), lights.min(1)],
        near: (0..lights.min(1)).collect(),
        near_form_factors: vec![0.5; lights.min(1) as usize],
        probes: vec![probe, Probe { normal: Vec3::Z, tangent: Vec3::X, ..probe }],
        surface_probes: 1,
        sample_shares: vec![1.0; samples],
        surface_gains: vec![1.0; lights as usize],
        uncovered: (0..times).map(piece).collect(),
        row_starts: rows.starts,
        rows: rows.words,
    }
}

fn tag_surface(asset: &mut VlmAsset, file: &GltfFile) {
    let primitives = file.document().meshes().flat_map(|mesh| {
        let primitives = mesh.primitives().map(|p| p.index() as u32).collect::<Vec<_>>();
        primitives.into_iter().map(move |primitive| (mesh.index() as u32, primitive))
    });
    let mut drawn = primitives.filter_map(|(mesh, primitive)| {
        let count = file.triangle_count(mesh, primitive).filter(|&count| count > 0)?;
        Some((mesh, primitive, count as u32))
    });
    asset.primitive_tags =
        drawn.next().map(|(mesh, primitive, _)| (mesh, primitive, 7)).into_iter().collect();
    let by_triangle = drawn.next().map(|(mesh, primitive, count)| {
        let tags = (0..count).map(|triangle| (triangle + 1) % 3).collect();
        TriangleTags { mesh, primitive, tags }
    });
    asset.triangle_tags = by_triangle.into_iter().collect();
    let last = file.document().nodes().map(|node| node.index() as u32).last();
    asset.node_tags =
        asset.vlms.first().map(|vlm| vlm.node).into_iter().chain(last).map(|n| (n, 90 + n)).collect();
    asset.node_tags.dedup();
}

fn push_quads(asset: &mut VlmAsset, node: u32, count: u32) {
    let (light, vertex) = (asset.triangles.len() as u32, asset.positions.len() as u32);
    let authored = node % 2 == 1;
    asset.vlms.push(Vlm {
        id: format!("vlm-{node}"),
        node,
        lights: [light, 2 * count],
        vertices: [vertex, 4 * count],
        authored,
    });
    (0..count).for_each(|i| push_quad(asset, node, Vec3::Z * i as f32));
}

fn push_quad(asset: &mut VlmAsset, node: u32, corner: Vec3) {
    let (light, vertex) = (asset.triangles.len() as u32, asset.positions.len() as u32);
    asset.positions.extend([Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y].map(|at| corner + at));
    for corners in [[0, 1, 2], [0, 2, 3]] {
        asset.triangles.push(corners.map(|corner| vertex + corner));
        asset.albedo.push(Vec3::new(0.5, 0.25, 1.0 / 3.0));
        asset.emission.push(Vec3::splat(light as f32));
        asset.tags.push(node);
        asset.samples.push(Sample { position: corner + 0.1, normal: Vec3::Z, reflectance: Vec3::ONE });
        asset.sample_starts.push(asset.samples.len() as u32);
    }
}

/// `Room/Table` with a triangle of vertices (0,0,0), (1,0,0), (0,1,0), `Room/Lamp` with
/// the same and a light, and `Spare`, a camera.
///
/// # Panics
/// If the library refuses this valid file.
pub fn room() -> GltfFile {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let bytes: Vec<u8> =
        corners.iter().flat_map(|corner| corner.to_array()).flat_map(f32::to_le_bytes).collect();
    let data = base64::engine::general_purpose::STANDARD.encode(bytes);
    let positions = json!({
        "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0],
    });
    let json = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [
            { "name": "Room", "children": [1, 2] },
            { "name": "Table", "mesh": 0, "translation": [1, 0, 0] },
            { "name": "Lamp", "mesh": 1, "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "name": "Spare", "camera": 0, "extras": { "shelf": [1, 2.5, null] } },
        ],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } }],
        "meshes": [
            { "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] },
            { "primitives": [{ "attributes": { "POSITION": 1 } }] },
        ],
        "materials": [{
            "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1] },
            "emissiveTexture": { "index": 0, "extensions": { "KHR_texture_transform": { "offset": [0.5, 0] } } },
            "alphaMode": "MASK",
            "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 2 } },
        }],
        "textures": [{ "source": 0, "sampler": 0 }],
        "samplers": [{ "wrapS": 33071, "magFilter": 9728 }],
        "images": [{ "uri": "data:image/png;base64,iVBORw0KGgo=" }],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "spot", "spot": { "outerConeAngle": 0.5 } }] } },
        "extensionsUsed": ["KHR_lights_punctual", "KHR_texture_transform", "KHR_materials_emissive_strength"],
        "accessors": [positions, positions],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": format!("data:application/octet-stream;base64,{data}") }],
    });
    match GltfFile::from_slice(json.to_string().as_bytes(), "room.gltf", None) {
        Ok(file) => file,
        // The JSON stands above: no input reaches it.
        Err(error) => panic!("{error}"),
    }
}

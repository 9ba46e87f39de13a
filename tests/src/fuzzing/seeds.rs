//! Small files to start from.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use vlm_format::{Container, GltfFile, Target, WriteOptions, strip_vlm, write_vlm_with};

use crate::cornell;
use crate::glb::{Glb, Mesh};
use crate::sample_asset::{quads, room};

/// Files made in code: name and content.
///
/// # Panics
/// If the library refuses these valid files.
#[must_use]
pub fn of_code() -> Vec<(String, Vec<u8>)> {
    let mut seeds =
        vec![(String::from("cornell"), cornell::all()[0].1.clone()), (String::from("steered"), steered())];
    let file = room();
    let asset = quads(&file);
    for (name, container) in [("glb", Container::Glb), ("gltf", Container::Gltf { embedded: true })] {
        for compress in [false, true] {
            let target = Target { container, file_name: String::from("room.glb") };
            let written = write_vlm_with(&file, &asset, &target, &WriteOptions { compress });
            let mut written = written.unwrap_or_else(|error| panic!("{error}"));
            seeds.push((format!("room_{name}_{compress}"), written.swap_remove(0).bytes));
        }
    }
    seeds
}

/// A box with things in it: two-sided, emissive, masked and blended material, an authored mesh, a volume, a lamp.
fn steered() -> Vec<u8> {
    let mut glb = Glb::new(json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength"],
        "scene": 0,
        "scenes": [{ "nodes": [0, 1, 2, 3, 4, 5, 6] }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }],
        "materials": [
            { "pbrMetallicRoughness": { "baseColorFactor": [0.7, 0.7, 0.7, 1] } },
            { "pbrMetallicRoughness": { "baseColorFactor": [0.6, 0.1, 0.1, 1] }, "doubleSided": true },
            { "emissiveFactor": [1, 1, 0.5], "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 5 } } },
            { "alphaMode": "MASK", "alphaCutoff": 0.3, "pbrMetallicRoughness": { "baseColorFactor": [0.2, 0.6, 0.2, 0.5] } },
            { "alphaMode": "BLEND" },
        ],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 20 }] } },
    }));
    let meshes: [(&str, Mesh, usize); 6] = [
        ("room", cuboid([-2.0; 3], [2.0; 3], true), 0),
        ("sheet", sheet(0.3), 1),
        ("lamp", sheet(1.9), 2),
        ("leaf", sheet(-0.5), 3),
        ("VLM_wall", sheet(-1.9), 0),
        ("block", cuboid([-0.5, -2.0, -0.5], [0.5, -1.0, 0.5], false), 0),
    ];
    let primitives = meshes.iter().map(|(name, mesh, material)| {
        let primitive = glb.primitive(mesh, *material);
        json!({ "name": name, "primitives": [primitive] })
    });
    let mut meshes: Vec<Value> = primitives.collect();
    meshes[3]["extras"] = json!({ "vlm": { "density": 2, "intensity": 1.5, "tint": [1, 0.5, 0.5] } });
    glb.json["meshes"] = json!(meshes);
    let mut nodes: Vec<Value> = (0..6).map(|mesh| json!({ "mesh": mesh })).collect();
    nodes[1]["rotation"] = json!([0.0, 0.0, 0.2, 0.98]);
    nodes[3]["scale"] = json!([-0.5, 1, 1]);
    nodes[5]["extras"] = json!({ "vlm": { "tag": 7 } });
    nodes.push(json!({ "camera": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    glb.json["nodes"] = json!(nodes);
    glb.finish()
}

/// A square of 2 m that faces up.
fn sheet(height: f32) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.push_quad([[-1.0, height, -1.0], [-1.0, height, 1.0], [1.0, height, 1.0], [1.0, height, -1.0]]);
    mesh
}

/// The six sides of a box, seen from inside or outside.
fn cuboid(low: [f32; 3], high: [f32; 3], inward: bool) -> Mesh {
    let mut mesh = Mesh::default();
    let corner =
        |i: usize| std::array::from_fn(|axis| if i >> axis & 1 == 0 { low[axis] } else { high[axis] });
    for sides in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        let mut corners: [[f32; 3]; 4] = sides.map(corner);
        if inward {
            corners.reverse();
        }
        mesh.push_quad(corners);
    }
    mesh
}

/// Those of some files that hold no more than so many bytes, each packed into one file with all its data if it opens.
#[must_use]
pub fn of_files(files: &[PathBuf], most_bytes: usize) -> Vec<(String, Vec<u8>)> {
    let seed = |(number, path): (usize, &PathBuf)| {
        let name = format!("{number}_{}", path.file_name()?.to_string_lossy());
        let bytes = packed(path).or_else(|| std::fs::read(path).ok())?;
        (bytes.len() <= most_bytes).then_some((name, bytes))
    };
    files.iter().enumerate().filter_map(seed).collect()
}

/// The file as a GLB that needs no other; `None` if it does not open, or needs others all the same.
fn packed(path: &Path) -> Option<Vec<u8>> {
    let target = Target { container: Container::Glb, file_name: String::from("seed.glb") };
    let mut outputs = strip_vlm(&GltfFile::open(path).ok()?, &target).ok()?;
    let bytes = outputs.swap_remove(0).bytes;
    GltfFile::from_slice(&bytes, "seed", None).ok().map(|_| bytes)
}

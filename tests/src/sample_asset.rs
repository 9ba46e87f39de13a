//! A small valid Virtual Light Mesh for any file: what it says about the scene is nonsense, but every array is in use.

use glam::Vec3;
use vlm_format::{GltfFile, Grid, Sample, Settings, Vlm, VlmAsset};

/// Two lights for each of the first two nodes with a mesh, with samples, tags, emission and a grid.
pub fn quads(file: &GltfFile) -> VlmAsset {
    let mut asset = VlmAsset {
        generator: String::from("sample 1.0"),
        settings: Settings {
            preset: String::from("draft"),
            lights: 4,
            cell_size: 0.1,
            range: 1.5,
            samples: 1,
        },
        sample_starts: vec![0],
        ..VlmAsset::default()
    };
    let bearers = file.document().nodes().filter(|node| node.mesh().is_some()).take(2);
    for node in bearers {
        push_quad(&mut asset, node.index() as u32);
    }
    let tagged = file.document().meshes().next().filter(|mesh| mesh.primitives().len() > 0);
    asset.primitive_tags = tagged.map(|mesh| (mesh.index() as u32, 0, 7)).into_iter().collect();
    let entries: Vec<u32> = (0..asset.triangles.len() as u32).collect();
    asset.grid = Some(Grid {
        origin: Vec3::new(-0.1, 0.2, 1e-7),
        cell_size: 0.1,
        dimensions: [2, 3, 4],
        cells: vec![1, 23],
        starts: vec![0, 0, entries.len() as u32],
        entries,
    });
    asset
}

fn push_quad(asset: &mut VlmAsset, node: u32) {
    let (light, vertex) = (asset.triangles.len() as u32, asset.positions.len() as u32);
    let authored = node % 2 == 1;
    asset.vlms.push(Vlm {
        id: format!("vlm-{node}"),
        node,
        lights: [light, 2],
        vertices: [vertex, 4],
        authored,
    });
    asset.positions.extend([Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y]);
    for corners in [[0, 1, 2], [0, 2, 3]] {
        asset.triangles.push(corners.map(|corner| vertex + corner));
        asset.albedo.push(Vec3::new(0.5, 0.25, 1.0 / 3.0));
        asset.emission.push(Vec3::splat(light as f32));
        asset.tags.push(node);
        asset.samples.push(Sample { position: Vec3::splat(0.1), normal: Vec3::Z, reflectance: Vec3::ONE });
        asset.sample_starts.push(asset.samples.len() as u32);
    }
}

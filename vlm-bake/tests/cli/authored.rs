//! Light meshes that artists made, and what `extras.vlm` steers.

use glam::Vec3;
use serde_json::{Value, json};
use vlm_format::VlmAsset;

use crate::support::{Document, Folders};

/// A patch of the floor, 1 m wide, 1 cm below it, facing up.
const BELOW_FLOOR: [[f32; 3]; 4] =
    [[-0.5, -2.01, 0.5], [0.5, -2.01, 0.5], [0.5, -2.01, -0.5], [-0.5, -2.01, -0.5]];

/// A box around the floor, closed, its faces outward.
fn box_around_floor() -> [[[f32; 3]; 4]; 6] {
    let (a, b, low, high) = (-2.5, 2.5, -2.5, -1.5);
    [
        [[a, low, a], [b, low, a], [b, low, b], [a, low, b]],
        [[a, high, b], [b, high, b], [b, high, a], [a, high, a]],
        [[b, low, a], [a, low, a], [a, high, a], [b, high, a]],
        [[a, low, b], [b, low, b], [b, high, b], [a, high, b]],
        [[a, low, a], [a, low, b], [a, high, b], [a, high, a]],
        [[b, low, b], [b, low, a], [b, high, a], [b, high, b]],
    ]
}

fn bake(document: &Document) -> VlmAsset {
    Folders::new().bake(document, &["--lights", "200"])
}

fn authored(asset: &VlmAsset) -> usize {
    asset.vlms.iter().filter(|vlm| vlm.authored).map(|vlm| vlm.lights[1] as usize).sum()
}

fn derived(asset: &VlmAsset) -> usize {
    asset.triangles.len() - authored(asset)
}

/// Derived lights whose centre lies at the floor.
fn on_floor(asset: &VlmAsset) -> usize {
    let lights = asset.vlms.iter().filter(|vlm| !vlm.authored).flat_map(|vlm| {
        let [first, count] = vlm.lights.map(|n| n as usize);
        first..first + count
    });
    let height = |light: usize| {
        asset.triangles[light].map(|v| asset.positions[v as usize].y).iter().sum::<f32>() / 3.0
    };
    lights.filter(|&light| height(light) < -1.9).count()
}

#[test]
fn a_name_adds_the_lights_as_modelled() {
    for name in ["VLM_floor", "vlm_floor", "floor-vlm", "Floor-VLM.001"] {
        let mut document = Document::room();
        document.push(name, &[BELOW_FLOOR], None);
        let asset = bake(&document);
        assert_eq!(authored(&asset), 2, "{name}");
        assert!(derived(&asset) > 100 && on_floor(&asset) > 0, "{name}: nothing is taken away");
        let vlm = asset.vlms.iter().find(|vlm| vlm.authored).unwrap();
        assert_eq!(vlm.node, 1);
        let [first, count] = vlm.vertices.map(|n| n as usize);
        let mut vertices: Vec<_> =
            asset.positions[first..first + count].iter().map(|p| p.to_array()).collect();
        let mut modelled = BELOW_FLOOR.to_vec();
        vertices.sort_by(|p, q| p.partial_cmp(q).unwrap());
        modelled.sort_by(|p, q| p.partial_cmp(q).unwrap());
        assert_eq!(vertices, modelled, "{name}");
    }
    let mut document = Document::room();
    document.push("floor", &[BELOW_FLOOR], Some(0));
    assert_eq!(authored(&bake(&document)), 0, "another name is an ordinary mesh");
}

#[test]
fn the_mode_decides_what_is_added_and_taken_away() {
    for (mode, adds, subtracts) in [("add", true, false), ("subtract", false, true), ("both", true, true)] {
        let mut document = Document::room();
        document.push("patch", &box_around_floor(), None)["extras"] = json!({ "vlm": { "mode": mode } });
        let asset = bake(&document);
        assert_eq!(authored(&asset) == 12, adds, "{mode}");
        assert_eq!(on_floor(&asset) == 0, subtracts, "{mode}");
        assert!(derived(&asset) > 50, "{mode}: the other walls keep their lights");
    }
}

fn steered(extras: &Value) -> VlmAsset {
    let mut document = Document::room();
    let quad = [[-0.5, 1.9, -0.5], [0.5, 1.9, -0.5], [0.5, 1.9, 0.5], [-0.5, 1.9, 0.5]];
    document.push("lamp", &[quad], Some(2));
    for node in 0..2 {
        document.json["nodes"][node]["extras"] = json!({ "vlm": extras });
    }
    bake(&document)
}

#[test]
fn tint_and_intensity_change_the_light_and_nothing_else() {
    let plain = steered(&json!({}));
    let colored = steered(&json!({ "intensity": 2, "tint": [1, 0.5, 0.25] }));
    let factor = Vec3::new(2.0, 1.0, 0.5);
    for (a, b) in plain.samples.iter().zip(&colored.samples) {
        assert!(
            b.reflectance.abs_diff_eq(a.reflectance * factor, 1e-6),
            "{} {}",
            a.reflectance,
            b.reflectance
        );
    }
    for (a, b) in plain.emission.iter().zip(&colored.emission) {
        assert!(b.abs_diff_eq(a * factor, 1e-5), "{a} {b}");
    }
    assert!(plain.emission.iter().any(|&e| e != Vec3::ZERO));
    let pieces = |asset: &VlmAsset| asset.grid.as_ref().map_or_else(Vec::new, |grid| grid.uncovered.clone());
    for (a, b) in pieces(&plain).iter().zip(pieces(&colored)) {
        assert!(b.reflectance.abs_diff_eq(a.reflectance * factor, 1e-6) && b.position == a.position);
    }
    let geometry = |asset: &VlmAsset| {
        let samples: Vec<_> = asset.samples.iter().map(|s| (s.position, s.normal)).collect();
        let VlmAsset { vlms, positions, triangles, tags, sample_starts, primitive_tags, mut grid, .. } =
            asset.clone();
        for piece in grid.iter_mut().flat_map(|grid| &mut grid.uncovered) {
            (piece.reflectance, piece.emission) = (Vec3::ZERO, Vec3::ZERO);
        }
        (vlms, positions, triangles, tags, sample_starts, primitive_tags, grid, samples)
    };
    assert!(geometry(&plain) == geometry(&colored), "only colours differ");
}

#[test]
fn excluded_objects_make_no_lights() {
    let mut document = Document::room();
    document.push(
        "table",
        &[[[-0.5, -1.0, 0.5], [0.5, -1.0, 0.5], [0.5, -1.0, -0.5], [-0.5, -1.0, -0.5]]],
        Some(1),
    );
    assert!(bake(&document).vlms.iter().any(|vlm| vlm.node == 1), "the negative control");
    document.json["nodes"][1]["extras"] = json!({ "vlm": { "exclude": true } });
    assert!(bake(&document).vlms.iter().all(|vlm| vlm.node != 1));
}

use super::*;
use crate::scene::{AuthoredMesh, AuthoredMode, Volume};
use glam::{Vec3, vec3};
use std::f32::consts::PI;

/// The visible triangle, and the same mesh on a node that names it a VLM.
fn with_authored(node: &Value) -> Builder {
    let mut builder = Builder::new(&CORNERS);
    builder.json["nodes"] = json!([{ "mesh": 0 }, node]);
    builder.json["scenes"][0]["nodes"] = json!([0, 1]);
    builder
}

#[test]
fn authored_meshes_are_not_visible() {
    let node = json!({
        "name": "Sky-vlm", "mesh": 0, "translation": [0, 0, 3],
        "extras": { "vlm": { "intensity": 2.0, "mode": "both" } },
    });
    let scene = with_authored(&node).load().unwrap();
    assert_eq!((scene.triangles.len(), scene.objects.len(), scene.authored.len()), (1, 2, 1));
    let authored = &scene.authored[0];
    assert_eq!((authored.object, authored.mode, authored.triangles.len()), (1, AuthoredMode::Both, 1));
    assert!(authored.positions.iter().all(|p| p.z == 3.0));
    assert_eq!(authored.albedo, None, "without a material, the surface in front decides");
    assert_eq!(scene.objects[1].steering.intensity, 2.0);
}

#[test]
fn volumes_are_boxes_and_nothing_else() {
    let node = json!({
        "name": "Sky-vlm", "mesh": 0, "translation": [0, 0, 3], "scale": [2, 2, 2],
        "extras": { "vlm": { "volume": true } },
    });
    let scene = with_authored(&node).load().unwrap();
    assert_eq!((scene.triangles.len(), scene.objects.len(), scene.authored.len()), (1, 1, 0));
    let points = CORNERS.map(|p| (Vec3::from(p) * 2.0 + Vec3::Z * 3.0).as_dvec3());
    let low = points.into_iter().reduce(|a, b| a.min(b)).unwrap();
    let high = points.into_iter().reduce(|a, b| a.max(b)).unwrap();
    assert_eq!(scene.volumes, [[low, high]]);
}

#[test]
fn authored_meshes_take_colour_and_emission_from_their_material() {
    let mut builder = with_authored(&json!({ "name": "VLM_sky", "mesh": 0 }));
    builder.material(json!({
        "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.25, 1.0, 1.0] },
        "emissiveFactor": [0.0, 1.0, 0.0],
    }));
    let scene = builder.load().unwrap();
    assert_eq!(scene.authored[0].albedo, Some(vec![vec3(0.5, 0.25, 1.0)]));
    assert_eq!(scene.authored[0].emission, [vec3(0.0, PI, 0.0)]);
    assert_eq!(scene.materials.len(), 2, "the scene keeps its materials");
}

#[test]
fn wrong_settings_are_refused_with_their_pointer() {
    let node = json!({ "mesh": 0, "extras": { "vlm": { "intensity": "bright" } } });
    let error = with_authored(&node).load().unwrap_err();
    let message = error.to_string();
    for part in ["test.glb", "/nodes/1/extras/vlm/intensity", "\"bright\"", "a number of 0 or more"] {
        assert!(message.contains(part), "{part} is missing in: {message}");
    }
}

/// A corner cut off a cube: (0,0,0) and the three unit points.
fn tetrahedron() -> AuthoredMesh {
    AuthoredMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..AuthoredMesh::default()
    }
}

#[test]
fn closed_meshes_contain_their_inside() {
    let volume = Volume::of(&tetrahedron());
    assert!(volume.contains(Vec3::splat(0.2)));
    assert!(!volume.contains(Vec3::splat(0.4)), "in the box, but beyond the slanted face");
    assert!(!volume.contains(Vec3::splat(-0.1)));
}

#[test]
fn open_meshes_contain_their_box() {
    let mut open = tetrahedron();
    open.triangles.pop();
    assert!(Volume::of(&open).contains(Vec3::splat(0.4)));
    assert!(!Volume::of(&open).contains(Vec3::splat(1.1)));
    assert!(!Volume::of(&AuthoredMesh::default()).contains(Vec3::ZERO), "no triangle, no space");
}

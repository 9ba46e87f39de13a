use super::*;
use crate::scene::{Projection, PunctualKind};
use glam::{DVec3, Vec3, vec3};
use std::f32::consts::FRAC_1_SQRT_2;

/// A quarter turn about x: -z becomes -y.
const DOWN: [f32; 4] = [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];

fn with_lights(lights: &Value, nodes: &Value) -> Scene {
    let mut builder = Builder::new(&CORNERS);
    builder.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    builder.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
    builder.json["nodes"] = nodes.clone();
    let count = builder.json["nodes"].as_array().unwrap().len();
    builder.json["scenes"][0]["nodes"] = (0..count).collect();
    builder.load().unwrap()
}

fn light_node(light: usize, properties: Value) -> Value {
    let mut node = properties;
    node["extensions"] = json!({ "KHR_lights_punctual": { "light": light } });
    node
}

#[test]
fn lights_shine_along_their_nodes_minus_z() {
    let lights = json!([
        { "type": "directional", "intensity": 3.0, "color": [1.0, 0.5, 0.0] },
        { "type": "spot", "intensity": 10.0, "range": 4.0, "spot": { "innerConeAngle": 0.0, "outerConeAngle": 1.0 } },
        { "type": "point", "intensity": 0.0 },
    ]);
    let scaled = json!({ "rotation": DOWN, "scale": [2.0, 2.0, -3.0], "translation": [1.0, 2.0, 3.0] });
    let nodes = json!([
        { "mesh": 0 },
        light_node(0, json!({ "rotation": DOWN })),
        light_node(1, scaled),
        light_node(2, json!({})),
    ]);
    let scene = with_lights(&lights, &nodes);
    let [sun, spot] = [scene.lights[0], scene.lights[1]];
    assert_eq!(scene.lights.len(), 2, "black lights are left out");

    assert_eq!(sun.kind, PunctualKind::Directional);
    assert!(sun.direction.abs_diff_eq(Vec3::NEG_Y, 1e-6));
    assert_eq!((sun.intensity, sun.range), (vec3(3.0, 1.5, 0.0), f32::INFINITY));

    assert_eq!(spot.kind, PunctualKind::Spot { cos_inner: 1.0, cos_outer: 1.0_f32.cos() });
    assert!(spot.direction.abs_diff_eq(Vec3::Y, 1e-6), "mirroring z turns the light around");
    assert_eq!((spot.position, spot.range), (vec3(1.0, 2.0, 3.0), 4.0));
    assert_eq!(spot.intensity, Vec3::splat(10.0), "scale does not change it");
}

#[test]
fn cameras_are_rigid_whatever_their_nodes_scale() {
    let mut builder = Builder::new(&CORNERS);
    builder.json["cameras"] = json!([
        { "type": "orthographic", "orthographic": { "xmag": 3.0, "ymag": 2.0, "znear": 0.1, "zfar": 10.0 } },
        { "type": "perspective", "name": "eye", "perspective": { "yfov": 0.8, "znear": 0.1 } },
    ]);
    builder.json["nodes"] = json!([
        { "mesh": 0 },
        { "camera": 0, "rotation": DOWN, "scale": [-2.0, 5.0, 0.5], "translation": [0.0, 7.0, 0.0] },
        { "camera": 1 },
    ]);
    builder.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    let scene = builder.load().unwrap();

    let top = &scene.cameras[0];
    assert_eq!((top.name.as_str(), top.projection), ("camera 0", Projection::Orthographic(2.0)));
    assert!((top.world_from_view.determinant() - 1.0).abs() < 1e-6, "no scale, no mirror");
    let looks = top.world_from_view.transform_vector3(DVec3::NEG_Z);
    assert!(looks.abs_diff_eq(DVec3::NEG_Y, 1e-6), "{looks}");
    assert!(top.world_from_view.transform_point3(DVec3::ZERO).abs_diff_eq(7.0 * DVec3::Y, 1e-6));
    assert_eq!(
        (scene.cameras[1].name.as_str(), scene.cameras[1].projection),
        ("eye", Projection::Perspective(0.8))
    );
}

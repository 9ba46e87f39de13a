use super::*;
use crate::scene::{Projection, PunctualKind};
use glam::{DVec3, Vec3};

/// A box from -1 to 1 whose walls are seen from inside, without those whose number is in `open` (-x, +x, -y, +y, -z, +z).
fn box_seen_from_inside(open: &[usize]) -> Scene {
    let mut corners = Vec::new();
    for wall in (0..6).filter(|wall| !open.contains(wall)) {
        let (axis, side) = (wall / 2, if wall % 2 == 0 { -1.0 } else { 1.0 });
        let corner = |s: f32, t: f32| {
            let mut p = [0.0; 3];
            p[axis] = side;
            p[(axis + 1) % 3] = s;
            p[(axis + 2) % 3] = t * -side;
            p
        };
        let quad = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        corners.extend([0, 1, 2, 0, 2, 3].map(|i| quad[i]));
    }
    Builder::new(&corners).load().unwrap()
}

fn eye_and_sight(scene: &Scene) -> (DVec3, DVec3) {
    let camera = &scene.cameras_or_default()[0];
    assert!(matches!(camera.projection, Projection::Perspective(_)));
    assert!((camera.world_from_view.determinant() - 1.0).abs() < 1e-6);
    (camera.world_from_view.w_axis.truncate(), camera.world_from_view.transform_vector3(DVec3::NEG_Z))
}

#[test]
fn rooms_are_shown_from_inside_by_a_lamp() {
    let room = box_seen_from_inside(&[]);
    assert!(eye_and_sight(&room).0.abs().max_element() < 1.0);
    let lamp = room.lights_or_default()[0];
    assert_eq!(lamp.kind, PunctualKind::Point);
    assert!(lamp.position.abs().max_element() < 1.0);
}

#[test]
fn open_boxes_are_looked_into() {
    let (eye, sight) = eye_and_sight(&box_seen_from_inside(&[1]));
    assert!(eye.x > 2.0 && sight.x < -0.9, "eye {eye}, sight {sight}");
    let sun = box_seen_from_inside(&[1]).lights_or_default()[0];
    assert!(sun.direction.x < -0.3 && sun.direction.y < 0.0, "it shines in: {}", sun.direction);
}

#[test]
fn objects_are_shown_from_outside_and_whole() {
    // Open above: the walls' backs are toward the viewer, but the look into it is from above.
    let yard = box_seen_from_inside(&[3]);
    let (eye, _) = eye_and_sight(&yard);
    assert!(eye.y > 1.0 && eye.z > 1.0, "{eye}");
    let view_from_world = yard.cameras_or_default()[0].world_from_view.inverse();
    for &p in &yard.positions {
        let p_view = view_from_world.transform_point3(p.as_dvec3());
        assert!(
            p_view.truncate().abs().max_element() < -p_view.z * (0.35_f64).tan(),
            "{p} is out of the picture"
        );
    }
    assert_eq!(yard.lights_or_default()[0].kind, PunctualKind::Directional);
}

#[test]
fn what_the_file_has_is_left_alone() {
    let mut builder = Builder::new(&CORNERS);
    builder.json["cameras"] =
        json!([{ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 } }]);
    builder.node()["camera"] = json!(0);
    builder.material(json!({ "emissiveFactor": [1.0, 1.0, 1.0] }));
    let mut scene = builder.load().unwrap();
    assert!(scene.lights_or_default().is_empty(), "a glowing surface is light enough");
    assert_eq!(scene.cameras_or_default()[0].name, "camera 0");
    assert!(scene.add_defaults_for_view().is_empty());
}

#[test]
fn defaults_are_told() {
    let mut scene = box_seen_from_inside(&[]);
    let notes = scene.add_defaults_for_view();
    assert_eq!((notes.len(), scene.lights.len(), scene.cameras.len()), (2, 1, 1));
    assert!(scene.lights[0].intensity.cmpgt(Vec3::ZERO).all());
}

//! Which surfaces rays see, pass and stop at.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::Vec3;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::progress::Silent;
use vlm_bake::reference::indirect_irradiance;
use vlm_bake::scene::{Camera, Material, PunctualKind, PunctualLight, Scene};
use vlm_bake::shade::TraceScene;
use vlm_tests::scenes::{add, camera_facing, glowing, matte, point_light, quad};

/// A white floor, 2 m square around the origin, with `over` half a metre above it, facing down.
fn floor_under(over: Option<Material>) -> Scene {
    let mut scene = Scene::default();
    add(
        &mut scene,
        &quad(Vec3::new(-1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0, 1),
        matte(Vec3::splat(0.5)),
    );
    if let Some(material) = over {
        let corner = Vec3::new(-1.0, 0.5, -1.0);
        add(&mut scene, &quad(corner, Vec3::X * 2.0, Vec3::Z * 2.0, 1), material);
    }
    scene.lights.push(point_light(Vec3::new(0.0, 2.0, 0.0), 4.0));
    scene
}

/// The middle of the floor, or whatever is above it, seen from above.
fn camera() -> Camera {
    camera_facing(Vec3::ZERO, Vec3::Y, 0.01, 3.0)
}

fn seen(trace: &TraceScene) -> GBuffer {
    GBuffer::trace(trace, &camera(), 1, 1)
}

fn direct_below(material: Material) -> f32 {
    let scene = floor_under(Some(material));
    let trace = TraceScene::new(&scene);
    assert_eq!(scene.triangle_primitive[seen(&trace).points[0].unwrap().triangle as usize], 0);
    seen(&trace).direct_irradiance(&trace)[0].x
}

#[test]
fn backs_let_the_camera_through_and_block_light() {
    let scene = floor_under(None);
    let trace = TraceScene::new(&scene);
    assert!((seen(&trace).direct_irradiance(&trace)[0].x - 1.0).abs() < 1e-4, "4 cd at 2 m");
    assert_eq!(direct_below(matte(Vec3::ONE)), 0.0, "its back blocks the light");
}

#[test]
fn blended_surfaces_let_everything_through() {
    let glass = Material { reflects: false, two_sided: true, ..matte(Vec3::ONE) };
    assert!((direct_below(glass) - 1.0).abs() < 1e-4);
}

#[test]
fn two_sided_surfaces_are_seen_from_both_sides() {
    let scene = floor_under(Some(Material { two_sided: true, ..matte(Vec3::ONE) }));
    let trace = TraceScene::new(&scene);
    let gbuffer = seen(&trace);
    let point = gbuffer.points[0].unwrap();
    assert_eq!((point.position.y, point.normal, point.geometric_normal), (0.5, Vec3::Y, Vec3::Y));
    assert!((gbuffer.direct_irradiance(&trace)[0].x - 4.0 / 2.25).abs() < 1e-4);
}

/// The floor's indirect irradiance below a glowing plate of which it sees the back or, if `two_sided`, a side.
fn glow_below(two_sided: bool, facing_down: bool) -> f32 {
    let mut scene = floor_under(None);
    scene.lights.clear();
    let (u, v) = if facing_down { (Vec3::X, Vec3::Z) } else { (Vec3::Z, Vec3::X) };
    let plate = quad(Vec3::new(-1.0, 0.5, -1.0), u * 2.0, v * 2.0, 1);
    add(&mut scene, &plate, Material { two_sided, ..glowing() });
    let trace = TraceScene::new(&scene);
    let from_below = camera_facing(Vec3::ZERO, Vec3::Y, 0.01, 0.2);
    let gbuffer = GBuffer::trace(&trace, &from_below, 1, 1);
    indirect_irradiance(&trace, &gbuffer.points, 1, 256, &Silent)[0].x
}

#[test]
fn backs_of_single_sided_surfaces_are_black() {
    let front = glow_below(false, true);
    assert!(front > 0.5, "{front}");
    assert_eq!(glow_below(false, false), 0.0);
    assert!((glow_below(true, false) - front).abs() < 0.01);
}

#[test]
fn alpha_masks_count_as_solid_unless_asked_for() {
    let veil = Material { alpha_cutoff: Some(0.5), alpha_factor: 0.2, ..matte(Vec3::ONE) };
    let solid = Material { alpha_factor: 0.8, ..veil.clone() };
    assert_eq!(direct_below(veil.clone()), 0.0);
    for (material, expected) in [(veil, 1.0), (solid, 0.0)] {
        let scene = floor_under(Some(material));
        let trace = TraceScene::new(&scene).with_alpha_masks();
        assert!((seen(&trace).direct_irradiance(&trace)[0].x - expected).abs() < 1e-4);
    }
}

#[test]
fn spots_and_suns_shine_where_they_point() {
    let mut scene = floor_under(None);
    let base = scene.lights[0];
    let spot = |direction: Vec3| PunctualLight {
        kind: PunctualKind::Spot { cos_inner: 0.95, cos_outer: 0.9 },
        direction,
        ..base
    };
    let mut lit = |light: PunctualLight| {
        scene.lights = vec![light];
        let trace = TraceScene::new(&scene);
        seen(&trace).direct_irradiance(&trace)[0].x
    };
    assert!((lit(spot(-Vec3::Y)) - 1.0).abs() < 1e-4);
    assert_eq!(lit(spot(Vec3::X)), 0.0);
    let sun = |direction: Vec3| PunctualLight { kind: PunctualKind::Directional, direction, ..base };
    assert!((lit(sun(-Vec3::Y)) - 4.0).abs() < 1e-4);
    assert_eq!(lit(sun(Vec3::Y)), 0.0);
}

#[test]
fn pictures_do_not_depend_on_the_number_of_threads() {
    let scene = floor_under(Some(glowing()));
    let from_below = camera_facing(Vec3::ZERO, Vec3::Y, 0.5, 0.2);
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let trace = TraceScene::new(&scene);
            let gbuffer = GBuffer::trace(&trace, &from_below, 16, 16);
            indirect_irradiance(&trace, &gbuffer.points, 16, 64, &Silent)
        })
    };
    let one = with_threads(1);
    assert!(one.iter().any(|e| e.x > 0.1));
    assert_eq!(one, with_threads(3));
}

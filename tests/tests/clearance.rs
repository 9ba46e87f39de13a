//! `verify_asset`, which the baker and `vlm check --geometry` use, against the checker of hard meshes, which shares no code with it: they
//! agree on fresh bakes and on what is planted.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::BTreeSet;

use glam::DVec3;
use vlm_bake::bake::bake;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::scene::Scene;
use vlm_bake::verify::{FindingKind, Verification, verify_asset};
use vlm_format::VlmAsset;
use vlm_tests::hard_meshes::checker::{Kind, check, world_lights};
use vlm_tests::hard_meshes::{HardMesh, sheets, solids};

fn baked(mesh: &HardMesh, lights: u32) -> (Scene, VlmAsset) {
    let scene = mesh.scene().unwrap();
    let options = BakeOptions { lights, ..BakeOptions::preset(Preset::Game, scene.triangles.len()) };
    let asset = bake(&scene, &options, &Silent).unwrap().asset;
    (scene, asset)
}

/// The first light of a large side: seen from it, the plate's thickness is the way to the back.
fn first_of_a_large_side(scene: &Scene, asset: &VlmAsset) -> usize {
    world_lights(scene, asset).iter().position(|light| light.normal.z > 0.9).unwrap()
}

fn normal(scene: &Scene, asset: &VlmAsset, light: usize) -> DVec3 {
    world_lights(scene, asset)[light].normal
}

/// Moves the corners of a light, which get vertices of their own: behind those of the VLM, which must be the only one.
fn move_light(asset: &mut VlmAsset, light: usize, place: impl Fn(DVec3) -> DVec3) {
    assert_eq!(asset.vlms.len(), 1);
    for corner in 0..3 {
        let moved = place(asset.positions[asset.triangles[light][corner] as usize].as_dvec3());
        asset.triangles[light][corner] = asset.positions.len() as u32;
        asset.positions.push(moved.as_vec3());
        asset.vlms[0].vertices[1] += 1;
    }
}

/// Lights with a fault that no tag mends, by `verify_asset`.
fn failing(verification: &Verification) -> BTreeSet<u32> {
    verification.findings.iter().filter(|f| !f.tagged).map(|f| f.light).collect()
}

/// The same by the checker. Flux is no light's, and [`Kind::LightsItsTriangle`] is a stricter rule than `verify_asset`'s.
fn failing_by_checker(scene: &Scene, asset: &VlmAsset) -> BTreeSet<u32> {
    let faults = check(scene, asset).faults;
    let own = |kind| !matches!(kind, Kind::Flux | Kind::LightsItsTriangle);
    faults.iter().filter(|f| own(f.kind)).map(|f| f.light).collect()
}

/// Plants a fault in the bake of a closed plate 2 m x 2 m and of that thickness: both must find it, in that light alone, and
/// `verify_asset` must call it so.
fn plant(what: &str, thickness: f64, kind: FindingKind, spoil: impl Fn(&Scene, &mut VlmAsset, usize)) {
    let (scene, mut asset) = baked(&solids::closed_plate(thickness), 400);
    assert_eq!(failing(&verify_asset(&scene, &asset)), BTreeSet::new(), "{what}: before");
    assert_eq!(failing_by_checker(&scene, &asset), BTreeSet::new(), "{what}: before");
    let light = first_of_a_large_side(&scene, &asset);
    spoil(&scene, &mut asset, light);
    let verification = verify_asset(&scene, &asset);
    assert_eq!(failing(&verification), BTreeSet::from([light as u32]), "{what}");
    assert_eq!(failing_by_checker(&scene, &asset), BTreeSet::from([light as u32]), "{what}");
    let finding = verification.findings.iter().find(|f| !f.tagged).unwrap();
    assert_eq!((finding.kind, finding.object.as_str()), (kind, "mesh"), "{what}");
}

#[test]
fn a_light_pushed_forward_by_a_hundredth_of_the_scene() {
    plant("forward", 0.2, FindingKind::PokesOut, |scene, asset, light| {
        let forward = 0.01 * 2.0 * normal(scene, asset, light);
        move_light(asset, light, |p| p + forward);
    });
}

#[test]
fn a_light_pushed_through_the_back() {
    plant("through", 0.02, FindingKind::PokesOut, |scene, asset, light| {
        let back = 0.021 * normal(scene, asset, light);
        move_light(asset, light, |p| p - back);
    });
}

/// So far that every point of its surface has a nearer light: its samples still say what it stands for.
#[test]
fn a_light_pushed_far_through_the_back() {
    plant("far through", 0.2, FindingKind::PokesOut, |scene, asset, light| {
        let back = 0.5 * normal(scene, asset, light);
        move_light(asset, light, |p| p - back);
    });
}

#[test]
fn a_light_that_faces_its_surface() {
    plant("facing", 0.2, FindingKind::LightsItself, |scene, asset, light| {
        let forward = 0.01 * 2.0 * normal(scene, asset, light);
        move_light(asset, light, |p| p + forward);
        asset.triangles[light].swap(1, 2);
    });
}

#[test]
fn a_needle() {
    plant("needle", 0.2, FindingKind::TooThin, |_, asset, light| {
        let [a, b, c] = asset.triangles[light].map(|v| asset.positions[v as usize].as_dvec3());
        let foot = a + (b - a) * (c - a).dot(b - a) / (b - a).length_squared();
        move_light(asset, light, |p| if p == c { foot + (c - foot) * 1e-4 } else { p });
    });
}

#[test]
fn a_tag_removed() {
    let (scene, mut asset) = baked(&sheets::two_sided_quad(), 50);
    let before = verify_asset(&scene, &asset);
    assert_eq!(failing(&before), BTreeSet::new());
    assert!(before.findings.iter().any(|f| f.light == 7 && f.tagged), "no place behind hides it");
    asset.tags[7] = 0;
    assert_eq!(failing(&verify_asset(&scene, &asset)), BTreeSet::from([7]));
    assert_eq!(failing_by_checker(&scene, &asset), BTreeSet::from([7]));
}

#[test]
fn the_points_are_as_many_as_promised_and_lie_on_the_surface() {
    let (scene, asset) = baked(&solids::closed_plate(0.2), 400);
    let verification = verify_asset(&scene, &asset);
    let spread = verification.points.iter().filter(|p| p.area > 0.0).count();
    assert!(spread >= 200_000.min(20 * asset.triangles.len()), "{spread}");
    assert_eq!(verification.points.len(), verification.light_of_point.len());
    let area: f64 = verification.points.iter().map(|p| p.area).sum();
    assert!((area / (2.0 * 2.0 * 2.0 + 4.0 * 2.0 * 0.2) - 1.0).abs() < 0.01, "{area}");
    for corner in scene.triangles.iter().flatten().map(|&v| scene.positions[v as usize].as_dvec3()) {
        assert!(verification.points.iter().any(|p| p.position.distance(corner) < 1e-6), "{corner}");
    }
    for point in &verification.points {
        let [a, b, c] = verification.patches.triangles[point.triangle as usize]
            .map(|v| verification.patches.positions[v as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        assert!((point.position - a).dot(normal).abs() < 1e-6 && point.normal.dot(normal).abs() > 0.999);
    }
}

#[test]
fn self_light_is_dark_and_shows_a_light_that_faces_its_surface() {
    let (scene, mut asset) = baked(&solids::closed_plate(0.2), 400);
    let dark = verify_asset(&scene, &asset).self_light;
    assert!(dark.p999 < 1e-4 && dark.max < 1e-3, "{} {}", dark.p999, dark.max);
    let light = first_of_a_large_side(&scene, &asset);
    let forward = 0.01 * 2.0 * normal(&scene, &asset, light);
    move_light(&mut asset, light, |p| p + forward);
    asset.triangles[light].swap(1, 2);
    assert!(verify_asset(&scene, &asset).self_light.max > 1e-2, "the negative control");
}

//! Every method that gathers lights ignores those of the receiver's tag: by triangle, by primitive, by node.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::Vec3;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::progress::Silent;
use vlm_bake::render::{Method, RenderOptions, render, triangle_tags};
use vlm_bake::scene::{Camera, Scene};
use vlm_bake::shade::TraceScene;
use vlm_format::{TriangleTags, VlmAsset};
use vlm_tests::scenes::{add, camera_facing, exact_lights, glowing, matte, quad};
use vlm_tests::thesis::{self, ThesisOptions};

const SIZE: u32 = 24;

/// The tag of every light.
const TAG: u32 = 7;

/// Two black floors side by side, nodes 0 and 1 with one mesh of one primitive, under a glowing ceiling; scene triangles 0 and
/// 1 are the left floor, 2 and 3 the right one.
fn floors() -> (Scene, Camera) {
    let mut scene = Scene::default();
    for x in [-1.0, 0.0] {
        add(&mut scene, &quad(Vec3::new(x, 0.0, 0.5), Vec3::X, -Vec3::Z, 1), matte(Vec3::ZERO));
    }
    scene.primitives[1].mesh = 0;
    add(&mut scene, &quad(Vec3::new(-1.0, 1.0, -0.5), 2.0 * Vec3::X, Vec3::Z, 1), glowing());
    (scene, camera_facing(Vec3::ZERO, Vec3::Y, 0.45, 0.5))
}

/// All lights tagged, no surface yet.
fn lights(scene: &Scene) -> VlmAsset {
    let mut asset = exact_lights(scene);
    asset.tags = vec![TAG; asset.triangles.len()];
    asset
}

fn by_triangle(tags: &[u32]) -> Vec<TriangleTags> {
    vec![TriangleTags { mesh: 0, primitive: 0, tags: tags.to_vec() }]
}

/// The scene's triangles on which some pixel is lit. Every pixel is either black or as it is without tags.
fn lit(scene: &Scene, camera: &Camera, asset: &VlmAsset) -> Vec<u32> {
    let trace = TraceScene::new(scene);
    let gbuffer = GBuffer::trace(&trace, camera, SIZE, SIZE);
    let untagged = lights(scene);
    let mut found: Option<Vec<u32>> = None;
    for (method, (picture, full)) in
        pictures(scene, camera, asset).into_iter().zip(pictures(scene, camera, &untagged)).enumerate()
    {
        let mut seen = Vec::new();
        for ((point, e), full) in gbuffer.points.iter().zip(picture).zip(full) {
            let triangle = point.unwrap().triangle;
            assert!(full.x > 0.1 && (e == full || e == Vec3::ZERO), "method {method}: {e} of {full}");
            if e == full {
                seen.push(triangle);
            }
        }
        seen.sort_unstable();
        seen.dedup();
        assert!(found.is_none() || found.as_ref() == Some(&seen), "method {method} differs: {seen:?}");
        found = Some(seen);
    }
    found.unwrap()
}

/// By every light, by the grid, and by the thesis' method.
fn pictures(scene: &Scene, camera: &Camera, asset: &VlmAsset) -> Vec<Vec<Vec3>> {
    let by = |method| {
        let options = RenderOptions { width: SIZE, height: SIZE, method, ..RenderOptions::default() };
        render(scene, Some(asset), camera, &options, &Silent).unwrap().indirect
    };
    let unlimited = ThesisOptions { range: 1e4, list: asset.triangles.len() as u32, grid: 1 };
    let (by_thesis, _) = thesis::render(scene, asset, camera, (SIZE, SIZE), &unlimited, &Silent).unwrap();
    vec![by(Method::Brute), by(Method::Vlm), by_thesis.indirect]
}

#[test]
fn triangles_ignore_lights_of_their_own_tag_only() {
    let (scene, camera) = floors();
    let asset = |tags: &[u32]| VlmAsset { triangle_tags: by_triangle(tags), ..lights(&scene) };
    assert_eq!(lit(&scene, &camera, &asset(&[TAG, 0])), [1, 3], "both nodes draw the primitive");
    assert_eq!(lit(&scene, &camera, &asset(&[TAG + 1, TAG])), [0, 2]);
    assert_eq!(lit(&scene, &camera, &asset(&[TAG, TAG])), [0; 0]);
    assert_eq!(lit(&scene, &camera, &asset(&[TAG + 1, 0])), [0, 1, 2, 3]);
}

#[test]
fn a_nodes_tag_wins_for_that_node_only() {
    let (scene, camera) = floors();
    let asset = VlmAsset { node_tags: vec![(1, TAG)], ..lights(&scene) };
    assert_eq!(lit(&scene, &camera, &asset), [0, 1]);
    let other =
        VlmAsset { node_tags: vec![(1, TAG + 1)], primitive_tags: vec![(0, 0, TAG)], ..asset.clone() };
    assert_eq!(lit(&scene, &camera, &other), [2, 3]);
    let mixed = VlmAsset { triangle_tags: by_triangle(&[0, TAG]), node_tags: vec![(0, TAG)], ..asset };
    assert_eq!(lit(&scene, &camera, &mixed), [2]);
}

#[test]
fn triangles_that_the_scene_left_out_have_tags_all_the_same() {
    let (mut scene, camera) = floors();
    // As if the first and third of the left node's four triangles had no area.
    scene.triangle_in_primitive[..2].copy_from_slice(&[1, 3]);
    let asset = VlmAsset { triangle_tags: by_triangle(&[0, TAG, 0, 0]), ..lights(&scene) };
    assert_eq!(triangle_tags(&scene, &asset), [TAG, 0, 0, TAG, 0, 0]);
    assert_eq!(lit(&scene, &camera, &asset), [1, 2]);
}

//! The Cornell box, baked and rendered by every method, against the path-traced truth.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;

use glam::Vec3;
use vlm_bake::bake::bake;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::render::{Method, RenderOptions, Rendering, render};
use vlm_bake::scene::{Camera, LoadOptions, Scene, load};
use vlm_format::{GltfFile, VlmAsset};
use vlm_tests::metrics::{Comparison, Metrics, compare};
use vlm_tests::thesis::{self, ThesisOptions};

const SIZE: u32 = 128;

fn cornell() -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
    load(&GltfFile::open(&path).unwrap(), &LoadOptions::default()).unwrap()
}

fn lights(scene: &Scene, lights: u32) -> VlmAsset {
    let options = BakeOptions { lights, ..BakeOptions::preset(Preset::Game, scene.triangles.len()) };
    bake(scene, &options, &Silent).unwrap().asset
}

fn by(method: Method, scene: &Scene, asset: Option<&VlmAsset>) -> Rendering {
    let options =
        RenderOptions { width: SIZE, height: SIZE, method, samples: 256, ..RenderOptions::default() };
    render(scene, asset, &scene.cameras[0], &options, &Silent).unwrap()
}

fn by_thesis(scene: &Scene, asset: &VlmAsset, range: f32) -> Rendering {
    let options = ThesisOptions { range, list: 2048, grid: 32 };
    let camera: &Camera = &scene.cameras[0];
    let (rendering, grid) = thesis::render(scene, asset, camera, (SIZE, SIZE), &options, &Silent).unwrap();
    assert_eq!(grid.overflow.dropped, 0);
    rendering
}

fn measure(image: &Rendering, truth: &Rendering) -> Metrics {
    let hit: Vec<bool> = truth.gbuffer.points.iter().map(Option::is_some).collect();
    let (image, truth): (&[Vec3], &[Vec3]) = (&image.indirect, &truth.indirect);
    compare(&Comparison { width: SIZE as usize, image, truth, hit: &hit }).unwrap()
}

#[test]
fn every_light_errs_by_the_missing_occlusion_alone() {
    let scene = cornell();
    let truth = by(Method::Reference, &scene, None);
    let asset = lights(&scene, 464);
    let brute = measure(&by(Method::Brute, &scene, Some(&asset)), &truth);
    println!("brute, {} lights: {brute:?}", asset.triangles.len());
    assert!((0.15..0.25).contains(&brute.relative_rmse), "{brute:?}");
    assert!((0.05..0.2).contains(&brute.signed_energy), "{brute:?}");
}

#[test]
fn the_thesis_loses_the_far_field_unless_its_range_covers_the_room() {
    let scene = cornell();
    let asset = lights(&scene, 464);
    let brute = by(Method::Brute, &scene, Some(&asset));
    let mut energies = Vec::new();
    for range in [1.5, 4.5, 8.0, 16.0, 1000.0] {
        let rendering = by_thesis(&scene, &asset, range);
        let metrics = measure(&rendering, &brute);
        let pixels = rendering.gbuffer.points.iter().flatten().count() as u64;
        println!(
            "thesis, range {range}: {} lights a point, {metrics:?}",
            rendering.stats.pairs_evaluated / pixels
        );
        energies.push(metrics.signed_energy);
    }
    assert!(energies.is_sorted(), "{energies:?}");
    assert!(energies[0] < -0.7 && energies[4].abs() < 1e-3, "{energies:?}");
}

//! A frame of `vlm-runtime`, with shadows by rays, is that of `vlm render --method vlm`.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::PathBuf;

use glam::Vec3;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::options::Preset;
use vlm_bake::progress::Silent;
use vlm_bake::render::{gather_by_grid, triangle_tags};
use vlm_bake::shade::TraceScene;
use vlm_format::GltfFile;
use vlm_runtime::{Frame, FrameStats, IrradianceFormat, PunctualLight, Settings, Visibility, VlmAsset};
use vlm_tests::assets;
use vlm_tests::baked::Baked;
use vlm_tests::runtime_gpu::{Host, view, visibility};

/// Of a pixel's irradiance, over the frame's mean.
const BOUND: f32 = 1e-3;
/// The share of pixels that keep it; the rest lie on silhouettes.
const SHARE: f32 = 0.99;
/// What halves add, over the pixel's own irradiance: devices may cut the bits below the eleventh.
const HALF_STEP: f32 = 1.0 / 1024.0;

fn baked_cornell() -> Baked {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
    Baked::open(&path, Preset::Game).unwrap()
}

/// The share of pixels within [`BOUND`] of the mirror's, with the real lights this much brighter, and what the frame took.
fn share_within(
    baked: &Baked,
    camera: usize,
    size: [u32; 2],
    (format, brighter): (IrradianceFormat, f32),
) -> (f32, FrameStats) {
    let Baked { scene, asset, .. } = baked;
    let trace = TraceScene::new(scene);
    let camera = &scene.cameras_or_default()[camera];
    let gbuffer = GBuffer::trace(&trace, camera, size[0], size[1]);
    let (expected, stats) = gather_by_grid(&trace, asset.data(), &gbuffer, &Silent).unwrap();
    let mean = expected.iter().map(|e| e.element_sum() / 3.0).sum::<f32>() / expected.len() as f32;
    assert!(mean > 0.0);

    let settings = Settings { count_pairs: true, format, ..Settings::default() };
    let mut host = Host::new(asset, settings).unwrap();
    let tags = triangle_tags(scene, asset.data());
    let pictures = host.upload(&gbuffer, camera, |triangle| tags[triangle as usize]);
    let seen = visibility(&trace, host.renderer.points().unwrap());
    let brighten = |l: &PunctualLight| PunctualLight { intensity: l.intensity * brighter, ..*l };
    let lights: Vec<PunctualLight> = trace.lights.iter().map(brighten).collect();
    let frame = Frame {
        lights: &lights,
        visibility: Visibility::Given(&seen),
        view: view(camera, &gbuffer, 1.0 / mean),
        ..Frame::default()
    };
    let (found, took) = host.frame(&frame, &pictures).unwrap();
    let step = if format == IrradianceFormat::Half { HALF_STEP } else { 0.0 };
    let error = |(a, b): (&Vec3, &Vec3)| ((*a - *b).abs() - *b * step).max_element() / mean;
    let mut errors: Vec<f32> = found.iter().zip(&expected).map(error).collect();
    errors.sort_unstable_by(f32::total_cmp);
    let within = errors.iter().filter(|e| **e < BOUND).count() as f32 / errors.len() as f32;
    let at = |share: f32| errors[((errors.len() - 1) as f32 * share) as usize];
    println!("{within} within {BOUND}; median {}, p99 {}, worst {}", at(0.5), at(0.99), at(1.0));
    let pairs = took.pairs_evaluated.unwrap() as f64 / stats.pairs_evaluated.max(1) as f64;
    assert!(stats.pairs_evaluated == 0 || (pairs - 1.0).abs() < 0.01, "{took:?} {stats:?}");
    (within, took)
}

fn check(baked: &Baked, size: [u32; 2]) -> FrameStats {
    for camera in 0..baked.scene.cameras_or_default().len() {
        for format in [IrradianceFormat::Float, IrradianceFormat::Half] {
            let (share, _) = share_within(baked, camera, size, (format, 1.0));
            assert!(share >= SHARE, "camera {camera}, {format:?}: {share}");
        }
    }
    let (share, stats) = share_within(baked, 0, size, (IrradianceFormat::Float, 1.01));
    assert!(share < 0.9 * SHARE, "the check can fail: {share}");
    stats
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn cornell() {
    let stats = check(&baked_cornell(), [96, 96]);
    assert!(stats.uses_grid && stats.lights > 100, "{stats:?}");
    assert_eq!(stats.passes, ["direct", "inject", "refresh", "gather"]);
}

/// Every light at every pixel, tags included.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn cornell_without_a_grid() {
    let Baked { name, scene, asset } = baked_cornell();
    let mut data = asset.data().clone();
    data.grid = None;
    data.tags = (0..data.triangles.len() as u32).map(|light| 1 + light % 3).collect();
    data.node_tags = scene.objects.iter().map(|object| (object.node, 1 + object.node % 3)).collect();
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
    let world_from_node = GltfFile::open(&path).unwrap().world_from_nodes();
    let baked = Baked { name, scene, asset: VlmAsset::new(data, world_from_node) };
    let stats = check(&baked, [48, 48]);
    assert!(!stats.uses_grid && stats.uses_tags, "{stats:?}");
    assert_eq!(stats.passes, ["direct", "inject", "gather"]);
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
#[cfg_attr(not(has_scenes), ignore = "the scenes are neither in VLM_ASSETS nor in ../shared/assets")]
fn veach_ajar() {
    let Some(path) = assets::find("scenes/veach_ajar.glb") else { return };
    check(&Baked::open(&path, Preset::Draft).unwrap(), [128, 72]);
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
#[cfg_attr(not(has_scenes), ignore = "the scenes are neither in VLM_ASSETS nor in ../shared/assets")]
fn sponza() {
    let Some(path) = assets::find("scenes/sponza.glb") else { return };
    check(&Baked::open(&path, Preset::Draft).unwrap(), [128, 72]);
}

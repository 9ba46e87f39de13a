//! Receivers that move, lit by probes in free space: whole frames of `vlm-runtime` against the mirror.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::PathBuf;
use std::sync::LazyLock;

use glam::{DVec3, Vec3};
use vlm_bake::bake::bake;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::render::LitScene;
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_bake::shade::TraceScene;
use vlm_format::GltfFile;
use vlm_runtime::{Frame, FrameStats, IrradianceFormat, PunctualLight, Settings, Visibility, VlmAsset};
use vlm_shaders::cpu::gather_static::Frame as Gathering;
use vlm_tests::runtime_gpu::{Host, view, visibility};
use wgpu::TextureFormat;

const SIZE: u32 = 48;

/// Of a pixel's irradiance, over the frame's mean.
const BOUND: f32 = 1e-3;
/// The share of pixels that keep it: free space has more borders of leaves than surface.
const SHARE: f32 = 0.98;

struct Baked {
    scene: Scene,
    asset: VlmAsset,
}

/// The Cornell box, whose lower half is a volume.
static CORNELL: LazyLock<Baked> = LazyLock::new(|| {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
    let file = GltfFile::open(&path).unwrap();
    let mut scene = load(&file, &LoadOptions::default()).unwrap();
    let [low, high] = scene.bounds().unwrap();
    scene.volumes = vec![[low, DVec3::new(high.x, 0.5 * (low.y + high.y), high.z)]];
    let options = BakeOptions::preset(Preset::Game, scene.triangles.len());
    let asset = bake(&scene, &options, &Silent).unwrap().asset;
    Baked { scene, asset: VlmAsset::new(asset, file.world_from_nodes()) }
});

/// Stripes of what moves.
fn moves(pixel: usize) -> bool {
    (pixel / 4).is_multiple_of(2)
}

/// A frame in which the pixels of `moves` move, with the real lights this much brighter.
fn frame(settings: Settings, moves: Option<fn(usize) -> bool>, brighter: f32) -> (Vec<Vec3>, FrameStats) {
    let Baked { scene, asset } = &*CORNELL;
    let (trace, camera) = (TraceScene::new(scene), &scene.cameras[0]);
    let gbuffer = GBuffer::trace(&trace, camera, SIZE, SIZE);
    let mut host = Host::new(asset, Settings { format: IrradianceFormat::Float, ..settings }).unwrap();
    let mut pictures = host.upload(&gbuffer, camera, |_| 0);
    pictures.moving = moves.map(|moves| {
        let mask: Vec<u8> = (0..gbuffer.points.len()).map(|pixel| u8::from(moves(pixel))).collect();
        host.texture([SIZE, SIZE], TextureFormat::R8Uint, &mask)
    });
    let seen = visibility(&trace, host.renderer.points().unwrap());
    let lights: Vec<PunctualLight> =
        trace.lights.iter().map(|l| PunctualLight { intensity: l.intensity * brighter, ..*l }).collect();
    let frame = Frame {
        lights: &lights,
        visibility: Visibility::Given(&seen),
        view: view(camera, &gbuffer, 1.0),
        ..Frame::default()
    };
    host.frame(&frame, &pictures).unwrap()
}

/// What the mirrors say.
fn mirror(moves: fn(usize) -> bool) -> Vec<Vec3> {
    let Baked { scene, asset } = &*CORNELL;
    let (trace, camera) = (TraceScene::new(scene), &scene.cameras[0]);
    let gbuffer = GBuffer::trace(&trace, camera, SIZE, SIZE);
    let lit = LitScene::new(&trace, asset.data()).unwrap();
    let grid = asset.data().grid.as_ref().unwrap();
    let arrived = lit.arrived(&trace, grid);
    let gathering = Gathering { grid, lights: &lit.lights, arrived: &arrived };
    let at = |(pixel, point): (usize, &Option<_>)| {
        let Some(point) = point else { return Vec3::ZERO };
        let receiver = lit.receiver(point);
        let gathered =
            if moves(pixel) { gathering.gather_free(&receiver) } else { gathering.gather(&receiver) };
        gathered.irradiance
    };
    gbuffer.points.iter().enumerate().map(at).collect()
}

/// The share of pixels within the bound.
fn share(found: &[Vec3], expected: &[Vec3]) -> f32 {
    let mean = expected.iter().map(|e| e.element_sum() / 3.0).sum::<f32>() / expected.len() as f32;
    assert!(mean > 0.0 && found.len() == expected.len());
    let is_within = |(a, b): &(&Vec3, &Vec3)| (**a - **b).abs().max_element() < BOUND * mean;
    found.iter().zip(expected).filter(is_within).count() as f32 / found.len() as f32
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn what_moves_is_lit_by_free_space_and_all_else_by_surface() {
    let expected = mirror(moves);
    let (found, stats) = frame(Settings::default(), Some(moves), 1.0);
    println!("{} of the pixels, {:?}", share(&found, &expected), stats.passes);
    assert!(stats.uses_free_probes);
    assert_eq!(stats.passes, ["direct", "inject", "refresh", "refresh_free", "gather"]);
    assert!(share(&found, &expected) >= SHARE, "{}", share(&found, &expected));
    // The negative controls: brighter lights, and a frame in which nothing moves.
    assert!(share(&frame(Settings::default(), Some(moves), 1.01).0, &expected) < 0.5, "the check can fail");
    let (still, _) = frame(Settings::default(), None, 1.0);
    let same = share(&still, &expected);
    assert!(same > 0.4 && same < 0.9 * SHARE, "half of the pixels differ: {same}");
    assert!(share(&still, &mirror(|_| false)) >= SHARE);
}

/// Together with lights that may move, and counted: eight storage buffers are enough.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn moving_nodes_and_counting_go_with_it() {
    let settings = Settings { moving_nodes: true, count_pairs: true, ..Settings::default() };
    let (found, stats) = frame(settings, Some(moves), 1.0);
    assert!(share(&found, &mirror(moves)) >= SHARE);
    assert!(stats.pairs_evaluated.unwrap() > 1000, "{stats:?}");
}

/// Only probes that a change reaches, of both kinds.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn a_small_change_refreshes_few_probes_of_both_kinds() {
    let Baked { scene, asset } = &*CORNELL;
    let (trace, camera) = (TraceScene::new(scene), &scene.cameras[0]);
    let gbuffer = GBuffer::trace(&trace, camera, SIZE, SIZE);
    let host = || {
        let host =
            Host::new(asset, Settings { format: IrradianceFormat::Float, ..Settings::default() }).unwrap();
        let mut pictures = host.upload(&gbuffer, camera, |_| 0);
        let mask: Vec<u8> = (0..gbuffer.points.len()).map(|pixel| u8::from(moves(pixel))).collect();
        pictures.moving = Some(host.texture([SIZE, SIZE], TextureFormat::R8Uint, &mask));
        (host, pictures)
    };
    let (mut first, pictures) = host();
    let point = first.renderer.points().unwrap()[0];
    let lamp = |intensity: f32| {
        let position = point.position + 0.05 * point.normal;
        PunctualLight { range: 0.1, ..PunctualLight::point(position, Vec3::splat(intensity)) }
    };
    let of = |lamp: PunctualLight| [trace.lights[0], lamp];
    let (dim, bright) = (of(lamp(1.0)), of(lamp(50.0)));
    let view = view(camera, &gbuffer, 1.0);
    let (before, _) = first.frame(&Frame { lights: &dim, view, ..Frame::default() }, &pictures).unwrap();
    let frame = Frame { lights: &bright, view, ..Frame::default() };
    let (after, stats) = first.frame(&frame, &pictures).unwrap();
    assert!(stats.probes_refreshed > 0 && stats.probes_refreshed < stats.probes, "{stats:?}");
    let (mut fresh, pictures) = host();
    assert!(fresh.frame(&frame, &pictures).unwrap().0 == after && before != after);
}

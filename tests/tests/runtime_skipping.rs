//! What `vlm-runtime` leaves out of a frame, by its own counters.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::sync::LazyLock;

use glam::Vec3;
use vlm_bake::bake::bake;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_bake::shade::TraceScene;
use vlm_format::GltfFile;
use vlm_runtime::{Frame, FrameStats, PunctualLight, Settings, Skipped, View, Visibility, VlmAsset};
use vlm_tests::runtime_gpu::{Host, Pictures, view};

const SIZE: u32 = 16;

static CORNELL: LazyLock<(Scene, VlmAsset)> = LazyLock::new(|| {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
    let file = GltfFile::open(&path).unwrap();
    let scene = load(&file, &LoadOptions::default()).unwrap();
    let options = BakeOptions::preset(Preset::Draft, scene.triangles.len());
    let asset = bake(&scene, &options, &Silent).unwrap().asset;
    (scene, VlmAsset::new(asset, file.world_from_nodes()))
});

/// A host with an asset, a picture of the Cornell box, and its camera.
fn host(asset: &VlmAsset) -> (Host, Pictures, View) {
    let scene = &CORNELL.0;
    let (trace, camera) = (TraceScene::new(scene), &scene.cameras[0]);
    let gbuffer = GBuffer::trace(&trace, camera, SIZE, SIZE);
    let host = Host::new(asset, Settings { count_pairs: true, ..Settings::default() }).unwrap();
    let pictures = host.upload(&gbuffer, camera, |_| 0);
    (host, pictures, view(camera, &gbuffer, 1.0))
}

/// The asset with its data changed.
fn changed(change: impl FnOnce(&mut vlm_format::VlmAsset)) -> VlmAsset {
    let mut data = CORNELL.1.data().clone();
    change(&mut data);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
    VlmAsset::new(data, GltfFile::open(&path).unwrap().world_from_nodes())
}

fn lamp() -> PunctualLight {
    TraceScene::new(&CORNELL.0).lights[0]
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn a_camera_only_frame_runs_the_gather_alone() {
    let (mut host, pictures, view) = host(&CORNELL.1);
    let lights = [lamp()];
    let frame = Frame { lights: &lights, view, ..Frame::default() };
    let (_, first) = host.frame(&frame, &pictures).unwrap();
    assert_eq!(first.passes, ["direct", "inject", "refresh", "gather"]);
    assert_eq!(first.lights_injected + first.lights_skipped.black, first.lights);
    assert!(first.bytes_uploaded > 10_000, "{first:?}");
    let moved = Frame { view: View { exposure: 2.0, ..view }, ..frame };
    let (_, second) = host.frame(&moved, &pictures).unwrap();
    assert_eq!((&second.passes[..], second.lights_injected), (&["gather"][..], 0));
    assert_eq!(second.bytes_uploaded, size_of::<View>() as u64);
    assert_eq!(second.lights_skipped.unchanged, first.lights_injected);
    let (_, third) = host.frame(&moved, &pictures).unwrap();
    assert_eq!(third.bytes_uploaded, 0, "nothing changed at all");
    // The negative control: a light that changed.
    let lights = [PunctualLight { intensity: Vec3::ONE, ..lamp() }];
    let (_, fourth) = host.frame(&Frame { lights: &lights, ..moved }, &pictures).unwrap();
    assert_eq!((fourth.passes, fourth.lights_injected), (first.passes, first.lights_injected));
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn lights_out_of_reach_are_not_injected_again() {
    let (mut host, pictures, view) = host(&CORNELL.1);
    let point = host.renderer.points().unwrap()[0];
    let near = |intensity: f32| {
        let position = point.position + 0.05 * point.normal;
        PunctualLight { range: 0.1, ..PunctualLight::point(position, Vec3::splat(intensity)) }
    };
    let (dim, bright) = ([lamp(), near(1.0)], [lamp(), near(5.0)]);
    let frame = Frame { lights: &dim, view, ..Frame::default() };
    let (before, first) = host.frame(&frame, &pictures).unwrap();
    let (after, second) = host.frame(&Frame { lights: &bright, ..frame }, &pictures).unwrap();
    assert!((1..first.lights_injected / 2).contains(&second.lights_injected), "{second:?}");
    assert_eq!(second.lights_injected + second.lights_skipped.unchanged, first.lights_injected);
    assert!(before != after, "those that it reaches are");
    assert_eq!(second.passes, ["direct", "inject", "refresh", "gather"]);
    assert!((1..second.probes).contains(&second.probes_refreshed), "{second:?}");
    assert_eq!(first.probes_refreshed, first.probes);
    let (mut fresh, fresh_pictures, _) = self::host(&CORNELL.1);
    let (anew, _) = fresh.frame(&Frame { lights: &bright, ..frame }, &fresh_pictures).unwrap();
    assert!(anew == after, "what was skipped had not changed");
    // Back to all: the lamp reaches everything.
    let all = [PunctualLight { intensity: Vec3::ONE, ..lamp() }, near(5.0)];
    let (_, third) = host.frame(&Frame { lights: &all, ..frame }, &pictures).unwrap();
    assert_eq!((third.lights_injected, third.probes_refreshed), (first.lights_injected, first.probes));
}

/// Two frames in a row may change different lights before anything is recorded.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn a_frame_that_is_not_recorded_loses_no_change() {
    let (mut host, pictures, view) = host(&CORNELL.1);
    let points = host.renderer.points().unwrap().to_vec();
    let near = |point: usize, intensity: f32| {
        let position = points[point].position + 0.05 * points[point].normal;
        PunctualLight { range: 0.1, ..PunctualLight::point(position, Vec3::splat(intensity)) }
    };
    let last = points.len() - 1;
    let frame = Frame { view, ..Frame::default() };
    let [dim, first, both] =
        [[near(0, 1.0), near(last, 1.0)], [near(0, 2.0), near(last, 1.0)], [near(0, 2.0), near(last, 2.0)]];
    host.frame(&Frame { lights: &dim, ..frame }, &pictures).unwrap();
    host.renderer.prepare(&host.queue, &Frame { lights: &first, ..frame }).unwrap();
    let (found, stats) = host.frame(&Frame { lights: &both, ..frame }, &pictures).unwrap();
    assert!(stats.probes_refreshed > 0 && stats.probes_refreshed < stats.probes, "{stats:?}");
    let (mut fresh, pictures, _) = self::host(&CORNELL.1);
    let (anew, _) = fresh.frame(&Frame { lights: &both, ..frame }, &pictures).unwrap();
    assert!(anew == found);
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn unlit_lights_are_never_evaluated() {
    let (mut host, pictures, view) = host(&CORNELL.1);
    let (_, dark) = host.frame(&Frame { view, ..Frame::default() }, &pictures).unwrap();
    assert_eq!(
        (dark.lights_injected, dark.lights_skipped.unlit),
        (0, dark.lights - dark.lights_skipped.black)
    );
    assert_eq!(dark.passes, ["inject", "refresh", "gather"], "no direct light to be found");
    let far = [PunctualLight { range: 1.0, ..PunctualLight::point(Vec3::splat(1e3), Vec3::ONE) }];
    let (_, out_of_range) = host.frame(&Frame { lights: &far, view, ..Frame::default() }, &pictures).unwrap();
    assert_eq!(out_of_range.passes, ["gather"]);
    assert_eq!(out_of_range.lights_skipped, dark.lights_skipped);
    let (_, lit) = host.frame(&Frame { lights: &[lamp()], view, ..Frame::default() }, &pictures).unwrap();
    assert_eq!((lit.lights_skipped.unlit, lit.lights_injected), (0, dark.lights_skipped.unlit));
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn lights_of_the_own_tag_are_never_evaluated() {
    let pairs = |of_lights: u32, of_surface: u32| {
        let asset = changed(|data| {
            data.grid = None;
            data.tags = vec![of_lights; data.triangles.len()];
        });
        let scene = &CORNELL.0;
        let (trace, camera) = (TraceScene::new(scene), &scene.cameras[0]);
        let gbuffer = GBuffer::trace(&trace, camera, SIZE, SIZE);
        let mut host = Host::new(&asset, Settings { count_pairs: true, ..Settings::default() }).unwrap();
        let pictures = host.upload(&gbuffer, camera, |_| of_surface);
        let frame = Frame { lights: &[lamp()], view: view(camera, &gbuffer, 1.0), ..Frame::default() };
        host.frame(&frame, &pictures).unwrap().1.pairs_evaluated.unwrap()
    };
    assert_eq!(pairs(3, 3), 0);
    assert!(pairs(3, 4) > 1000 && pairs(3, 4) == pairs(0, 0), "the negative control");
}

/// What an asset lacks is neither bound nor compiled.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn shaders_hold_nothing_that_the_asset_lacks() {
    let module = |asset: &VlmAsset, settings: Settings| {
        Host::new(asset, settings).unwrap().renderer.forward_module(2).unwrap()
    };
    let (grid, none) = (Settings::default(), changed(|data| data.grid = None));
    let by_grid = module(&CORNELL.1, grid);
    let listed = module(&none, grid);
    let moving = module(&CORNELL.1, Settings { moving_nodes: true, ..grid });
    for (module, grid, list) in [(by_grid, true, false), (listed, false, true), (moving, true, true)] {
        assert_eq!(module.contains("fn gather_static("), grid);
        assert_eq!(module.contains("near_radiosities: array"), grid);
        assert_eq!(module.contains("fn gather_listed("), list);
        assert_eq!(module.contains("light_radiosity: array"), list);
        assert!(!module.contains("fn gather_free("), "the box has no probes in free space");
        assert!(module.contains("fn indirect_moving("), "but shaders may ask all the same");
    }
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn unchanged_visibility_is_neither_written_nor_injected() {
    let (mut host, pictures, view) = host(&CORNELL.1);
    let lights = [lamp()];
    let mut seen = vec![1.0; host.renderer.points().unwrap().len()];
    let frame = Frame { lights: &lights, view, ..Frame::default() };
    host.frame(&Frame { visibility: Visibility::Given(&seen), ..frame }, &pictures).unwrap();
    let (_, same) = host.frame(&Frame { visibility: Visibility::Given(&seen), ..frame }, &pictures).unwrap();
    assert_eq!((&same.passes[..], same.bytes_uploaded), (&["gather"][..], 0));
    seen[0] = 0.25;
    let (_, one) = host.frame(&Frame { visibility: Visibility::Given(&seen), ..frame }, &pictures).unwrap();
    assert_eq!((one.lights_injected, one.passes.len()), (1, 4), "{one:?}");
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn few_lights_need_no_grid() {
    let (mut with_grid, pictures, view) = host(&CORNELL.1);
    let lights = [lamp()];
    let frame = Frame { lights: &lights, view, ..Frame::default() };
    let (_, stats) = with_grid.frame(&frame, &pictures).unwrap();
    assert!(stats.uses_grid && stats.lights >= 40);
    let few = Settings { fewest_lights_for_grid: stats.lights + 1, count_pairs: true, ..Settings::default() };
    let mut host = Host::new(&CORNELL.1, few).unwrap();
    let (_, stats) = host.frame(&frame, &pictures_of(&host)).unwrap();
    assert!(!stats.uses_grid);
    assert_eq!(stats.passes, ["direct", "inject", "gather"]);
}

/// The picture of [`host`], on another device.
fn pictures_of(host: &Host) -> Pictures {
    let scene = &CORNELL.0;
    let gbuffer = GBuffer::trace(&TraceScene::new(scene), &scene.cameras[0], SIZE, SIZE);
    host.upload(&gbuffer, &scene.cameras[0], |_| 0)
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn black_lights_are_never_evaluated() {
    let pairs = |asset: &VlmAsset| -> FrameStats {
        let (mut host, pictures, view) = host(asset);
        let lights = [lamp()];
        host.frame(&Frame { lights: &lights, view, ..Frame::default() }, &pictures).unwrap().1
    };
    let all = pairs(&changed(|data| data.grid = None));
    let black = changed(|data| {
        data.grid = None;
        data.samples.iter_mut().for_each(|sample| sample.reflectance = Vec3::ZERO);
    });
    let none = pairs(&black);
    assert!(all.pairs_evaluated.unwrap() > 1000, "{all:?}");
    // What glows by itself stays; the lamp of this box is a punctual light.
    assert_eq!(none.pairs_evaluated, Some(0), "{none:?}");
    assert_eq!(none.lights_skipped, Skipped { black: none.lights, ..Skipped::default() });
    assert_eq!(none.passes, ["inject", "gather"], "{none:?}");
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn tags_cost_nothing_where_there_are_none() {
    let tags = |data: &mut vlm_format::VlmAsset, tag| {
        data.grid = None;
        data.tags = vec![tag; data.triangles.len()];
    };
    let uses_tags = |asset: &VlmAsset| {
        let (mut host, pictures, view) = host(asset);
        let binds_tags = host.renderer.forward_module(2).unwrap().contains("header.light_tags +");
        let (_, stats) = host.frame(&Frame { view, ..Frame::default() }, &pictures).unwrap();
        assert_eq!(stats.uses_tags, binds_tags);
        stats.uses_tags
    };
    assert!(!uses_tags(&changed(|data| tags(data, 0))));
    assert!(uses_tags(&changed(|data| tags(data, 7))));
}

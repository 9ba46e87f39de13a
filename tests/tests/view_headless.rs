//! `vlm-view --headless` makes the picture of `vlm render`, files and numbers included.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};

use glam::Vec3;
use tempfile::TempDir;
use vlm_bake::options::Preset;
use vlm_bake::picture::{read_irradiance, write_png};
use vlm_bake::render::{Method, Rendering};
use vlm_runtime::view::{Headless, ViewError, headless};
use vlm_tests::assets;
use vlm_tests::rooms::relative_rmse;
use vlm_tests::viewing::{arguments, baked, rendered};

/// Of a pixel's irradiance, over the frame's mean.
const BOUND: f32 = 1e-3;
/// The share of pixels that keep it; the rest lie on silhouettes.
const SHARE: f32 = 0.99;

fn asset(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../assets").join(name)
}

/// The share of pixels of `found` within [`BOUND`] of those expected; over the mean of those.
fn share_within(found: &[Vec3], expected: &[Vec3]) -> f32 {
    assert_eq!(found.len(), expected.len());
    let mean = expected.iter().map(|e| e.element_sum() / 3.0).sum::<f32>() / expected.len() as f32;
    let is_within = |(a, b): &(&Vec3, &Vec3)| (**a - **b).abs().max_element() / mean < BOUND;
    found.iter().zip(expected).filter(is_within).count() as f32 / found.len() as f32
}

/// Both pictures of a baked file.
fn both(file: &Path, camera: usize, size: [u32; 2], method: Method) -> [Rendering; 2] {
    let (camera, [width, height]) = (camera.to_string(), size);
    let size_text = format!("{width}x{height}");
    let flags = ["--camera", &camera, "--size", &size_text, "--method", method.name()];
    let Headless { report, rendering: found, .. } = headless(&arguments(file, &flags).unwrap()).unwrap();
    let expected = rendered(file, Some(&camera), size, method).unwrap();
    let json = serde_json::to_value(&report).unwrap();
    let same = ["camera", "width", "height", "method", "seconds", "pairs_evaluated", "lights"];
    assert!(same.iter().all(|key| json.get(key).is_some()), "{json}");
    let pairs = report.render.stats.pairs_evaluated as f64 / expected.stats.pairs_evaluated.max(1) as f64;
    assert!(expected.stats.pairs_evaluated == 0 || (pairs - 1.0).abs() < 0.01, "{json}");
    assert!(report.render.stats.seconds.gather > 0.0);
    [found, expected]
}

fn check(file: &Path, cameras: usize, size: [u32; 2], method: Method) {
    for camera in 0..cameras {
        let [found, expected] = both(file, camera, size, method);
        let indirect = share_within(&found.indirect, &expected.indirect);
        let direct = share_within(&found.direct, &expected.direct);
        println!("{} {camera} {method:?}: indirect {indirect}, direct {direct}", file.display());
        assert!(indirect >= SHARE, "camera {camera}: {indirect}");
        assert!(direct >= SHARE, "camera {camera}: {direct}");
        let brighter: Vec<Vec3> = expected.indirect.iter().map(|e| *e * 1.01).collect();
        let share = share_within(&found.indirect, &brighter);
        assert!(share < 0.9 * SHARE, "the check can fail: {share}");
        let hits = found.gbuffer.points.iter().zip(&expected.gbuffer.points);
        let differ = hits.filter(|(a, b)| a.is_some() != b.is_some()).count();
        assert!(differ < found.indirect.len() / 100, "{differ} pixels hit and miss");
        let nowhere = found.gbuffer.points.iter().zip(&found.indirect).filter(|(point, _)| point.is_none());
        assert!(nowhere.map(|(_, light)| *light).all(|light| light == Vec3::ZERO));
    }
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn cornell() {
    let folder = TempDir::new().unwrap();
    for name in ["cornell.glb", "cornell_sphere.glb"] {
        let file = baked(&asset(name), Preset::Game, folder.path()).unwrap();
        check(&file, 1, [96, 96], Method::Vlm);
        check(&file, 1, [48, 40], Method::Brute);
    }
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
#[cfg_attr(not(has_scenes), ignore = "the scenes are neither in VLM_ASSETS nor in ../shared/assets")]
fn veach_ajar() {
    let Some(path) = assets::find("scenes/veach_ajar.glb") else { return };
    let folder = TempDir::new().unwrap();
    let file = baked(&path, Preset::Draft, folder.path()).unwrap();
    check(&file, 1, [128, 72], Method::Vlm);
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
#[cfg_attr(not(has_scenes), ignore = "the scenes are neither in VLM_ASSETS nor in ../shared/assets")]
fn sponza() {
    let Some(path) = assets::find("scenes/sponza.glb") else { return };
    let folder = TempDir::new().unwrap();
    let file = baked(&path, Preset::Draft, folder.path()).unwrap();
    check(&file, 2, [128, 72], Method::Vlm);
}

/// The files of the flags; and a file without lights is baked first, as `vlm bake` does.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn files_are_those_of_vlm_render() {
    let folder = TempDir::new().unwrap();
    let [png, exr, reference] = ["a.png", "a.exr", "b.png"].map(|name| folder.path().join(name));
    let [png_flag, exr_flag] = [&png, &exr].map(|path| path.to_str().unwrap());
    let flags =
        ["--size", "80x60", "--out", png_flag, "--irradiance", exr_flag, "--exposure", "0.05", "--json"];
    let Headless { report, rendering: found, .. } =
        headless(&arguments(&asset("cornell.glb"), &flags).unwrap()).unwrap();
    assert_eq!(report.passes, ["direct", "inject", "refresh", "gather"]);
    assert!(report.lights_injected > 100 && report.bytes_uploaded > 100_000, "{report:?}");
    let (width, height, irradiance) = read_irradiance(&exr).unwrap();
    assert_eq!((width, height, &irradiance), (80, 60, &found.indirect));

    let baked = baked(&asset("cornell.glb"), Preset::Game, folder.path()).unwrap();
    let expected = rendered(&baked, None, [80, 60], Method::Vlm).unwrap();
    assert!(share_within(&irradiance, &expected.indirect) >= SHARE);
    write_png(&expected, &reference, Some(0.05)).unwrap();
    let [shown, reference] = [&png, &reference].map(|path| image::open(path).unwrap().into_rgb8());
    let close = |(a, b): &(&u8, &u8)| a.abs_diff(**b) <= 1;
    let share = shown.iter().zip(reference.iter()).filter(close).count() as f32 / shown.as_raw().len() as f32;
    assert!(share >= SHARE, "{share}");
    let darker = |(a, b): &(&u8, &u8)| a.abs_diff(b.saturating_sub(8)) <= 1;
    let share =
        shown.iter().zip(reference.iter()).filter(darker).count() as f32 / shown.as_raw().len() as f32;
    assert!(share < 0.5, "the check can fail: {share}");
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn direct_light_needs_no_lights() {
    let [found, expected] = both_direct();
    assert!(share_within(&found.direct, &expected.direct) >= SHARE);
    assert!(found.indirect.iter().all(|light| *light == Vec3::ZERO));
}

fn both_direct() -> [Rendering; 2] {
    let file = asset("cornell.glb");
    let flags = ["--size", "64x48", "--method", "direct"];
    let Headless { report, rendering: found, .. } = headless(&arguments(&file, &flags).unwrap()).unwrap();
    assert!(report.passes.is_empty() && report.render.stats.lights == 0);
    [found, rendered(&file, None, [64, 48], Method::Direct).unwrap()]
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn what_cannot_be_says_why() {
    let folder = TempDir::new().unwrap();
    let cornell = asset("cornell.glb");
    let fails = |file: &Path, flags: &[&str]| -> ViewError {
        headless(&arguments(file, flags).unwrap()).map(|_| ()).unwrap_err()
    };
    let missing = fails(&folder.path().join("none.glb"), &[]);
    assert!(missing.to_string().contains("none.glb") && missing.exit_code() == 2, "{missing}");
    let broken = folder.path().join("broken.gltf");
    std::fs::write(&broken, "{ \"asset\": {").unwrap();
    let error = fails(&broken, &[]);
    assert!(error.to_string().contains("broken.gltf") && error.exit_code() == 1, "{error}");
    let error = fails(&cornell, &["--camera", "roof"]);
    assert!(error.to_string().contains("`camera`") && error.exit_code() == 2, "{error}");
    let error = fails(&cornell, &["--size", "90000x2", "--method", "direct"]);
    assert!(error.to_string().contains("max_texture_dimension_2d") && error.exit_code() == 2, "{error}");
    let path = folder.path().join("none").join("a.png");
    let error = fails(&cornell, &["--size", "8x8", "--method", "direct", "--out", path.to_str().unwrap()]);
    assert!(error.to_string().contains("none") && error.exit_code() == 2, "{error}");
    assert!(arguments(&cornell, &["--size", "0x2"]).is_err());
    assert!(arguments(&cornell, &["--method", "reference"]).is_err());
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn shadow_maps_give_nearly_the_light_of_rays() {
    let folder = TempDir::new().unwrap();
    let file = baked(&asset("cornell.glb"), Preset::Game, folder.path()).unwrap();
    let by = |shadows: &str| {
        let flags = ["--size", "64x64", "--shadows", shadows];
        headless(&arguments(&file, &flags).unwrap()).unwrap()
    };
    let [rays, maps] = ["rays", "maps"].map(by);
    assert_eq!(maps.report.passes, ["shadow", "direct", "inject", "refresh", "gather"]);
    let error = relative_rmse(&maps.rendering.indirect, &rays.rendering.indirect);
    println!("relative RMSE {error}");
    assert!(error > 0.0 && error < 0.01, "{error}");
    let dimmer: Vec<Vec3> = rays.rendering.indirect.iter().map(|light| *light * 0.98).collect();
    assert!(relative_rmse(&dimmer, &rays.rendering.indirect) > 0.01, "the negative control");
}

//! What the user of the viewer chooses shows: colours of the bounce, lights, methods and their difference, overlays, flying.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use tempfile::TempDir;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::options::Preset;
use vlm_bake::progress::Silent;
use vlm_bake::render::{Method, gather_brute, gather_by_grid};
use vlm_bake::scene::{Camera, Projection};
use vlm_bake::shade::TraceScene;
use vlm_format::VlmAsset;
use vlm_runtime::view::{
    Controls, Flight, FrameReport, Gpu, OpenOptions, Opened, Overlays, PICTURE_FORMAT, ShadowsArg, Sources,
    Viewer, ViewerOptions,
};
use vlm_tests::viewing::baked;

const SIZE: [u32; 2] = [64, 48];

/// Of a pixel's irradiance, over the frame's mean.
const BOUND: f32 = 1e-3;

/// A viewer with the Cornell box.
struct Shown {
    viewer: Viewer,
    controls: Controls,
    camera: Camera,
    file: PathBuf,
    _folder: TempDir,
}

impl Shown {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let cornell = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
        let file = baked(&cornell, Preset::Draft, folder.path()).unwrap();
        let options = ViewerOptions { format: PICTURE_FORMAT, shadows: ShadowsArg::Rays, measures: false };
        let mut viewer = Viewer::new(Gpu::new().unwrap(), Sources::default(), options).unwrap();
        let mut controls = Controls { exposure: 0.05, ..Controls::default() };
        let opened = open(&file);
        let camera = opened.scene.camera(None).unwrap();
        viewer.show(opened, &mut controls).unwrap();
        Self { viewer, controls, camera, file, _folder: folder }
    }

    fn frame(&mut self) -> FrameReport {
        self.viewer.frame(&self.controls, &self.camera, SIZE, true).unwrap()
    }

    fn indirect(&mut self) -> Vec<Vec3> {
        let report = self.frame();
        self.viewer.rendering(&report).unwrap().indirect
    }

    fn picture(&mut self) -> Vec<[u8; 3]> {
        self.frame();
        self.viewer.picture(&self.controls, &self.camera).unwrap()
    }

    /// The indirect light that the mirrors find with the lights of the asset changed.
    fn expected(&self, change: impl Fn(&mut VlmAsset)) -> Vec<Vec3> {
        let opened = open(&self.file);
        let mut asset = opened.asset.unwrap().data().clone();
        change(&mut asset);
        let mut trace = TraceScene::new(&opened.scene);
        trace.lights = self.controls.real_lights();
        let gbuffer = GBuffer::trace(&trace, &self.camera, SIZE[0], SIZE[1]);
        let gather = if self.controls.method == Method::Brute { gather_brute } else { gather_by_grid };
        gather(&trace, &asset, &gbuffer, &Silent).unwrap().0
    }
}

fn open(file: &Path) -> Opened {
    Opened::open(file, OpenOptions::default(), &Silent).unwrap()
}

fn share_within(found: &[Vec3], expected: &[Vec3]) -> f32 {
    let mean = expected.iter().map(|e| e.element_sum() / 3.0).sum::<f32>() / expected.len() as f32;
    let is_within = |(a, b): &(&Vec3, &Vec3)| (**a - **b).abs().max_element() / mean < BOUND;
    found.iter().zip(expected).filter(is_within).count() as f32 / found.len() as f32
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn a_recoloured_wall_bounces_as_if_it_had_that_colour() {
    for method in [Method::Vlm, Method::Brute] {
        let mut shown = Shown::new();
        shown.controls.method = method;
        let before = shown.indirect();
        let names: Vec<&str> = shown.controls.bounces.iter().map(|b| b.group.name.as_str()).collect();
        assert!(names.contains(&"room: red") && names.contains(&"tall block: white"), "{names:?}");
        let wall = shown.controls.bounces.iter_mut().find(|b| b.group.name == "room: red").unwrap();
        assert!((wall.color() - Vec3::new(0.63, 0.065, 0.05)).length() < 0.02, "{:?}", wall.group);
        wall.set_color(Vec3::new(0.05, 0.06, 0.7));
        wall.intensity = 1.5;
        let (tint, lights) = (wall.tint * 1.5, wall.group.lights.clone());
        let report = shown.frame();
        assert_eq!(report.stats.passes.first(), Some(&"inject"), "direct light is not found again");
        let tinted = shown.indirect();
        let expected = shown.expected(|asset| {
            for &light in &lights {
                let starts = [0, 1].map(|i| asset.sample_starts[light as usize + i] as usize);
                asset.samples[starts[0]..starts[1]].iter_mut().for_each(|s| s.reflectance *= tint);
            }
        });
        let share = share_within(&tinted, &expected);
        assert!(share >= 0.99, "{method:?}: {share}");
        assert!(share_within(&before, &expected) < 0.5, "the check can fail");
        let wall = shown.controls.bounces.iter_mut().find(|b| b.group.name == "room: red").unwrap();
        (wall.tint, wall.intensity) = (Vec3::ONE, 1.0);
        assert_eq!(shown.indirect(), before, "and back");
    }
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn lights_move_turn_and_dim() {
    let mut shown = Shown::new();
    let before = shown.indirect();
    let light = &mut shown.controls.lights[0];
    light.light.position += Vec3::new(0.8, -0.5, 0.3);
    light.intensity = 0.25;
    let moved = shown.indirect();
    let share = share_within(&moved, &shown.expected(|_| ()));
    assert!(share >= 0.99, "{share}");
    assert!(share_within(&moved, &before) < 0.5, "the check can fail");
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn differences_show_which_is_brighter() {
    let mut shown = Shown::new();
    shown.controls.compared = Some(Method::Vlm);
    let grey = shown.picture();
    let of_background = |p: &[u8; 3]| *p == [24, 26, 30];
    assert!(
        grey.iter().all(|p| of_background(p) || (p[0] == p[1] && p[1] == p[2])),
        "no difference to itself"
    );
    shown.controls.compared = Some(Method::Direct);
    let brighter = shown.picture();
    let orange = brighter.iter().filter(|p| p[0] > p[2] + 20).count();
    shown.controls.method = Method::Direct;
    shown.controls.compared = Some(Method::Brute);
    let darker = shown.picture();
    let blue = darker.iter().filter(|p| p[2] > p[0] + 20).count();
    assert!(orange > 500 && blue > 500, "{orange} {blue}");
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn shares_and_exposure_show() {
    let mut shown = Shown::new();
    let all = shown.picture();
    shown.controls.indirect_share = 0.0;
    let direct = shown.picture();
    shown.controls.direct_share = 0.0;
    let none = shown.picture();
    let sum = |picture: &[[u8; 3]]| picture.iter().flatten().map(|byte| u64::from(*byte)).sum::<u64>();
    assert!(sum(&none) < sum(&direct) && sum(&direct) < sum(&all));
    shown.controls = Controls { direct_share: 1.0, indirect_share: 1.0, ..shown.controls };
    shown.controls.exposure = shown.viewer.auto_exposure().unwrap();
    let exposed = shown.picture();
    assert!(sum(&exposed) > sum(&all), "0.05 is dark: {}", shown.controls.exposure);
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn overlays_cover_what_they_speak_of() {
    let mut shown = Shown::new();
    let plain = shown.picture();
    let covered = |shown: &mut Shown, overlays: Overlays| {
        shown.controls.overlays = overlays;
        let picture = shown.picture();
        picture.iter().zip(&plain).filter(|(a, b)| a != b).count()
    };
    let none = Overlays::default();
    let hits = plain.iter().filter(|p| **p != [24, 26, 30]).count();
    let wireframe = covered(&mut shown, Overlays { wireframe: true, ..none });
    assert!(wireframe > hits / 20 && wireframe < hits * 9 / 10, "{wireframe} of {hits}");
    let cells = covered(&mut shown, Overlays { cells: true, ..none });
    assert!(cells > hits * 9 / 10 && cells <= hits, "{cells} of {hits}");
    let radiosity = covered(&mut shown, Overlays { radiosity: true, ..none });
    assert!(radiosity > hits * 8 / 10, "{radiosity} of {hits}");
    assert_eq!(covered(&mut shown, Overlays { tags: true, ..none }), 0, "nothing has a tag here");
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn flying_and_orthographic_cameras_show_what_rays_find() {
    let mut shown = Shown::new();
    let mut flight = Flight::from_camera(&shown.camera);
    flight.move_by(DVec3::new(0.3, 0.2, 1.5));
    flight.turn(0.2, -0.1);
    shown.camera = flight.camera();
    let share = share_within(&shown.indirect(), &shown.expected(|_| ()));
    assert!(share >= 0.99, "{share}");
    shown.camera.projection = Projection::Orthographic(2.0);
    let share = share_within(&shown.indirect(), &shown.expected(|_| ()));
    assert!(share >= 0.98, "orthographic: {share}");
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn what_did_not_change_is_not_made_again() {
    let mut shown = Shown::new();
    let first = shown.frame().stats;
    assert_eq!(first.passes, ["direct", "inject", "refresh", "gather"]);
    let again = shown.frame().stats;
    assert!(again.passes.is_empty(), "{again:?}");
    shown.camera.world_from_view.w_axis.x += 0.1;
    let moved = shown.frame().stats;
    assert_eq!((moved.passes.as_slice(), moved.lights_injected), (&["gather"][..], 0));
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn passes_are_timed_where_the_device_can() {
    let mut shown = Shown::new();
    if !shown.viewer.gpu().has_timestamps {
        return;
    }
    let mut times = None;
    for i in 0..20 {
        shown.camera.world_from_view.w_axis.x += 0.01 * f64::from(i);
        shown.frame();
        shown.viewer.gpu().wait().unwrap();
        times = times.or(shown.viewer.pass_times());
    }
    let names: Vec<&str> = times.unwrap().iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["surface", "pixel light", "inject", "gather"]);
}

/// Where the runtime's own interface refuses, nothing changes.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn a_tint_that_is_no_number_is_refused() {
    let mut shown = Shown::new();
    let before = shown.indirect();
    shown.controls.bounces[0].tint.x = f32::NAN;
    let error = shown.viewer.frame(&shown.controls, &shown.camera, SIZE, true).unwrap_err();
    assert!(error.to_string().contains("tint"), "{error}");
    shown.controls.bounces[0].tint.x = 1.0;
    assert_eq!(shown.indirect(), before);
}

//! Light where there should be little: behind walls, doors, pillars and tables, by the grid and in truth.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{Vec2, Vec3};
use vlm_bake::bake::bake;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::reference::indirect_irradiance;
use vlm_bake::render::{gather_brute, gather_by_grid};
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_bake::shade::TraceScene;
use vlm_format::GltfFile;
use vlm_shaders::cpu::gather::Receiver;
use vlm_tests::assets;
use vlm_tests::rooms::{
    ALBEDO, across, add_room, baked, irradiance, mean, receiver, relative_rmse, slab, truth, turned,
    two_rooms,
};
use vlm_tests::scenes::{add, matte, point_light};

/// Directions of the truth.
const SPP: u32 = 4096;

/// Light of the dark side over that of the lit side, and how far the dark side is from the truth.
struct Leak {
    grid: f32,
    brute: f32,
    truth: f32,
    /// Relative RMSE of the dark side.
    error: f32,
    /// The same of a grid through whose walls a tenth of the light comes that would come without them.
    leaky: f32,
    leaky_error: f32,
}

fn leak(name: &str, scene: &Scene, lights: u32, [lit, dark]: [&[Receiver]; 2]) -> Leak {
    let asset = baked(scene, lights).unwrap();
    let [lit_found, dark_found] = [lit, dark].map(|r| irradiance(scene, &asset, r).unwrap());
    let [lit_truth, dark_truth] = [lit, dark].map(|r| truth(scene, r, SPP));
    let tenth = |(grid, brute): (&Vec3, &Vec3)| *grid + 0.1 * *brute;
    let leaky: Vec<Vec3> = dark_found.grid.iter().zip(&dark_found.brute).map(tenth).collect();
    let leak = Leak {
        grid: mean(&dark_found.grid) / mean(&lit_found.grid),
        brute: mean(&dark_found.brute) / mean(&lit_found.brute),
        truth: mean(&dark_truth) / mean(&lit_truth),
        error: relative_rmse(&dark_found.grid, &dark_truth),
        leaky: mean(&leaky) / mean(&lit_found.grid),
        leaky_error: relative_rmse(&leaky, &dark_truth),
    };
    println!(
        "{name}: dark over lit {:.5} by the grid, {:.5} in truth, {:.5} without occlusion; relative RMSE {:.3}; {:.5} and {:.3} with a leak",
        leak.grid, leak.truth, leak.brute, leak.error, leak.leaky, leak.leaky_error
    );
    leak
}

impl Leak {
    /// How far the dark side's share of the lit side's light is from the truth's, relative to it.
    fn off(&self) -> f32 {
        (self.grid / self.truth - 1.0).abs()
    }

    fn leaky_off(&self) -> f32 {
        (self.leaky / self.truth - 1.0).abs()
    }
}

#[test]
fn a_wall_thinner_than_a_cell_passes_no_light() {
    for thickness in [0.2, 0.02] {
        let scene = two_rooms(thickness);
        let asset = baked(&scene, 600).unwrap();
        assert!(asset.grid.as_ref().unwrap().cell_size > 2.0 * thickness);
        let lit = across(Vec2::new(-3.9, -1.9), Vec2::new(-0.2, 1.9), 40);
        let dark = across(Vec2::new(0.2, -1.9), Vec2::new(3.9, 1.9), 40);
        let bright = mean(&irradiance(&scene, &asset, &lit).unwrap().grid);
        let dark = irradiance(&scene, &asset, &dark).unwrap();
        let worst = dark.grid.iter().map(|e| e.max_element()).fold(0.0, f32::max) / bright;
        let (by_grid, by_brute) = (mean(&dark.grid) / bright, mean(&dark.brute) / bright);
        println!(
            "wall of {thickness} m: dark over lit {by_grid}, at worst {worst}; without occlusion {by_brute}"
        );
        assert!(by_grid < 1e-6 && worst < 1e-6, "{thickness} m: {by_grid} {worst}");
        // The negative control: without occlusion the wall passes much.
        assert!(by_brute > 0.15);
    }
}

/// Two rooms with a doorway of 0.9 x 2 m between them, whose door stands `degrees` open.
fn door(degrees: f32) -> Scene {
    let mut scene = Scene::default();
    add_room(&mut scene, Vec3::new(-4.0, 0.0, -2.0), Vec3::new(4.0, 3.0, 2.0), &matte(ALBEDO));
    let mut wall = |low: Vec3, high: Vec3| add(&mut scene, &slab(low, high), matte(ALBEDO));
    wall(Vec3::new(-0.05, 0.0, -2.0), Vec3::new(0.05, 3.0, -0.45));
    wall(Vec3::new(-0.05, 0.0, 0.45), Vec3::new(0.05, 3.0, 2.0));
    wall(Vec3::new(-0.05, 2.0, -0.45), Vec3::new(0.05, 3.0, 0.45));
    let leaf = slab(Vec3::new(0.01, 0.0, -0.45), Vec3::new(0.05, 2.0, 0.45));
    add(&mut scene, &turned(leaf, Vec3::new(0.05, 0.0, -0.45), degrees), matte(ALBEDO));
    scene.lights.push(point_light(Vec3::new(-1.5, 2.5, -1.2), 100.0));
    scene
}

#[test]
fn a_door_that_is_ajar_passes_as_much_as_in_truth() {
    let scene = door(10.0);
    let lit = across(Vec2::new(-3.9, -1.9), Vec2::new(-0.2, 1.9), 24);
    let dark = across(Vec2::new(0.5, -1.9), Vec2::new(3.9, 1.9), 24);
    let leak = leak("door ajar", &scene, 1000, [&lit, &dark]);
    assert!(leak.truth > 1e-3 && leak.truth < 0.2, "{}", leak.truth);
    assert!(leak.off() < 0.22, "{}", leak.off());
    assert!(leak.error < 0.5, "{}", leak.error);
    assert!(leak.leaky_off() > 0.22 && leak.leaky_error > 0.5, "the negative control");
}

/// A room of 4 x 3 x 4 m with a lamp, cd.
fn room(lamp: Vec3) -> Scene {
    let mut scene = Scene::default();
    add_room(&mut scene, Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 3.0, 2.0), &matte(ALBEDO));
    scene.lights.push(point_light(lamp, 100.0));
    scene
}

#[test]
fn the_floor_behind_a_pillar_is_as_dark_as_in_truth() {
    // The wall beside the lamp is most of the light.
    let mut scene = room(Vec3::new(-1.85, 1.0, 0.0));
    add(&mut scene, &slab(Vec3::new(-0.15, 0.0, -0.15), Vec3::new(0.15, 3.0, 0.15)), matte(ALBEDO));
    let lit = across(Vec2::new(0.2, -1.2), Vec2::new(0.5, -0.9), 16);
    let dark = across(Vec2::new(0.2, -0.12), Vec2::new(0.5, 0.12), 16);
    let leak = leak("pillar", &scene, 1000, [&lit, &dark]);
    assert!(leak.truth < 0.8, "{}", leak.truth);
    // The shadow is 0.3 m wide, and a pixel in it blends probes that reach as far: light is too bright at its edges.
    assert!(leak.off() < 0.08, "{}", leak.off());
    assert!(leak.error < 0.17, "{}", leak.error);
    assert!(leak.leaky_off() > 0.08 && leak.leaky_error > 0.17, "the negative control");
}

#[test]
fn the_floor_below_a_table_is_as_dark_as_in_truth() {
    let mut scene = room(Vec3::new(0.0, 2.2, 0.0));
    add(&mut scene, &slab(Vec3::new(-0.7, 0.71, -0.5), Vec3::new(0.7, 0.75, 0.5)), matte(ALBEDO));
    for (x, z) in [(-0.65, -0.45), (0.6, -0.45), (-0.65, 0.4), (0.6, 0.4)] {
        let leg = slab(Vec3::new(x, 0.0, z), Vec3::new(x + 0.05, 0.71, z + 0.05));
        add(&mut scene, &leg, matte(ALBEDO));
    }
    let lit = across(Vec2::new(1.2, -0.5), Vec2::new(1.8, 0.5), 16);
    let dark = across(Vec2::new(-0.5, -0.35), Vec2::new(0.5, 0.35), 16);
    let leak = leak("table", &scene, 1000, [&lit, &dark]);
    assert!(leak.truth < 0.6, "{}", leak.truth);
    assert!(leak.off() < 0.05, "{}", leak.off());
    assert!(leak.error < 0.05, "{}", leak.error);
    assert!(leak.leaky_off() > 0.05 && leak.leaky_error > 0.05, "the negative control");
}

/// A niche 0.25 m deep: the wall around it looks the same way, and must not lend it its light.
#[test]
fn the_back_of_a_niche_is_as_dark_as_in_truth() {
    let mut scene = room(Vec3::new(0.0, 2.6, 1.2));
    let mut wall = |low: Vec3, high: Vec3| add(&mut scene, &slab(low, high), matte(ALBEDO));
    wall(Vec3::new(-2.0, 0.0, -2.0), Vec3::new(-0.3, 3.0, -1.75));
    wall(Vec3::new(0.3, 0.0, -2.0), Vec3::new(2.0, 3.0, -1.75));
    wall(Vec3::new(-0.3, 0.0, -2.0), Vec3::new(0.3, 0.5, -1.75));
    wall(Vec3::new(-0.3, 1.5, -2.0), Vec3::new(0.3, 3.0, -1.75));
    let upright = |floor: Vec<Receiver>, z: f32| -> Vec<Receiver> {
        let turn = |r: &Receiver| receiver(Vec3::new(r.position.x, r.position.z, z), Vec3::Z);
        floor.iter().map(turn).collect()
    };
    let lit = upright(across(Vec2::new(0.4, 0.6), Vec2::new(1.0, 1.4), 16), -1.75);
    let dark = upright(across(Vec2::new(-0.25, 0.55), Vec2::new(0.25, 1.45), 16), -2.0);
    let leak = leak("niche", &scene, 1000, [&lit, &dark]);
    assert!(leak.truth < 0.85, "{}", leak.truth);
    assert!(leak.off() < 0.06, "{}", leak.off());
    assert!(leak.error < 0.09, "{}", leak.error);
    assert!(leak.leaky_off() > 0.06 && leak.leaky_error > 0.09, "the negative control");
}

#[test]
#[cfg_attr(not(has_scenes), ignore = "the scenes are neither in VLM_ASSETS nor in ../shared/assets")]
fn veach_ajar_is_as_bright_as_in_truth() {
    let file = GltfFile::open(&assets::find("scenes/veach_ajar.glb").unwrap()).unwrap();
    let scene = load(&file, &LoadOptions::default()).unwrap();
    let options = BakeOptions::preset(Preset::Game, scene.triangles.len());
    let asset = bake(&scene, &options, &Silent).unwrap().asset;
    let trace = TraceScene::new(&scene);
    // The front room gets all its light through the gap of the door; the back room holds the lamp.
    for (name, most_off, most_error) in [("front", 0.1, 0.35), ("back", 0.03, 0.04)] {
        let camera = scene.cameras.iter().find(|camera| camera.name == name).unwrap();
        let view = GBuffer::trace(&trace, camera, 64, 36);
        let truth = indirect_irradiance(&trace, &view.points, view.width, 1024, &Silent);
        let (found, _) = gather_by_grid(&trace, &asset, &view, &Silent).unwrap();
        let (brute, _) = gather_brute(&trace, &asset, &view, &Silent).unwrap();
        let (ratio, brute) = (mean(&found) / mean(&truth), mean(&brute) / mean(&truth));
        let error = relative_rmse(&found, &truth);
        println!(
            "veach_ajar, {name}: mean over the truth's {ratio}, {brute} without occlusion; relative RMSE {error}"
        );
        assert!((ratio - 1.0).abs() < most_off && error < most_error, "{ratio} {error}");
        if name == "front" {
            assert!(
                (ratio + 0.01 * brute - 1.0).abs() > most_off,
                "the negative control: a leak of a hundredth"
            );
        }
    }
}

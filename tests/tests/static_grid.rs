//! The static grid where its answer is known: lights that artists made, and no seams between cells.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;

use glam::{Vec2, Vec3};
use vlm_bake::render::LitScene;
use vlm_bake::scene::{AuthoredMesh, LoadOptions, Scene, load};
use vlm_bake::shade::TraceScene;
use vlm_format::{GltfFile, Probe, VlmAsset};
use vlm_shaders::cpu::gather::Receiver;
use vlm_shaders::cpu::gather_static::Frame;
use vlm_shaders::cpu::grid::leaf_at;
use vlm_tests::rooms::{across, add_room};
use vlm_tests::scenes::{add, matte, point_light, quad};

fn baked(scene: &Scene, lights: u32) -> VlmAsset {
    vlm_tests::rooms::baked(scene, lights).unwrap()
}

/// Irradiance (green) of receivers by the grid and by every light without occlusion.
fn irradiance(scene: &Scene, asset: &VlmAsset, receivers: &[Receiver]) -> (Vec<f32>, Vec<f32>) {
    let found = vlm_tests::rooms::irradiance(scene, asset, receivers).unwrap();
    let green = |values: Vec<Vec3>| values.into_iter().map(|e| e.y).collect();
    (green(found.grid), green(found.brute))
}

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

/// A floor of 8 x 8 m with a shining triangle 1 m above it, made by an artist, and perhaps a plate half-way.
fn made_light(plate: bool) -> Scene {
    let mut scene = Scene::default();
    let floor = quad(Vec3::new(-4.0, 0.0, -4.0), 8.0 * Vec3::Z, 8.0 * Vec3::X, 1);
    add(&mut scene, &floor, matte(Vec3::splat(0.5)));
    if plate {
        let half = Vec3::new(-1.0, 0.5, -4.0);
        let mut both = quad(half, 2.0 * Vec3::X, 8.0 * Vec3::Z, 1);
        both.append(quad(half, 8.0 * Vec3::Z, 2.0 * Vec3::X, 1));
        add(&mut scene, &both, matte(Vec3::splat(0.5)));
    }
    let corners = [Vec3::new(-0.3, 1.0, -0.3), Vec3::new(0.3, 1.0, -0.3), Vec3::new(0.0, 1.0, 0.4)];
    scene.authored.push(AuthoredMesh {
        positions: corners.to_vec(),
        triangles: vec![[0, 1, 2]],
        albedo: Some(vec![Vec3::ZERO]),
        emission: vec![Vec3::splat(100.0)],
        ..AuthoredMesh::default()
    });
    // A light that reaches nothing: all light on the floor is the triangle's.
    scene.lights.push(point_light(Vec3::new(0.0, -1.0, 0.0), 1.0));
    scene
}

/// The floor of [`made_light`] with its light just behind a ceiling at 1 m, as artists place them.
fn behind_a_ceiling() -> Scene {
    let mut scene = made_light(false);
    let ceiling = quad(Vec3::new(-4.0, 0.99, -4.0), 8.0 * Vec3::X, 8.0 * Vec3::Z, 1);
    add(&mut scene, &ceiling, matte(Vec3::splat(0.5)));
    scene
}

#[test]
fn a_light_behind_the_surface_that_it_stands_for_shines_through_it() {
    let scene = behind_a_ceiling();
    let receivers = across(Vec2::splat(-1.5), Vec2::splat(1.5), 16);
    let (by_grid, by_brute) = irradiance(&scene, &baked(&scene, 60), &receivers);
    let ratio = mean(&by_grid) / mean(&by_brute);
    assert!(mean(&by_brute) > 1.0 && (ratio - 1.0).abs() < 0.03, "{ratio}");
}

#[test]
fn a_light_that_an_artist_made_shines_and_is_hidden_by_what_stands_before_it() {
    let receivers = across(Vec2::splat(-1.5), Vec2::splat(1.5), 24);
    let open = made_light(false);
    let (by_grid, by_brute) = irradiance(&open, &baked(&open, 60), &receivers);
    let error: f32 = by_grid.iter().zip(&by_brute).map(|(a, b)| (a - b).powi(2)).sum();
    let relative = (error / by_brute.iter().map(|b| b * b).sum::<f32>()).sqrt();
    assert!(mean(&by_brute) > 1.0 && relative < 0.05, "{relative}");

    let hidden = made_light(true);
    let below = across(Vec2::new(-0.5, -0.5), Vec2::splat(0.5), 12);
    let (by_grid, by_brute) = irradiance(&hidden, &baked(&hidden, 60), &below);
    assert!(mean(&by_grid) < 1e-3 * mean(&by_brute), "{} {}", mean(&by_grid), mean(&by_brute));
}

fn cornell() -> (Scene, VlmAsset) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
    let scene = load(&GltfFile::open(&path).unwrap(), &LoadOptions::default()).unwrap();
    let asset = baked(&scene, 460);
    (scene, asset)
}

#[test]
fn one_receiver_gets_what_many_together_get() {
    let (scene, asset) = cornell();
    let trace = TraceScene::new(&scene);
    let lit = LitScene::new(&trace, &asset).unwrap();
    let grid = asset.grid.as_ref().unwrap();
    let arrived = lit.arrived(&trace, grid);
    let frame = Frame { grid, lights: &lit.lights, arrived: &arrived };
    let view = vlm_bake::gbuffer::GBuffer::trace(&trace, &scene.cameras[0], 48, 48);
    let (mut pairs, mut compared) = (0, 0);
    for point in view.points.iter().flatten() {
        let receiver = lit.receiver(point);
        let leaf = leaf_at(grid, receiver.position).unwrap();
        let (alone, together) = (frame.gather(&receiver), frame.gather_together(leaf, &[receiver])[0]);
        assert_eq!(alone.pairs, together.pairs);
        let scale = alone.irradiance.max_element().max(1e-3);
        assert!((alone.irradiance - together.irradiance).abs().max_element() < 1e-5 * scale);
        (pairs, compared) = (pairs + alone.pairs, compared + 1);
    }
    assert!(compared > 1000 && pairs > compared, "{pairs} pairs of {compared} points");
}

/// Of the steps at these places, the largest difference from the steps before and after, over the mean.
fn largest_seam(values: &[f32], places: &[usize]) -> f32 {
    let step = |i: usize| values[i + 1] - values[i];
    let seam = |&i: &usize| (step(i) - 0.5 * (step(i - 1) + step(i + 1))).abs();
    places.iter().map(seam).fold(0.0, f32::max) / mean(values)
}

#[test]
fn no_seam_shows_between_cells() {
    let (scene, asset) = cornell();
    let grid = asset.grid.as_ref().unwrap();
    let [low, high] = scene.bounds().unwrap().map(|p| p.as_vec3());
    // Along the ceiling, a tenth of a thousandth of the room a step.
    let count = 8000;
    let at = |i: i32| low.x + (high.x - low.x) * (0.02 + 0.96 * i as f32 / count as f32);
    let ceiling = |x: f32| Receiver {
        position: Vec3::new(x, high.y, high.z - 0.08 * (high.z - low.z)),
        normal: Vec3::NEG_Y,
        geometric_normal: Vec3::NEG_Y,
        tag: 0,
    };
    let path: Vec<Receiver> = (0..count).map(|i| ceiling(at(i))).collect();
    let leaves: Vec<Option<u32>> = path.iter().map(|r| leaf_at(grid, r.position)).collect();
    let borders: Vec<usize> = (2..count as usize - 2).filter(|&i| leaves[i] != leaves[i + 1]).collect();
    assert!(borders.len() > 4, "the path crosses cells");
    let (values, _) = irradiance(&scene, &asset, &path);
    let seam = largest_seam(&values, &borders);
    assert!(seam < 2e-4, "{seam}");
    // The negative control: a step of a thousandth of the light is seen.
    let stepped: Vec<f32> =
        values.iter().enumerate().map(|(i, v)| if i <= borders[2] { *v } else { 1.001 * v }).collect();
    assert!(largest_seam(&stepped, &borders) > 4e-4);
    let jump = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max) / mean(&values);
    assert!(jump < 5e-3, "{jump}");
}

/// In an empty room every probe reaches as far as the walls stand, and along them as far as in the open: no probe is a sliver.
#[test]
fn probes_reach_to_walls_and_along_them() {
    let (low, high) = (Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 3.0, 2.0));
    let mut scene = Scene::default();
    add_room(&mut scene, low, high, &matte(Vec3::splat(0.5)));
    scene.lights.push(point_light(Vec3::new(0.5, 2.0, 0.3), 100.0));
    let grid = baked(&scene, 600).grid.unwrap();
    let probes = &grid.probes[..grid.surface_probes as usize];
    let off = |probe: &Probe, low: Vec3, high: Vec3| {
        let open = probe.reach.iter().copied().fold(0.0, f32::max);
        let bitangent = probe.normal.cross(probe.tangent);
        let sides = [-probe.tangent, probe.tangent, -bitangent, bitangent];
        let misses = sides.iter().zip(probe.reach).map(|(side, reach)| {
            let ahead = Vec3::select(side.cmpge(Vec3::ZERO), high, low) - probe.position;
            (reach - ahead.dot(*side).min(open)).abs() / open
        });
        misses.fold(0.0, f32::max)
    };
    let cut = probes
        .iter()
        .filter(|probe| probe.reach.iter().any(|reach| *reach < 0.5 * probe.reach[0].max(probe.reach[1])));
    assert!(cut.count() > 50, "many stand by walls");
    let worst = |low, high| probes.iter().map(|probe| off(probe, low, high)).fold(0.0, f32::max);
    let found = worst(low, high);
    println!("{} probes, off by at most {found} of their reach", probes.len());
    assert!(found < 0.05, "{found}");
    assert!(worst(low, high - 0.3 * Vec3::Y) > 0.1, "the negative control: a lower ceiling");
}

//! Light for what moves: probes in free space where the answer is known, against the truth, along paths, and behind walls.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;

use glam::{DVec3, Vec3};
use vlm_bake::render::LitScene;
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_bake::shade::TraceScene;
use vlm_format::{GltfFile, Target, VlmAsset, read_vlm, write_vlm};
use vlm_shaders::cpu::gather::Receiver;
use vlm_tests::random::{plastic_point, sphere_direction, unit};
use vlm_tests::rooms::{
    add_room, baked, irradiance, is_free, mean, receiver, relative_rmse, truth, two_rooms,
};
use vlm_tests::scenes::glowing;

/// Random places of a box with random normals, outside of solids and no closer to surface than `room` metres.
fn random_receivers(scene: &Scene, [low, high]: [Vec3; 2], room: f32, count: usize) -> Vec<Receiver> {
    let trace = TraceScene::new(scene);
    let place = |i: u32| {
        let at = Vec3::from([0, 1, 2].map(|axis| unit(axis, u64::from(i))));
        receiver(low + at * (high - low), sphere_direction(plastic_point(i, (0.3, 0.7))))
    };
    (0..10_000).map(place).filter(|r| is_free(&trace, r.position, room)).take(count).collect()
}

fn cornell_path() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb")
}

/// The box with blocks, all of it a volume, and its bake.
fn cornell() -> (Scene, VlmAsset) {
    let mut scene = load(&GltfFile::open(&cornell_path()).unwrap(), &LoadOptions::default()).unwrap();
    scene.volumes = vec![scene.bounds().unwrap()];
    let asset = baked(&scene, 460).unwrap();
    (scene, asset)
}

fn corners(scene: &Scene) -> [Vec3; 2] {
    scene.volumes[0].map(|corner| corner.as_vec3())
}

#[test]
fn in_a_room_that_glows_every_normal_gets_the_same() {
    let mut scene = Scene::default();
    let (low, high) = (Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 3.0, 2.0));
    add_room(&mut scene, low, high, &glowing());
    scene.volumes = vec![[low.as_dvec3(), high.as_dvec3()]];
    let asset = baked(&scene, 460).unwrap();
    let receivers = random_receivers(&scene, [low, high], 0.01, 500);
    let free = irradiance(&scene, &asset, &receivers).unwrap().free;
    let worst = free.iter().map(|e| (*e - 1.0).abs().max_element()).fold(0.0, f32::max);
    println!("furnace: worst error {worst}");
    assert!(receivers.len() == 500 && worst < 0.03, "{worst}");
}

#[test]
fn light_in_free_space_is_near_the_truth() {
    let (scene, asset) = cornell();
    let grid = asset.grid.as_ref().unwrap();
    let free_probes = grid.probes.len() - grid.surface_probes as usize;
    assert!(free_probes > 100 && free_probes <= grid.surface_probes as usize / 2, "{free_probes}");
    let receivers = random_receivers(&scene, corners(&scene), 0.05, 200);
    let truth = truth(&scene, &receivers, 2048);
    let found = irradiance(&scene, &asset, &receivers).unwrap();
    let (error, brute) = (relative_rmse(&found.free, &truth), relative_rmse(&found.brute, &truth));
    let bias = mean(&found.free) / mean(&truth) - 1.0;
    println!(
        "cornell, {free_probes} probes: relative RMSE {error}, mean off by {bias}; without occlusion {brute}"
    );
    assert!(receivers.len() == 200 && error < 0.15, "{error}");
    assert!(bias.abs() < 0.05, "{bias}");
    // The negative control: receivers turned round are lit otherwise.
    let turned: Vec<Receiver> = receivers.iter().map(|r| receiver(r.position, -r.normal)).collect();
    let turned = irradiance(&scene, &asset, &turned).unwrap().free;
    assert!(relative_rmse(&turned, &truth) > 0.3);
}

fn largest_step(values: &[Vec3]) -> f32 {
    let step = |pair: &[Vec3]| (pair[1] - pair[0]).abs().max_element();
    values.windows(2).map(step).fold(0.0, f32::max)
}

/// The light of the probe in free space that is nearest to each receiver.
fn of_nearest_probe(scene: &Scene, asset: &VlmAsset, receivers: &[Receiver]) -> Vec<Vec3> {
    let trace = TraceScene::new(scene);
    let lit = LitScene::new(&trace, asset).unwrap();
    let grid = asset.grid.as_ref().unwrap();
    let arrived = lit.arrived(&trace, grid);
    let probes = &grid.probes[grid.surface_probes as usize..];
    let nearest = |r: &Receiver| {
        let away = |i: &usize| probes[*i].position.distance(r.position);
        let nearest = (0..probes.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap();
        arrived.free[nearest].irradiance(r.normal)
    };
    receivers.iter().map(nearest).collect()
}

#[test]
fn nothing_pops_on_the_way_through_a_volume() {
    let (scene, asset) = cornell();
    let [low, high] = corners(&scene);
    // One path over the blocks from corner to corner, one between the blocks and along the short one.
    let paths = [
        [Vec3::new(0.04, 0.93, 0.05), Vec3::new(0.96, 0.66, 0.95)],
        [Vec3::new(0.05, 0.15, 0.93), Vec3::new(0.97, 0.2, 0.93)],
    ];
    let normals = [Vec3::new(0.6, -0.8, 0.0), Vec3::new(-0.48, 0.6, 0.64)];
    // Of the mean light: a fifth above what is measured, and a tenth of the truth's own steps, or a fifth.
    for ((ends, normal), most) in paths.into_iter().zip(normals).zip([0.0037, 0.009]) {
        let [from, to] = ends.map(|at| low + at * (high - low));
        let count = 4000;
        let path: Vec<Receiver> =
            (0..count).map(|i| receiver(from.lerp(to, i as f32 / (count - 1) as f32), normal)).collect();
        let free = irradiance(&scene, &asset, &path).unwrap().free;
        let truth = truth(&scene, &path, 1024);
        let share = |values: &[Vec3]| largest_step(values) / mean(&truth);
        println!("path: largest step {} of the mean, the truth's {}", share(&free), share(&truth));
        assert!(share(&free) < most && most < 0.2 * share(&truth), "{} {most}", share(&free));
        // The negative controls: the nearest probe pops, and so does a step of a fiftieth.
        assert!(share(&of_nearest_probe(&scene, &asset, &path)) > most);
        let stepped = free.iter().enumerate().map(|(i, e)| if i < count / 2 { *e } else { *e * 1.02 });
        assert!(share(&stepped.collect::<Vec<_>>()) > most);
    }
}

#[test]
fn no_light_comes_through_a_thin_wall() {
    let mut scene = two_rooms(0.02);
    let [low, high] = scene.bounds().unwrap();
    scene.volumes = vec![[low, high]];
    let asset = baked(&scene, 600).unwrap();
    let room = |from: f32, to: f32| [Vec3::new(from, 0.0, -2.0), Vec3::new(to, 3.0, 2.0)];
    let lit = random_receivers(&scene, room(-4.0, 0.0), 0.01, 500);
    let mut dark = random_receivers(&scene, room(0.0, 4.0), 0.01, 500);
    // And all along the wall, two centimetres behind it.
    dark.extend(random_receivers(
        &scene,
        [Vec3::new(0.03, 0.02, -1.98), Vec3::new(0.031, 2.98, 1.98)],
        0.0,
        300,
    ));
    let bright = mean(&irradiance(&scene, &asset, &lit).unwrap().free);
    let found = irradiance(&scene, &asset, &dark).unwrap();
    let worst = found.free.iter().map(|e| e.max_element()).fold(0.0, f32::max);
    println!("two rooms: worst leak {}, without occlusion {}", worst / bright, mean(&found.brute) / bright);
    assert!(dark.len() == 800 && worst < 1e-3 * bright, "{}", worst / bright);
    assert!(mean(&found.brute) > 0.02 * bright, "the negative control");
}

#[test]
fn without_volumes_there_are_no_probes_in_free_space() {
    let (mut scene, with) = cornell();
    scene.volumes.clear();
    let asset = baked(&scene, 460).unwrap();
    let (grid, with) = (asset.grid.unwrap(), with.grid.unwrap());
    assert_eq!(grid.probes.len(), grid.surface_probes as usize);
    assert!(grid.leaves.windows(2).all(|pair| pair[0].free_probes == pair[1].probes));
    // Volumes change nothing on surface.
    assert_eq!(grid.surface_probes, with.surface_probes);
    assert_eq!(grid.probes, with.probes[..grid.probes.len()]);
}

#[test]
fn volumes_survive_the_file_and_pixels_outside_of_them_stay_sane() {
    let (mut scene, _) = cornell();
    let [low, high] = scene.volumes[0];
    scene.volumes = vec![[low + 0.6 * (high - low), low + 0.8 * (high - low)]];
    let asset = baked(&scene, 460).unwrap();
    let grid = asset.grid.as_ref().unwrap();
    let free = grid.surface_probes as usize..grid.probes.len();
    assert!(!free.is_empty() && free.clone().all(|probe| grid.near_of(probe).is_empty()));

    let file = GltfFile::open(&cornell_path()).unwrap();
    let written =
        write_vlm(&file, &asset, &Target::from_path(Path::new("cornell.vlm.glb")).unwrap()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    vlm_format::write_atomic(&written, folder.path()).unwrap();
    let read = read_vlm(&GltfFile::open(&folder.path().join("cornell.vlm.glb")).unwrap()).unwrap().unwrap();
    assert_eq!(read.grid.as_ref(), Some(grid));

    let room = (high - low).max_element();
    let around = [(low - 0.2 * room).as_vec3(), (high + 0.2 * room).as_vec3()];
    let anywhere: Vec<Receiver> = (0..2000)
        .map(|i| {
            let at = Vec3::from([0, 1, 2].map(|axis| unit(axis + 7, i)));
            receiver(around[0] + at * (around[1] - around[0]), sphere_direction((unit(20, i), unit(21, i))))
        })
        .chain([receiver(Vec3::splat(f32::NAN), Vec3::Y), receiver(Vec3::splat(1e30), Vec3::Y)])
        .collect();
    let found = irradiance(&scene, &asset, &anywhere).unwrap().free;
    assert!(found.iter().all(|e| e.is_finite() && e.min_element() >= 0.0));
    // Surface knows little of light from its own side: a few receivers that look at it may be black.
    let inside: Vec<Receiver> = random_receivers(&scene, [low, high].map(|c: DVec3| c.as_vec3()), 0.3, 200);
    let found = irradiance(&scene, &asset, &inside).unwrap().free;
    let black = found.iter().filter(|e| e.max_element() == 0.0).count();
    println!("outside of volumes: {black} of {} places are black", found.len());
    assert!(inside.len() == 200 && black <= 3, "{black} of 200 places of the room are black");
}

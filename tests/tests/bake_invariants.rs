//! What holds for every bake, checked anew from the asset alone: nothing here calls the code that it checks.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DMat3, DMat4, DVec3};
use vlm_bake::bake::{Bake, bake};
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_format::{GltfFile, Grid, VlmAsset};
use vlm_tests::assets;

/// A light in world space.
struct Light {
    corners: [DVec3; 3],
    normal: DVec3,
    tag: u32,
    /// Points on the visible surface and its normal there.
    samples: Vec<(DVec3, DVec3)>,
}

fn open(folder: &str, name: &str) -> Scene {
    let path = assets::find(folder).unwrap().join(name);
    load(&GltfFile::open(&path).unwrap(), &LoadOptions::default()).unwrap()
}

/// The preset `game` with at most so many lights: what holds does not depend on the number.
fn options(scene: &Scene, most_lights: u32) -> BakeOptions {
    let options = BakeOptions::preset(Preset::Game, scene.triangles.len());
    BakeOptions { lights: options.lights.min(most_lights), ..options }
}

fn lights(scene: &Scene, asset: &VlmAsset) -> Vec<Light> {
    let mut lights = Vec::new();
    for vlm in &asset.vlms {
        let object = scene.objects.iter().find(|o| o.node == vlm.node).unwrap();
        let world = object.world_from_node;
        for light in vlm.lights[0] as usize..(vlm.lights[0] + vlm.lights[1]) as usize {
            lights.push(world_light(asset, light, world));
        }
    }
    lights
}

fn world_light(asset: &VlmAsset, light: usize, world: DMat4) -> Light {
    let mut corners =
        asset.triangles[light].map(|v| world.transform_point3(asset.positions[v as usize].as_dvec3()));
    if world.determinant() < 0.0 {
        corners.swap(1, 2);
    }
    let normals = DMat3::from_mat4(world).inverse().transpose();
    let range = asset.sample_starts[light] as usize..asset.sample_starts[light + 1] as usize;
    let sample = |s: &vlm_format::Sample| {
        let normal = (normals * s.normal.as_dvec3()).normalize_or_zero();
        (world.transform_point3(s.position.as_dvec3()), normal)
    };
    Light {
        corners,
        normal: (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero(),
        tag: asset.tags.get(light).copied().unwrap_or(0),
        samples: asset.samples[range].iter().map(sample).collect(),
    }
}

/// Everything that is wrong with a bake, in words.
fn faults(scene: &Scene, Bake { asset, report }: &Bake) -> Vec<String> {
    let lights = lights(scene, asset);
    let mut faults = Vec::new();
    let mut check = |holds: bool, what: String| {
        if !holds {
            faults.push(what);
        }
    };
    check(!lights.is_empty(), "no lights".to_owned());
    check(report.lights == lights.len(), format!("{} lights reported, {} made", report.lights, lights.len()));
    let missed = report.lights.abs_diff(report.asked_lights as usize) * 20 > report.asked_lights as usize;
    let explained = !report.missed_because.is_empty();
    check(!missed || explained, format!("{} of {} lights, unexplained", report.lights, report.asked_lights));
    check(report.clearance.violations == 0, format!("{} violations reported", report.clearance.violations));
    check(
        asset.triangles.iter().flatten().all(|&v| (v as usize) < asset.positions.len()),
        "index".to_owned(),
    );
    let stretched = lights.iter().filter(|l| aspect(l.corners) > 100.1).count();
    check(stretched == 0, format!("{stretched} lights are thinner than 1:100"));
    let finite = asset.positions.iter().chain(&asset.albedo).chain(&asset.emission).all(|v| v.is_finite())
        && asset.samples.iter().all(|s| s.position.is_finite() && s.reflectance.is_finite());
    check(finite, "a number is not finite".to_owned());
    let lit = lights.iter().filter(|l| lights_itself(l)).count();
    check(lit == 0, format!("{lit} untagged lights light a point for which they stand"));
    let range = f64::from(asset.settings.range);
    let (extra, missing) = asset.grid.as_ref().map_or((0, 0), |grid| grid_errors(grid, &lights, range));
    check(extra == 0, format!("{extra} lights listed in cells that they do not reach"));
    check(missing == 0, format!("{missing} lights missing from cells that they reach"));
    faults
}

/// Longest edge over the height on it.
fn aspect([a, b, c]: [DVec3; 3]) -> f64 {
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    longest / (b - a).cross(c - a).length()
}

/// True if one of its own points lies in front of the light and sees it above its horizon.
fn lights_itself(light: &Light) -> bool {
    light.tag == 0
        && light.samples.iter().any(|&(x, n)| {
            let before = (x - light.corners[0]).dot(light.normal) > 0.0;
            before && light.corners.iter().any(|v| (*v - x).dot(n) > 0.0)
        })
}

/// True if every own point has the whole light below its horizon: what flat surfaces, however thin, must reach.
fn lies_behind(light: &Light) -> bool {
    light.samples.iter().all(|&(x, n)| light.corners.iter().all(|v| (*v - x).dot(n) < 0.0))
}

/// Wrong and missing entries: each stored cell against each light that it lists, some cells against all lights.
fn grid_errors(grid: &Grid, lights: &[Light], range: f64) -> (usize, usize) {
    let (mut extra, mut missing) = (0, 0);
    let stride = (grid.cells.len() / 50).max(1);
    for (i, ends) in grid.starts.windows(2).enumerate() {
        let list = &grid.entries[ends[0] as usize..ends[1] as usize];
        let cell = cell_box(grid, grid.cells[i]);
        extra += list.iter().filter(|&&l| !reaches(&lights[l as usize], cell, range, 1e-3)).count();
        if i % stride == 0 {
            let unlisted = (0..lights.len() as u32).filter(|l| list.binary_search(l).is_err());
            missing += unlisted.filter(|&l| reaches(&lights[l as usize], cell, range, -1e-3)).count();
        }
    }
    (extra, missing)
}

fn cell_box(grid: &Grid, number: u32) -> [DVec3; 2] {
    let [x, y, _] = grid.dimensions;
    let cell = DVec3::new(f64::from(number % x), f64::from(number / x % y), f64::from(number / x / y));
    let size = f64::from(grid.cell_size);
    let low = grid.origin.as_dvec3() + size * cell;
    [low, low + size]
}

/// The half ball in front of a light, `range` times as large as the light, touches the box; with a slack above 0 also where
/// it misses it by that share of its size, below 0 only where it overlaps by that.
fn reaches(light: &Light, [low, high]: [DVec3; 2], range: f64, slack: f64) -> bool {
    let centre = light.corners.iter().sum::<DVec3>() / 3.0;
    let radius = range * light.corners.iter().map(|v| v.distance(centre)).fold(0.0, f64::max);
    let nearest = centre.distance(centre.clamp(low, high));
    let highest = (0..8)
        .map(|i| DVec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low))
        .map(|corner| (corner - centre).dot(light.normal))
        .fold(f64::NEG_INFINITY, f64::max);
    nearest <= radius * (1.0 + slack) && highest > -slack * (high - low).x
}

fn check_folder(folder: &str, skip: &[&str], most_lights: u32) {
    let mut names: Vec<String> = std::fs::read_dir(assets::find(folder).unwrap())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".glb") && !skip.contains(&name.as_str()))
        .collect();
    names.sort();
    let mut all = Vec::new();
    for name in &names {
        let scene = open(folder, name);
        let baked = bake(&scene, &options(&scene, most_lights), &Silent).unwrap();
        all.extend(faults(&scene, &baked).into_iter().map(|fault| format!("{name}: {fault}")));
    }
    assert!(all.is_empty(), "{}", all.join("\n"));
}

#[test]
#[cfg_attr(not(has_scenes), ignore = "the scenes are neither in VLM_ASSETS nor in ../shared/assets")]
fn every_scene() {
    // Draco's is refused: `scene_assets.rs`.
    check_folder("scenes", &["sponza_draco_webp.glb"], 2000);
}

#[test]
#[cfg_attr(not(has_scenes), ignore = "the scenes are neither in VLM_ASSETS nor in ../shared/assets")]
fn every_object() {
    check_folder("objects", &[], 500);
}

#[test]
fn own_scenes() {
    check_folder(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets"), &[], 2000);
}

#[test]
fn a_light_that_is_pushed_forward_is_seen() {
    let scene = open(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets"), "cornell.glb");
    let baked = bake(&scene, &options(&scene, 460), &Silent).unwrap();
    // Only walls and blocks: every light lies behind all of its flat surface.
    let mut lights = lights(&scene, &baked.asset);
    assert!(lights.iter().all(lies_behind));
    let [low, high] = scene.bounds().unwrap();
    for light in &mut lights {
        let forward = 0.01 * (high - low).max_element() * light.normal;
        light.corners = light.corners.map(|v| v + forward);
    }
    assert!(!lights.iter().any(lies_behind));
}

#[test]
fn a_list_with_a_wrong_or_a_missing_light_is_seen() {
    let scene = open(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets"), "cornell.glb");
    let mut bake = bake(&scene, &options(&scene, 460), &Silent).unwrap();
    let lights = lights(&scene, &bake.asset);
    let range = f64::from(bake.asset.settings.range);
    let grid = bake.asset.grid.as_mut().unwrap();
    assert_eq!(grid_errors(grid, &lights, range), (0, 0));
    let (first, end) = (grid.starts[0] as usize, grid.starts[1] as usize);
    assert!(end - first < lights.len());
    let unlisted = (0..lights.len() as u32).find(|l| !grid.entries[first..end].contains(l)).unwrap();
    grid.entries[first] = unlisted;
    grid.entries[first..end].sort_unstable();
    let (extra, missing) = grid_errors(grid, &lights, range);
    assert_eq!(extra, 1);
    assert!(missing >= 1);
}

#[test]
#[cfg_attr(not(has_scenes), ignore = "the scenes are neither in VLM_ASSETS nor in ../shared/assets")]
fn the_number_of_threads_does_not_show() {
    let scene = open("scenes", "veach_ajar.glb");
    let bake_with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bake(&scene, &options(&scene, 2000), &Silent).unwrap().asset)
    };
    assert!(bake_with(1) == bake_with(2));
}

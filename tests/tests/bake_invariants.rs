//! What holds for every bake, checked anew from the asset alone: nothing here calls the code that it checks.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DMat3, DMat4, DVec3, IVec3, Vec3};
use vlm_bake::bake::{Bake, bake};
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_bake::shade::TraceScene;
use vlm_format::{GltfFile, Grid, Leaf, VlmAsset};
use vlm_shaders::cpu::grid::leaf_at;
use vlm_tests::assets;
use vlm_tests::random::fibonacci_direction;
use vlm_tests::rooms::two_rooms;

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
fn faults(scene: &Scene, Bake { asset, report, .. }: &Bake) -> Vec<String> {
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
    if let Some(grid) = &asset.grid {
        let [unserved, unsorted, bright, tagged] = grid_errors(grid, asset, &lights, scene);
        let [blank, unplaced] = volume_errors(grid, scene);
        check(blank == 0, format!("{blank} places of volumes without probes in free space"));
        check(unplaced == 0, format!("{unplaced} probes in free space outside of all volumes"));
        check(unserved == 0, format!("{unserved} places without probes"));
        check(unsorted == 0, format!("{unsorted} leaves whose probes do not ascend"));
        check(bright == 0, format!("{bright} probes that see more than a hemisphere"));
        check(tagged == 0, format!("{tagged} tagged lights among the near ones"));
    }
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

/// True for places that are seen from outside: under half of what they see are backs.
fn is_exposed(trace: &TraceScene<'_>, place: DVec3, normal: DVec3) -> bool {
    let origin = trace.bvh.leave(place.as_vec3(), normal.as_vec3());
    let above = (0..256).map(|i| fibonacci_direction(i, 256)).filter(|d| d.as_dvec3().dot(normal) > 0.0);
    let hits: Vec<_> = above.filter_map(|direction| trace.path_hit(origin, direction)).collect();
    2 * hits.iter().filter(|hit| !trace.is_lit_side(hit)).count() <= hits.len()
}

/// Places of the visible surface that no leaf's probes serve, leaves whose lists do not ascend, probes whose row gives more light than there
/// is, and near lights that are tagged.
fn grid_errors(grid: &Grid, asset: &VlmAsset, lights: &[Light], scene: &Scene) -> [usize; 4] {
    let served = |place: Vec3| {
        leaf_at(grid, place)
            .is_some_and(|leaf| grid.leaves[leaf as usize].probes < grid.leaves[leaf as usize + 1].probes)
    };
    let all = lights.iter().flat_map(|light| &light.samples);
    let unserved: Vec<_> = all.filter(|(place, _)| !served(place.as_vec3())).collect();
    let trace = (!unserved.is_empty()).then(|| TraceScene::new(scene));
    let unserved =
        trace.map_or(0, |trace| unserved.iter().filter(|(x, n)| is_exposed(&trace, *x, *n)).count());
    // Numbers of probes in free space are above all others, so the whole list ascends.
    let list = |leaf: &[Leaf]| &grid.leaf_probes[leaf[0].probes as usize..leaf[1].probes as usize];
    let unsorted = grid.leaves.windows(2).filter(|leaf| !list(leaf).is_sorted_by(|a, b| a < b)).count();
    let sum = |probe: usize| {
        grid.row(probe).map(|(_, weight)| weight as f32 * grid.probes[probe].row_scale).sum::<f32>()
    };
    let bright = (0..grid.probes.len()).filter(|&probe| sum(probe) > 1.02).count();
    let tag = |&near: &u32| asset.tags.get(near as usize).copied().unwrap_or(0);
    let tagged = grid.near.iter().filter(|near| tag(near) != 0).count();
    [unserved, unsorted, bright, tagged]
}

/// Places along each axis of a volume at which it is looked into.
const LOOKS: i32 = 9;

/// Places of volumes whose leaf lists no probe in free space, and probes in free space that lie in none of the volumes, but for a cell's room.
fn volume_errors(grid: &Grid, scene: &Scene) -> [usize; 2] {
    let places = |[low, high]: [DVec3; 2]| {
        (0..LOOKS.pow(3)).map(move |i| {
            let at = IVec3::new(i % LOOKS, i / LOOKS % LOOKS, i / LOOKS / LOOKS).as_dvec3() + 0.5;
            (low + at / f64::from(LOOKS) * (high - low)).as_vec3()
        })
    };
    let served = |place: Vec3| {
        leaf_at(grid, place).is_some_and(|leaf| {
            grid.leaves[leaf as usize].free_probes < grid.leaves[leaf as usize + 1].probes
        })
    };
    let blank = scene.volumes.iter().flat_map(|&volume| places(volume)).filter(|&p| !served(p)).count();
    let room = f64::from(grid.cell_size);
    let inside = |p: DVec3| {
        let within = |[low, high]: &[DVec3; 2]| p.cmpge(*low - room).all() && p.cmple(*high + room).all();
        scene.volumes.iter().any(within)
    };
    let free = &grid.probes[grid.surface_probes as usize..];
    [blank, free.iter().filter(|probe| !inside(probe.position.as_dvec3())).count()]
}

/// Two rooms parted by a thin wall, the second of which is a volume up to its walls.
fn with_volume() -> Scene {
    let mut scene = two_rooms(0.02);
    scene.volumes = vec![[DVec3::new(0.01, 0.0, -2.0), DVec3::new(4.0, 3.0, 2.0)]];
    scene
}

#[test]
fn a_scene_with_a_volume() {
    let scene = with_volume();
    let mut baked = bake(&scene, &options(&scene, 600), &Silent).unwrap();
    let grid = baked.asset.grid.as_ref().unwrap();
    assert!(grid.probes.len() > grid.surface_probes as usize + 50);
    assert_eq!(faults(&scene, &baked), Vec::<String>::new());

    // The negative controls: leaves that lost their probes in free space, and a probe that strayed.
    let whole = grid.clone();
    let spoilt = |spoil: &dyn Fn(&mut Grid)| {
        let mut grid = whole.clone();
        spoil(&mut grid);
        grid
    };
    let lost = spoilt(&|grid| {
        for leaf in 0..grid.leaves.len() - 1 {
            grid.leaves[leaf].free_probes = grid.leaves[leaf + 1].probes;
        }
    });
    assert!(volume_errors(&lost, &scene)[0] > 0);
    let strayed = spoilt(&|grid| grid.probes.last_mut().unwrap().position.x = -3.0);
    assert_eq!(volume_errors(&strayed, &scene), [0, 1]);
    let swapped = spoilt(&|grid| {
        let leaf = grid.leaves.windows(2).find(|leaf| leaf[1].probes > leaf[0].free_probes + 1).unwrap();
        grid.leaf_probes[leaf[0].free_probes as usize..leaf[1].probes as usize].reverse();
    });
    baked.asset.grid = Some(swapped);
    assert_eq!(faults(&scene, &baked).len(), 1, "one list does not ascend");
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
fn a_broken_grid_is_seen() {
    let scene = open(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets"), "cornell.glb");
    let mut asset = bake(&scene, &options(&scene, 460), &Silent).unwrap().asset;
    let lights = lights(&scene, &asset);
    let grid = asset.grid.take().unwrap();
    assert_eq!(grid_errors(&grid, &asset, &lights, &scene), [0; 4]);
    let spoilt = |spoil: &dyn Fn(&mut Grid)| {
        let mut grid = grid.clone();
        spoil(&mut grid);
        grid_errors(&grid, &asset, &lights, &scene)
    };
    assert!(spoilt(&|grid| grid.cells.fill(0))[0] > 0);
    assert!(spoilt(&|grid| grid.leaf_probes.reverse())[1] > 0);
    assert!(spoilt(&|grid| grid.probes.iter_mut().for_each(|probe| probe.row_scale *= 2.0))[2] > 0);
    let mut tagged = asset.clone();
    tagged.tags = vec![1; tagged.triangles.len()];
    assert!(grid_errors(&grid, &tagged, &lights, &scene)[3] > 0);
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

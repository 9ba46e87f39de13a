//! The static grid's passes on a GPU give what their mirrors on the processor give, stage by stage and one after the other.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::sync::LazyLock;

use glam::{DMat4, DVec3, Vec3, Vec4};
use vlm_bake::bake::bake;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::render::LitScene;
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_bake::shade::TraceScene;
use vlm_format::{GltfFile, Grid, VlmAsset};
use vlm_shaders::cpu::gather::Receiver;
use vlm_shaders::cpu::gather_static::Frame;
use vlm_shaders::cpu::grid::{blend, leaf_at};
use vlm_shaders::cpu::inject::{radiosity, reflect, source_radiosity, uncovered_radiosity};
use vlm_shaders::cpu::refresh::{Arrived, far_sources, refresh};
use vlm_shaders::cpu::upload::LightSet;
use vlm_tests::grid_gpu::GridPasses;
use vlm_tests::random::{plastic_point, sphere_direction, unit};
use vlm_tests::sample_asset::{quads, room};

/// Rounding of sums in another order and of fused multiplications, over the largest value.
const INJECT_BOUND: f32 = 1e-6;
/// Likewise; slopes take differences.
const REFRESH_BOUND: f32 = 1e-5;
/// Of a leaf's weights, which sum to 1.
const BLEND_BOUND: f32 = 1e-5;
/// Over the frame's mean, of all but [`GATHER_OUTLIERS`] of the pixels.
const GATHER_BOUND: f32 = 1e-4;
/// The share of pixels that may fall into another leaf, or see a light on the other side of the horizon.
const GATHER_OUTLIERS: f32 = 0.001;
/// Likewise of points in space, which lie on no surface, so that a leaf's border cuts more of them off.
const MOVING_OUTLIERS: f32 = 0.01;
/// Over the frame's mean, of every pixel.
const GATHER_WORST: f32 = 1e-2;

struct Baked {
    scene: Scene,
    asset: VlmAsset,
}

fn cornell_scene() -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
    load(&GltfFile::open(&path).unwrap(), &LoadOptions::default()).unwrap()
}

static CORNELL: LazyLock<Baked> = LazyLock::new(|| {
    let scene = cornell_scene();
    let options = BakeOptions::preset(Preset::Game, scene.triangles.len());
    let asset = bake(&scene, &options, &Silent).unwrap().asset;
    Baked { scene, asset }
});

fn passes() -> GridPasses {
    GridPasses::new().expect("a Vulkan adapter: VLM_REQUIRE_GPU is set or a driver is installed")
}

/// The lit Cornell box: its grid, its lights, and some 2,000 receivers that its camera sees.
fn in_cornell(check: impl FnOnce(&TraceScene, &LitScene, &Grid, &[Receiver])) {
    let trace = TraceScene::new(&CORNELL.scene);
    let lit = LitScene::new(&trace, &CORNELL.asset).unwrap();
    let view = GBuffer::trace(&trace, &CORNELL.scene.cameras[0], 48, 48);
    let receivers: Vec<Receiver> = view.points.iter().flatten().map(|point| lit.receiver(point)).collect();
    assert!(receivers.len() > 1800, "{} receivers", receivers.len());
    check(&trace, &lit, CORNELL.asset.grid.as_ref().unwrap(), &receivers);
}

/// Direct light at the samples, then at the pieces without a light.
fn direct(lights: &LightSet, grid: &Grid, irradiance: impl Fn(Vec3, Vec3) -> Vec3) -> Vec<Vec3> {
    let samples = lights.samples.iter().map(|s| irradiance(s.position, s.normal));
    samples.chain(grid.uncovered.iter().map(|p| irradiance(p.position, p.normal))).collect()
}

fn largest(values: &[Vec3]) -> f32 {
    values.iter().map(|v| v.abs().max_element()).fold(0.0, f32::max)
}

/// The largest difference over the largest value; infinite where lengths differ or something is not a number.
fn error(found: &[Vec3], expected: &[Vec3]) -> f32 {
    let differences: Vec<Vec3> = found.iter().zip(expected).map(|(a, b)| a - b).collect();
    let sound = found.len() == expected.len() && differences.iter().all(|d| d.is_finite());
    if sound { largest(&differences) / largest(expected).max(f32::MIN_POSITIVE) } else { f32::INFINITY }
}

/// The brightest value a thousandth brighter: a check that passes this sees nothing.
fn disturbed(values: &[Vec3]) -> Vec<Vec3> {
    let mut values = values.to_vec();
    let brightest = values.iter_mut().max_by(|a, b| a.max_element().total_cmp(&b.max_element())).unwrap();
    *brightest *= 1.001;
    values
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn inject_in_cornell() {
    in_cornell(|trace, lit, grid, _| {
        let passes = passes();
        let irradiance = |x, n| trace.direct_irradiance(x, n, n);
        let direct = direct(&lit.lights, grid, irradiance);
        let uploaded = passes.upload(grid, &lit.lights);
        let found = passes.inject(&uploaded, &direct).unwrap();
        let expected = lit.source_radiosity(trace, grid);
        let errors = [error(&found.lights, &lit.radiosity), error(&found.sources, &expected)];
        println!("inject: {errors:?} of {} sources", expected.len());
        assert!(errors.iter().all(|e| *e < INJECT_BOUND), "{errors:?}");
        let changed = passes.inject(&uploaded, &disturbed(&direct)).unwrap();
        assert!(error(&changed.sources, &expected) > INJECT_BOUND, "the check can fail");
    });
}

/// Lights that shine by themselves, and surface without any.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn inject_with_emission_and_uncovered_surface() {
    let (mut grid, lights) = hand_made();
    grid.surface_gains = (0..lights.len()).map(|light| 0.5 + light as f32).collect();
    grid.sample_shares = (0..lights.samples.len()).map(|sample| 0.2 + 0.3 * sample as f32).collect();
    grid.uncovered[0].emission = Vec3::new(4.0, 5.0, 6.0);
    let irradiance = |x: Vec3, n: Vec3| Vec3::new(1.0, 2.0, 3.0) + x + n;
    let reflected = reflect(&lights, irradiance);
    let expected =
        source_radiosity(&grid, &lights, &reflected, &uncovered_radiosity(&grid.uncovered, irradiance));
    let passes = passes();
    let uploaded = passes.upload(&grid, &lights);
    let found = passes.inject(&uploaded, &direct(&lights, &grid, irradiance)).unwrap();
    assert!(error(&found.sources, &expected) < INJECT_BOUND, "{found:?} {expected:?}");
    assert!(error(&found.lights, &radiosity(&lights, &reflected)) < INJECT_BOUND);
    grid.uncovered[0].emission.y += 0.1;
    let found = passes.inject(&passes.upload(&grid, &lights), &direct(&lights, &grid, irradiance)).unwrap();
    assert!(error(&found.sources, &expected) > INJECT_BOUND, "the check can fail");
}

/// Errors of the far light by normals, its slopes, and the near radiosities.
fn arrived_errors(found: &Arrived, expected: &Arrived) -> [f32; 3] {
    let by_normal = |a: &Arrived| a.far.iter().flat_map(|far| far.by_normal).collect::<Vec<_>>();
    let along = |a: &Arrived| a.far.iter().flat_map(|far| far.along).collect::<Vec<_>>();
    [
        error(&by_normal(found), &by_normal(expected)),
        error(&along(found), &along(expected)),
        error(&found.near, &expected.near),
    ]
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn refresh_in_cornell() {
    in_cornell(|trace, lit, grid, _| {
        let passes = passes();
        let radiosity = lit.source_radiosity(trace, grid);
        let expected = refresh(grid, &lit.lights, &far_sources(&lit.lights, &grid.uncovered), &radiosity);
        let uploaded = passes.upload(grid, &lit.lights);
        let errors = arrived_errors(&passes.refresh(&uploaded, &radiosity).unwrap(), &expected);
        println!("refresh: {errors:?} of {} probes, {} near", grid.probes.len(), grid.near.len());
        assert!(errors.iter().all(|e| *e < REFRESH_BOUND), "{errors:?}");
        let brighter: Vec<Vec3> = radiosity.iter().map(|b| b * 1.001).collect();
        let errors = arrived_errors(&passes.refresh(&uploaded, &brighter).unwrap(), &expected);
        assert!(errors.iter().all(|e| *e > REFRESH_BOUND), "the check can fail: {errors:?}");
    });
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn leaves_and_weights_in_cornell() {
    in_cornell(|_, lit, grid, receivers| {
        let passes = passes();
        let found = passes.places(&passes.upload(grid, &lit.lights), receivers).unwrap();
        let (mut worst, mut elsewhere, mut listed) = (0.0_f32, 0, 0);
        for (receiver, (leaf, weights)) in receivers.iter().zip(found) {
            if leaf != leaf_at(grid, receiver.position) {
                elsewhere += 1;
                continue;
            }
            let expected = blend(grid, leaf.unwrap(), receiver);
            assert_eq!((weights.first, weights.count), (expected.first, expected.count));
            let errors = weights.weights.iter().zip(expected.weights).map(|(a, b)| (a - b).abs());
            worst = errors.fold(worst, f32::max);
            assert!((weights.weights.iter().sum::<f32>() - 1.0).abs() < BLEND_BOUND);
            listed += expected.count;
        }
        println!("blend: {worst} over {listed} weights, {elsewhere} in another leaf");
        assert!(worst < BLEND_BOUND && listed as usize > receivers.len(), "{worst} {listed}");
        assert!((elsewhere as f32) < GATHER_OUTLIERS * receivers.len() as f32, "{elsewhere}");
        // The negative control: at another place, weights are others.
        let moved = Receiver { position: receivers[0].position + 1e-2, ..receivers[0] };
        let (_, weights) = passes.places(&passes.upload(grid, &lit.lights), &[moved]).unwrap()[0];
        let expected = blend(grid, leaf_at(grid, receivers[0].position).unwrap(), &receivers[0]);
        assert!(weights.weights.iter().zip(expected.weights).any(|(a, b)| (a - b).abs() > BLEND_BOUND));
    });
}

/// Differences of irradiance over the frame's mean, ascending, and how many pixels read other numbers of lights.
fn frame_errors(found: &[(Vec3, u64)], expected: &[(Vec3, u64)]) -> (Vec<f32>, usize) {
    let mean = expected.iter().map(|(e, _)| e.element_sum() / 3.0).sum::<f32>() / expected.len() as f32;
    let difference = |(a, b): (&(Vec3, u64), &(Vec3, u64))| (a.0 - b.0).abs().max_element() / mean;
    let mut errors: Vec<f32> = found.iter().zip(expected).map(difference).collect();
    errors.sort_unstable_by(f32::total_cmp);
    (errors, found.iter().zip(expected).filter(|(a, b)| a.1 != b.1).count())
}

/// Every stage after the other on the device, none of which sees a number of the processor's.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn a_whole_frame_in_cornell() {
    in_cornell(|trace, lit, grid, receivers| {
        let passes = passes();
        let uploaded = passes.upload(grid, &lit.lights);
        let direct = direct(&lit.lights, grid, |x, n| trace.direct_irradiance(x, n, n));
        let sources = passes.inject(&uploaded, &direct).unwrap().sources;
        let arrived = passes.refresh(&uploaded, &sources).unwrap();
        let on_device = |arrived: &Arrived| -> Vec<(Vec3, u64)> {
            let gathered = passes.gather(&uploaded, arrived, receivers).unwrap();
            gathered.iter().map(|g| (g.irradiance, g.pairs)).collect()
        };
        let mirrored = lit.arrived(trace, grid);
        let frame = Frame { grid, lights: &lit.lights, arrived: &mirrored };
        let expected: Vec<_> = receivers.iter().map(|r| frame.gather(r)).collect();
        let expected: Vec<(Vec3, u64)> = expected.iter().map(|g| (g.irradiance, g.pairs)).collect();
        assert!(expected.iter().all(|(e, _)| e.min_element() > 0.0), "light is everywhere");
        let pairs: u64 = expected.iter().map(|(_, pairs)| pairs).sum();
        assert!(pairs > receivers.len() as u64, "near lights count: {pairs}");

        let within = |errors: &[f32]| errors[((1.0 - GATHER_OUTLIERS) * errors.len() as f32) as usize];
        let (errors, other_pairs) = frame_errors(&on_device(&arrived), &expected);
        let (most, worst) = (within(&errors), errors[errors.len() - 1]);
        println!(
            "gather: {most} of 99.9 %, {worst} of all; {other_pairs} of {} differ in pairs",
            errors.len()
        );
        assert!(most < GATHER_BOUND && worst < GATHER_WORST, "{most} {worst}");
        assert!((other_pairs as f32) < GATHER_OUTLIERS * errors.len() as f32, "{other_pairs}");
        // The negative controls: near lights, or far ones, that are a hundredth brighter.
        let near = arrived.near.iter().map(|b| b * 1.01).collect();
        let (errors, _) = frame_errors(&on_device(&Arrived { near, ..arrived.clone() }), &expected);
        assert!(within(&errors) > GATHER_BOUND, "the check can fail");
        let mut far = arrived.clone();
        far.far.iter_mut().for_each(|far| far.by_normal[1] *= 1.01);
        assert!(within(&frame_errors(&on_device(&far), &expected).0) > GATHER_BOUND, "the check can fail");
    });
}

/// Points of an object that moves through the box and out of it.
fn moving(receivers: &[Receiver], low: Vec3, high: Vec3) -> Vec<Receiver> {
    let size = high - low;
    let moved = |(i, receiver): (usize, &Receiver)| {
        let normal = sphere_direction(plastic_point(i as u32, (0.3, 0.7)));
        let at = Vec3::from([0, 1, 2].map(|axis| unit(axis, i as u64)));
        let position = low - 0.2 * size + 1.4 * size * at;
        Receiver { position, normal, geometric_normal: normal, ..*receiver }
    };
    receivers.iter().enumerate().map(moved).collect()
}

/// The lower half of the box is a volume, so that other leaves hold surface alone.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn what_moves_in_cornell_and_around_it() {
    let mut scene = cornell_scene();
    let [low, high] = scene.bounds().unwrap();
    scene.volumes = vec![[low, DVec3::new(high.x, 0.5 * (low.y + high.y), high.z)]];
    let asset =
        bake(&scene, &BakeOptions::preset(Preset::Game, scene.triangles.len()), &Silent).unwrap().asset;
    let trace = TraceScene::new(&scene);
    let lit = LitScene::new(&trace, &asset).unwrap();
    let grid = asset.grid.as_ref().unwrap();
    let passes = passes();
    let uploaded = passes.upload(grid, &lit.lights);

    let mirrored = lit.arrived(&trace, grid);
    let arrived = passes.refresh(&uploaded, &lit.source_radiosity(&trace, grid)).unwrap();
    let coefficients = |a: &Arrived| -> Vec<Vec3> {
        a.free.iter().flat_map(|free| free.coefficients).map(Vec4::truncate).collect()
    };
    let refreshed = error(&coefficients(&arrived), &coefficients(&mirrored));
    assert!(mirrored.free.len() > 20 && refreshed < REFRESH_BOUND, "{refreshed} of {}", mirrored.free.len());
    let disturbed = disturbed(&coefficients(&arrived));
    assert!(error(&disturbed, &coefficients(&mirrored)) > REFRESH_BOUND, "the check can fail");

    let still = [Receiver { position: Vec3::ZERO, normal: Vec3::Y, geometric_normal: Vec3::Y, tag: 0 }; 4000];
    let receivers = moving(&still, low.as_vec3(), high.as_vec3());
    let frame = Frame { grid, lights: &lit.lights, arrived: &mirrored };
    let expected: Vec<_> =
        receivers.iter().map(|r| frame.gather_free(r)).map(|g| (g.irradiance, g.pairs)).collect();
    let on_device = |arrived: &Arrived| -> Vec<(Vec3, u64)> {
        let gathered = passes.gather_free(&uploaded, arrived, &receivers).unwrap();
        gathered.iter().map(|g| (g.irradiance, g.pairs)).collect()
    };
    let by_surface = expected.iter().filter(|(_, pairs)| *pairs > 0).count();
    assert!(by_surface > 100 && by_surface < 3000, "both kinds of leaves are asked: {by_surface}");
    let within = |errors: &[f32]| errors[((1.0 - MOVING_OUTLIERS) * errors.len() as f32) as usize];
    let (errors, _) = frame_errors(&on_device(&arrived), &expected);
    println!("moving: {} of 99 %, {} of all", within(&errors), errors[errors.len() - 1]);
    assert!(within(&errors) < GATHER_BOUND, "{}", within(&errors));
    // The negative controls: light in free space, or that of surface, that is a hundredth brighter.
    let mut brighter = arrived.clone();
    brighter.free.iter_mut().flat_map(|free| &mut free.coefficients).for_each(|c| *c *= 1.01);
    assert!(within(&frame_errors(&on_device(&brighter), &expected).0) > GATHER_BOUND, "the check can fail");
    let near = arrived.near.iter().map(|b| b * 1.01).collect();
    let (errors, _) = frame_errors(&on_device(&Arrived { near, ..arrived.clone() }), &expected);
    assert!(within(&errors) > GATHER_BOUND, "the check can fail");
}

/// Four lights over a grid of 2 x 3 x 4 cells of half a metre, one of them divided. Sizes are powers of two, so that quotients are exact
/// on every device.
fn hand_made() -> (Grid, LightSet) {
    let asset = quads(&room());
    let lights = LightSet::new(&asset, |_| DMat4::IDENTITY);
    let mut grid = asset.grid.unwrap();
    (grid.origin, grid.cell_size) = (Vec3::new(-1.0, 2.0, 0.0), 0.5);
    // The corner of the grid, the eighth of the group that divides its last cell.
    grid.cells[31] = 3;
    (grid, lights)
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn leaves_at_the_edges() {
    let (grid, lights) = hand_made();
    let (nan, far) = (f32::NAN, 1e30);
    let cases = [
        ("inside", [-0.25, 2.25, 0.25], Some(0)),
        ("in an empty cell", [-0.75, 2.25, 0.25], None),
        ("on a minimum face", [-0.25, 2.0, 0.25], Some(0)),
        ("where three minimum faces meet", [-0.5, 2.0, 0.0], Some(0)),
        ("on a maximum face", [0.0, 2.25, 0.25], Some(0)),
        ("on the maximum corner", [0.0, 3.5, 2.0], Some(1)),
        ("in a divided cell", [-0.4, 3.1, 1.6], Some(1)),
        ("in an empty eighth", [-0.1, 3.1, 1.6], None),
        ("before x", [-1.001, 2.25, 0.25], None),
        ("after x", [0.001, 2.25, 0.25], None),
        ("below", [-0.25, 1.999, 0.25], None),
        ("above", [-0.25, 3.501, 0.25], None),
        ("after z", [0.0, 3.5, 2.001], None),
        ("far away", [-0.25, far, 0.25], None),
        ("NaN x", [nan, 2.25, 0.25], None),
        ("NaN y", [-0.25, nan, 0.25], None),
        ("NaN z", [-0.25, 2.25, nan], None),
        ("infinite", [-0.25, 2.25, f32::INFINITY], None),
        ("minus infinite", [f32::NEG_INFINITY, 2.25, 0.25], None),
    ];
    let receiver = |x: [f32; 3]| Receiver {
        position: Vec3::from(x),
        normal: Vec3::Y,
        geometric_normal: Vec3::Y,
        tag: 0,
    };
    let receivers: Vec<Receiver> = cases.iter().map(|(_, x, _)| receiver(*x)).collect();
    let passes = passes();
    let found = passes.places(&passes.upload(&grid, &lights), &receivers).unwrap();
    for ((name, x, expected), (leaf, weights)) in cases.iter().zip(&found) {
        assert_eq!((*leaf, leaf_at(&grid, Vec3::from(*x))), (*expected, *expected), "{name}");
        assert_eq!(weights.count, u32::from(expected.is_some()), "{name}");
        let weight = if expected.is_some() { 1.0 } else { 0.0 };
        assert!((weights.weights[0] - weight).abs() < BLEND_BOUND, "{name}: {weights:?}");
    }
    // No light where there is no leaf, not even NaN; some where there is.
    let arrived = refresh(&grid, &lights, &far_sources(&lights, &grid.uncovered), &[Vec3::ONE; 9]);
    let gathered = passes.gather(&passes.upload(&grid, &lights), &arrived, &receivers).unwrap();
    for ((name, _, expected), gathered) in cases.iter().zip(gathered) {
        assert_eq!(gathered.irradiance.element_sum() > 0.0, expected.is_some(), "{name}: {gathered:?}");
        assert!(gathered.irradiance.is_finite(), "{name}");
    }
    // The negative control: in a grid of larger cells, leaves are others.
    let larger = Grid { cell_size: 1.0, ..grid.clone() };
    let others = passes.places(&passes.upload(&larger, &lights), &receivers).unwrap();
    assert!(others.iter().zip(&found).filter(|(a, b)| a.0 != b.0).count() > 3);
}

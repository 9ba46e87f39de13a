//! Stages of `vlm-runtime` against their mirrors: direct light, radiosity, lists of lights, and lights that move.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::sync::LazyLock;

use glam::{DMat4, DVec3, Vec3, Vec4};
use vlm_bake::bake::bake;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_bake::shade::TraceScene;
use vlm_format::GltfFile;
use vlm_runtime::{
    Frame, IrradianceFormat, MOST_LISTED, MovedNode, PunctualLight, Settings, Visibility, VlmAsset,
};
use vlm_shaders::cpu::direct::{Span, direct};
use vlm_shaders::cpu::gather::{Receiver, gather};
use vlm_shaders::cpu::gather_static::Frame as Gathering;
use vlm_shaders::cpu::inject::{radiosity, source_radiosity, uncovered_radiosity};
use vlm_shaders::cpu::refresh::{far_sources, refresh};
use vlm_shaders::cpu::upload::LightSet;
use vlm_tests::runtime_gpu::{Host, view};

/// Over the largest value: rounding in another order.
const BOUND: f32 = 2e-6;
/// Of a pixel over the frame's mean.
const PIXEL_BOUND: f32 = 1e-3;

struct Baked {
    scene: Scene,
    asset: VlmAsset,
    world_from_node: Vec<DMat4>,
}

static CORNELL: LazyLock<Baked> = LazyLock::new(|| {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
    let file = GltfFile::open(&path).unwrap();
    let scene = load(&file, &LoadOptions::default()).unwrap();
    let options = BakeOptions::preset(Preset::Draft, scene.triangles.len());
    let asset = bake(&scene, &options, &Silent).unwrap().asset;
    let world_from_node = file.world_from_nodes();
    Baked { scene, asset: VlmAsset::new(asset, world_from_node.clone()), world_from_node }
});

/// One of each kind.
fn lights() -> Vec<PunctualLight> {
    let spot = PunctualLight {
        direction: Vec3::new(0.0, -0.6, -0.8),
        ..PunctualLight::point(Vec3::new(0.1, 1.2, 0.5), Vec3::new(3.0, 9.0, 2.0))
    };
    vec![
        PunctualLight {
            range: 1.5,
            ..PunctualLight::point(Vec3::new(0.2, 1.0, 0.3), Vec3::new(5.0, 1.0, 2.0))
        },
        spot.with_cone(0.95, 0.7),
        PunctualLight::directional(Vec3::new(0.6, -0.8, 0.0), Vec3::new(0.5, 2.0, 1.0)),
    ]
}

/// The largest difference over the largest value.
fn error(found: &[Vec3], expected: &[Vec3]) -> f32 {
    let largest = expected.iter().map(|v| v.abs().max_element()).fold(0.0, f32::max);
    assert!(found.len() == expected.len() && largest > 0.0);
    let difference = |(a, b): (&Vec3, &Vec3)| (a - b).abs().max_element();
    found.iter().zip(expected).map(difference).fold(0.0, f32::max) / largest
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn direct_light_and_radiosity() {
    let asset = &CORNELL.asset;
    let mut host = Host::new(asset, Settings::default()).unwrap();
    let points = host.renderer.points().unwrap().to_vec();
    let lights = lights();
    let visibility: Vec<f32> = (0..lights.len() * points.len()).map(|i| (i % 5) as f32 / 4.0).collect();
    let mut run = |lights: &[PunctualLight]| -> (Vec<Vec3>, Vec<Vec3>) {
        let frame = Frame { lights, visibility: Visibility::Given(&visibility), ..Frame::default() };
        host.renderer.prepare(&host.queue, &frame).unwrap();
        let mut encoder = host.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        host.renderer.record_light(&mut encoder).unwrap();
        host.queue.submit([encoder.finish()]);
        let vectors = |all: Vec<Vec4>| all.into_iter().map(Vec4::truncate).collect();
        let irradiance = host.renderer.direct_irradiance(&host.queue).unwrap();
        (vectors(irradiance), vectors(host.renderer.radiosity(&host.queue).unwrap()))
    };
    let found = run(&lights);
    let mut expected = vec![Vec4::ZERO; points.len()];
    let all = [Span { first: 0, count: points.len() as u32 }];
    direct(&points, &lights, Some(&visibility), &all, &mut expected);
    let expected: Vec<Vec3> = expected.into_iter().map(Vec4::truncate).collect();
    let set = asset.lights();
    let reflected: Vec<Vec3> = set.samples.iter().zip(&expected).map(|(s, e)| s.reflectance * *e).collect();
    let errors = [error(&found.0, &expected), error(&found.1, &radiosity(set, &reflected))];
    println!("direct, inject: {errors:?}");
    assert!(errors.iter().all(|e| *e < BOUND), "{errors:?}");
    // The negative controls: each kind of light a ten-thousandth brighter.
    for changed in 0..lights.len() {
        let mut lights = lights.clone();
        lights[changed].intensity *= 1.0001;
        assert!(error(&run(&lights).0, &expected) > BOUND, "light {changed} counts");
    }
}

/// The list of a software device is not cut short.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn the_longest_list_is_whole() {
    let Baked { scene, asset, world_from_node } = &*CORNELL;
    let mut data = asset.data().clone();
    let light = data.triangles[0];
    data.vlms.truncate(1);
    data.grid = None;
    data.tags.clear();
    data.vlms[0].lights = [0, MOST_LISTED];
    data.triangles = vec![light; MOST_LISTED as usize];
    data.emission = vec![Vec3::ONE; MOST_LISTED as usize];
    data.samples.clear();
    data.sample_starts = vec![0; MOST_LISTED as usize + 1];
    let asset = VlmAsset::new(data.clone(), world_from_node.clone());
    let trace = TraceScene::new(scene);
    let camera = &scene.cameras[0];
    let gbuffer = GBuffer::trace(&trace, camera, 8, 8);
    let settings = Settings { count_pairs: true, format: IrradianceFormat::Float, ..Settings::default() };
    let mut host = Host::new(&asset, settings).unwrap();
    let pictures = host.upload(&gbuffer, camera, |_| 0);
    let (found, stats) =
        host.frame(&Frame { view: view(camera, &gbuffer, 1e-3), ..Frame::default() }, &pictures).unwrap();
    let seen = gbuffer.points.iter().flatten().count() as u64;
    assert_eq!(stats.pairs_evaluated, Some(seen * u64::from(MOST_LISTED)));
    let one = LightSet { geometry: asset.lights().geometry[..1].to_vec(), ..LightSet::default() };
    let expected: Vec<Vec3> = gbuffer
        .points
        .iter()
        .map(|p| {
            p.as_ref().map_or(Vec3::ZERO, |p| {
                gather(&one, &[Vec3::ONE], [0], &p.receiver(0)).irradiance * MOST_LISTED as f32
            })
        })
        .collect();
    let error = error(&found, &expected);
    assert!(error < 1e-4, "{error}");
    data.triangles.push(light);
    data.sample_starts.push(0);
    data.emission.push(Vec3::ONE);
    data.vlms[0].lights[1] += 1;
    let error = host.renderer.load(&VlmAsset::new(data, Vec::new())).unwrap_err();
    assert!(
        matches!(error, vlm_runtime::Error::Limit { needed, .. } if needed == u64::from(MOST_LISTED) + 1)
    );
}

/// What the mirrors say where some node moved: its lights summed one by one, all others through the grid.
fn moved_mirror(moved: &MovedNode, receivers: &[Option<Receiver>]) -> Vec<Vec3> {
    let data = CORNELL.asset.data();
    let place = |node: u32| {
        if node == moved.node { moved.world_from_node } else { CORNELL.world_from_node[node as usize] }
    };
    let lights = LightSet::new(data, place);
    let vlm = data.vlms.iter().find(|vlm| vlm.node == moved.node).unwrap();
    let list = vlm.lights[0]..vlm.lights[0] + vlm.lights[1];
    let mut grid = data.grid.clone().unwrap();
    list.clone().for_each(|light| grid.surface_gains[light as usize] = 0.0);
    let irradiance =
        |x: Vec3, n: Vec3| self::lights().iter().map(|light| light.irradiance(x, n)).sum::<Vec3>();
    let reflected: Vec<Vec3> =
        lights.samples.iter().map(|s| s.reflectance * irradiance(s.position, s.normal)).collect();
    let of_lights = radiosity(&lights, &reflected);
    let pieces = uncovered_radiosity(&grid.uncovered, irradiance);
    let sources = source_radiosity(&grid, &lights, &reflected, &pieces);
    let rest = CORNELL.asset.lights();
    let arrived = refresh(&grid, rest, &far_sources(rest, &grid.uncovered), &sources);
    let still = Gathering { grid: &grid, lights: &lights, arrived: &arrived };
    let at =
        |r: &Receiver| still.gather(r).irradiance + gather(&lights, &of_lights, list.clone(), r).irradiance;
    receivers.iter().map(|r| r.as_ref().map_or(Vec3::ZERO, at)).collect()
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn lights_go_with_their_nodes() {
    let Baked { scene, asset, world_from_node } = &*CORNELL;
    let trace = TraceScene::new(scene);
    let camera = &scene.cameras[0];
    let gbuffer = GBuffer::trace(&trace, camera, 32, 32);
    let settings = Settings { moving_nodes: true, format: IrradianceFormat::Float, ..Settings::default() };
    let mut host = Host::new(asset, settings).unwrap();
    let pictures = host.upload(&gbuffer, camera, |_| 0);
    let lights = lights();
    let frame = Frame { lights: &lights, view: view(camera, &gbuffer, 0.1), ..Frame::default() };
    let (rest, _) = host.frame(&frame, &pictures).unwrap();
    let node = asset.data().vlms.last().unwrap().node;
    let shift = DMat4::from_translation(DVec3::new(0.1, 0.2, 0.05)) * DMat4::from_rotation_y(0.2);
    let moved = [MovedNode { node, world_from_node: shift * world_from_node[node as usize] }];
    let (found, stats) = host.frame(&Frame { moved: &moved, ..frame }, &pictures).unwrap();
    let receivers: Vec<Option<Receiver>> =
        gbuffer.points.iter().map(|p| p.as_ref().map(|p| p.receiver(0))).collect();
    let expected = moved_mirror(&moved[0], &receivers);
    let mean = expected.iter().map(|e| e.element_sum() / 3.0).sum::<f32>() / expected.len() as f32;
    let far = |a: &[Vec3], b: &[Vec3]| {
        a.iter().zip(b).filter(|(a, b)| (**a - **b).abs().max_element() > PIXEL_BOUND * mean).count()
    };
    assert!(far(&found, &expected) * 100 < found.len(), "{}", far(&found, &expected));
    assert!(far(&rest, &expected) * 10 > found.len(), "the check can fail");
    assert!(
        stats.lights_injected > 0 && stats.lights_skipped.unchanged > 0,
        "only those that moved: {stats:?}"
    );
    let (again, stats) = host.frame(&Frame { moved: &moved, ..frame }, &pictures).unwrap();
    assert_eq!((again == found, &stats.passes[..], stats.bytes_uploaded), (true, &["gather"][..], 0));
    let (back, _) = host.frame(&frame, &pictures).unwrap();
    assert!(back == rest, "back at rest all is as it was");
}

/// Bright suns neither overflow nor band.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn a_sun_of_100_000_lx_fits_a_half() {
    let Baked { scene, asset, .. } = &*CORNELL;
    let trace = TraceScene::new(scene);
    let camera = &scene.cameras[0];
    let gbuffer = GBuffer::trace(&trace, camera, 16, 16);
    let frame_of = |format, exposure| {
        let mut host = Host::new(asset, Settings { format, ..Settings::default() }).unwrap();
        let pictures = host.upload(&gbuffer, camera, |_| 0);
        let sun = [PunctualLight::directional(Vec3::new(0.0, -0.6, -0.8), Vec3::splat(1e5))];
        let frame = Frame { lights: &sun, view: view(camera, &gbuffer, exposure), ..Frame::default() };
        host.frame(&frame, &pictures).unwrap().0
    };
    let (half, float) = (frame_of(IrradianceFormat::Half, 1e-4), frame_of(IrradianceFormat::Float, 1e-4));
    let brightest = float.iter().map(|e| e.max_element()).fold(0.0, f32::max);
    assert!(brightest > 1e4, "{brightest}");
    for (half, float) in half.iter().zip(&float) {
        let steps = (*half - *float).abs() / float.max(Vec3::splat(1.0));
        assert!(steps.max_element() < 1.0 / 1024.0, "{half} {float}");
    }
    let unexposed = frame_of(IrradianceFormat::Half, 10.0);
    assert!(unexposed.iter().all(|e| e.is_finite()), "held at the largest half");
    assert!(
        unexposed.iter().zip(&float).any(|(a, b)| a.x < 0.9 * b.x),
        "the check can fail: it did overflow"
    );
}

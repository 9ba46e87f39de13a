//! Shadow maps in `vlm-runtime`: their pass against its mirror, what is read again, and how far they lie from rays.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use glam::{Mat4, Vec3, Vec4};
use vlm_bake::options::Preset;
use vlm_bake::scene::Scene;
use vlm_bake::shade::TraceScene;
use vlm_runtime::view::{DrawnMap, MapRenderer, frusta};
use vlm_runtime::{Error, Frame, FrameStats, Point, PunctualLight, Settings, ShadowMap, Visibility};
use vlm_shaders::cpu::shadow::{Depths, ShadowHeader, shadow};
use vlm_tests::assets;
use vlm_tests::baked::Baked;
use vlm_tests::runtime_gpu::{Host, visibility};
use vlm_tests::shadow_maps::{RadiosityError, radiosity_error};

static CORNELL: LazyLock<Baked> =
    LazyLock::new(|| baked(&PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb")));

fn baked(path: &Path) -> Baked {
    Baked::open(path, Preset::Draft).unwrap()
}

/// A point light, a spot light and a sun that shines into the box, through which none of them is seen everywhere.
fn lights(scene: &Scene) -> Vec<PunctualLight> {
    let [low, high] = scene.bounds().unwrap().map(|v| v.as_vec3());
    let at = |x: f32, y: f32, z: f32| low + (high - low) * Vec3::new(x, y, z);
    let down = Vec3::new(0.1, -0.9, -0.3).normalize_or_zero();
    let spot = PunctualLight { direction: down, ..PunctualLight::point(at(0.5, 0.95, 0.6), Vec3::ONE) };
    vec![
        PunctualLight::point(at(0.5, 0.9, 0.5), Vec3::new(1.0, 2.0, 3.0)),
        spot.with_cone(0.9, 0.6),
        PunctualLight::directional(Vec3::new(0.3, -0.4, -0.866), Vec3::splat(2.0)),
    ]
}

fn record(host: &mut Host, frame: &Frame) -> FrameStats {
    host.renderer.prepare(&host.queue, frame).unwrap();
    let mut encoder = host.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let stats = host.renderer.record_light(&mut encoder).unwrap();
    host.queue.submit([encoder.finish()]);
    stats
}

fn shown(drawn: &[DrawnMap]) -> Vec<ShadowMap<'_>> {
    drawn.iter().map(|map| map.shadow_map(0)).collect()
}

/// The depths of a map, rows from the top.
fn depths(host: &Host, map: &DrawnMap) -> Vec<f32> {
    let size = map.texture.size();
    let back = host.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(4 * size.width * size.height),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * size.width), rows_per_image: None };
    let mut encoder = host.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let from =
        wgpu::TexelCopyTextureInfo { aspect: wgpu::TextureAspect::DepthOnly, ..map.texture.as_image_copy() };
    encoder.copy_texture_to_buffer(from, wgpu::TexelCopyBufferInfo { buffer: &back, layout }, size);
    host.queue.submit([encoder.finish()]);
    back.map_async(wgpu::MapMode::Read, .., |_| {});
    host.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: None }).unwrap();
    bytemuck::pod_collect_to_vec(&back.get_mapped_range(..).unwrap())
}

/// The mirror of all maps: the last first.
fn mirror(
    host: &Host,
    drawn: &[DrawnMap],
    lights: &[PunctualLight],
    points: &[Point],
    offset: f32,
) -> Vec<f32> {
    let mut visibility = vec![1.0; lights.len() * points.len()];
    for map in drawn.iter().rev() {
        let light = &lights[map.frustum.light as usize];
        let header = ShadowHeader {
            clip_from_world: map.frustum.clip_from_world.as_mat4(),
            light: if light.directional {
                (-light.direction).extend(0.0)
            } else {
                light.position.extend(1.0)
            },
            normal_offset: offset,
            depth_bias: 1e-3,
            is_reversed: u32::from(map.frustum.is_reversed),
            first: map.frustum.light * points.len() as u32,
            point_count: points.len() as u32,
            ..ShadowHeader::default()
        };
        let size = [map.texture.width(), map.texture.height()];
        shadow(&header, points, Depths { size, depths: &depths(host, map) }, &mut visibility);
    }
    visibility
}

/// Where a tap's depth or texel lies within rounding of another, a share differs: few do.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn the_pass_is_its_mirror() {
    let Baked { scene, asset, .. } = &*CORNELL;
    let mut host = Host::new(asset, Settings::default()).unwrap();
    let points = host.renderer.points().unwrap().to_vec();
    let lights = lights(scene);
    let drawn = MapRenderer::new(&host.device, &host.queue, scene).draw(&frusta(scene, &lights), 256);
    assert_eq!(drawn.len(), 8, "six sides, a cone and a box");
    let maps = shown(&drawn);
    let frame = Frame { lights: &lights, visibility: Visibility::Maps(&maps), ..Frame::default() };
    let stats = record(&mut host, &frame);
    assert_eq!((&stats.passes[..2], stats.shadow_maps), (&["shadow", "direct"][..], 8));
    let found = host.renderer.visibility(&host.queue).unwrap();
    let expected = mirror(&host, &drawn, &lights, &points, 2.0);
    assert_eq!(found.len(), expected.len());
    let differ = |a: &[f32], b: &[f32]| {
        a.iter().zip(b).filter(|(a, b)| (**a - **b).abs() > 1e-3).count() as f32 / a.len() as f32
    };
    for (number, (found, expected)) in
        found.chunks(points.len()).zip(expected.chunks(points.len())).enumerate()
    {
        let partly = expected.iter().filter(|seen| **seen > 0.0 && **seen < 1.0).count();
        let hidden = expected.iter().filter(|seen| **seen == 0.0).count();
        println!("light {number}: {partly} partly, {hidden} hidden, {} differ", differ(found, expected));
        assert!(partly > 5 && hidden > 50, "light {number} casts shadows: {partly} {hidden}");
        assert!(differ(found, expected) < 0.002, "light {number}");
    }
    // The negative control: another offset.
    assert!(differ(&found, &mirror(&host, &drawn, &lights, &points, 3.0)) > 0.002, "the check can fail");
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn only_maps_that_changed_are_read_again() {
    let Baked { scene, asset, .. } = &*CORNELL;
    let mut host = Host::new(asset, Settings::default()).unwrap();
    let lights = lights(scene);
    let drawn = MapRenderer::new(&host.device, &host.queue, scene).draw(&frusta(scene, &lights), 128);
    let mut maps = shown(&drawn);
    let mut read = |lights: &[PunctualLight], maps: &[ShadowMap]| {
        let stats =
            record(&mut host, &Frame { lights, visibility: Visibility::Maps(maps), ..Frame::default() });
        (stats.shadow_maps, stats.passes.len(), stats.bytes_uploaded)
    };
    assert_eq!(read(&lights, &maps).0, 8);
    assert_eq!(read(&lights, &maps), (0, 0, 0), "the same maps");
    maps[7].revision = 1;
    assert_eq!((maps[7].light, read(&lights, &maps).0), (2, 1), "drawn anew: the sun's own");
    maps[2].revision = 1;
    assert_eq!(read(&lights, &maps).0, 6, "a side of a cube: all its sides, since they share a row");
    maps[6].clip_from_world = Mat4::from_scale(Vec3::new(1.0, 1.0, 0.999)) * maps[6].clip_from_world;
    assert_eq!(read(&lights, &maps).0, 1, "another place");
    let brighter: Vec<PunctualLight> =
        lights.iter().map(|l| PunctualLight { intensity: 2.0 * l.intensity, ..*l }).collect();
    assert_eq!(read(&brighter, &maps).0, 0, "brightness casts no shadow");
    // A light without a map is seen by all points; with it again, by few.
    let (few, all) = (maps[..7].to_vec(), maps.clone());
    assert_eq!(read(&brighter, &few).0, 0);
    let points = host.renderer.points().unwrap().len();
    let of_sun = |host: &Host| host.renderer.visibility(&host.queue).unwrap()[2 * points..].to_vec();
    assert!(of_sun(&host).iter().all(|seen| *seen == 1.0));
    let mut frame = Frame { lights: &brighter, visibility: Visibility::Maps(&all), ..Frame::default() };
    assert_eq!(record(&mut host, &frame).shadow_maps, 1);
    assert!(of_sun(&host).contains(&0.0));
    // What the host gives takes the place of the maps, and they of that.
    let given = vec![0.5; 3 * points];
    frame.visibility = Visibility::Given(&given);
    let stats = record(&mut host, &frame);
    assert_eq!((stats.shadow_maps, stats.passes[0]), (0, "direct"));
    assert_eq!(host.renderer.visibility(&host.queue).unwrap(), given);
    frame.visibility = Visibility::Maps(&all);
    assert_eq!(record(&mut host, &frame).shadow_maps, 8);
    frame.visibility = Visibility::Kept;
    assert_eq!(record(&mut host, &frame).passes.len(), 0);
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn maps_that_cannot_be_read() {
    let Baked { scene, asset, .. } = &*CORNELL;
    let mut host = Host::new(asset, Settings::default()).unwrap();
    let lights = lights(scene);
    let drawn = MapRenderer::new(&host.device, &host.queue, scene).draw(&frusta(scene, &lights)[..1], 16);
    let good = drawn[0].shadow_map(0);
    let tags = host.texture([4, 4], wgpu::TextureFormat::R32Uint, &[0; 64]);
    let mut refused = |map: ShadowMap| {
        let maps = [map];
        let frame = Frame { lights: &lights, visibility: Visibility::Maps(&maps), ..Frame::default() };
        host.renderer.prepare(&host.queue, &frame).unwrap_err()
    };
    let error = refused(ShadowMap { light: 3, ..good });
    assert_eq!(error.to_string(), "shadow map 0 is of light 3, but the frame has 3 lights");
    let error = refused(ShadowMap { depth_bias: f32::NAN, ..good });
    assert!(matches!(error, Error::NotFinite { .. }), "{error:?}");
    let error = refused(ShadowMap { clip_from_world: Mat4::NAN, ..good });
    assert!(matches!(error, Error::NotFinite { .. }), "{error:?}");
    let error = refused(ShadowMap { depth: &tags, ..good });
    assert!(matches!(error, Error::Target { what: "shadow map", .. }), "{error:?}");
}

/// The error of the lights' radiosity by maps of this size against that by rays, and that without any shadows.
fn errors(Baked { scene, asset, .. }: &Baked, size: u32) -> [RadiosityError; 2] {
    let trace = TraceScene::new(scene);
    let mut host = Host::new(asset, Settings::default()).unwrap();
    let seen = visibility(&trace, host.renderer.points().unwrap());
    let drawn = MapRenderer::new(&host.device, &host.queue, scene).draw(&frusta(scene, &trace.lights), size);
    let maps = shown(&drawn);
    let mut radiosity = |visibility| -> Vec<Vec4> {
        record(&mut host, &Frame { lights: &trace.lights, visibility, ..Frame::default() });
        host.renderer.radiosity(&host.queue).unwrap()
    };
    let unshadowed = radiosity(Visibility::Kept);
    let by_rays = radiosity(Visibility::Given(&seen));
    let by_maps = radiosity(Visibility::Maps(&maps));
    let areas: Vec<f64> = asset.lights().geometry.iter().map(|light| f64::from(light.area())).collect();
    [by_maps, unshadowed].map(|found| radiosity_error(&areas, &found, &by_rays).unwrap())
}

/// What a scene's maps of this size may err by.
fn check(baked: &Baked, size: u32, bound: f64) {
    let [maps, none] = errors(baked, size);
    println!("{size}: maps {maps:?}, no shadows {none:?}");
    assert!(maps.relative_rmse < bound && maps.energy.abs() < bound, "{maps:?}");
    assert!(none.relative_rmse > bound, "the check can fail: {none:?}");
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn maps_against_rays_in_cornell() {
    check(&CORNELL, 1024, 0.05);
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
#[cfg_attr(not(has_scenes), ignore = "the scenes are neither in VLM_ASSETS nor in ../shared/assets")]
fn maps_against_rays_in_sponza() {
    let Some(path) = assets::find("scenes/sponza.glb") else { return };
    check(&baked(&path), 1024, 0.2);
}

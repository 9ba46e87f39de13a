//! Every way in which `vlm-runtime` refuses, by type.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DMat4, Vec3};
use vlm_format::{Container, EXTENSION, GltfFile, Target, write_vlm};
use vlm_runtime::{
    Error, Frame, MOST_REAL_LIGHTS, MovedNode, PunctualLight, Settings, Targets, View, Visibility, VlmAsset,
    VlmRenderer, check_limits, request_device,
};
use vlm_tests::runtime_gpu::Host;
use vlm_tests::sample_asset::{quads, room};
use wgpu::TextureFormat;

/// The sample asset as a file.
fn file() -> Vec<u8> {
    let target = Target { container: Container::Gltf { embedded: true }, file_name: "room.gltf".to_owned() };
    let room = room();
    write_vlm(&room, &quads(&room), &target).unwrap().swap_remove(0).bytes
}

fn asset() -> VlmAsset {
    VlmAsset::from_slice(&file(), "room.gltf", None).unwrap()
}

fn host(settings: Settings) -> Host {
    Host::new(&asset(), settings).unwrap()
}

#[test]
fn files() {
    let missing = VlmAsset::open("no such file.glb".as_ref());
    assert!(matches!(missing, Err(Error::Format(vlm_format::Error::Io { .. }))), "{missing:?}");
    let torn = VlmAsset::from_slice(&file()[..200], "room.gltf", None);
    assert!(matches!(torn, Err(Error::Format(vlm_format::Error::Invalid { .. }))), "{torn:?}");
    let unbaked = VlmAsset::from_file(&room());
    assert!(matches!(&unbaked, Err(Error::NoLights { file }) if file == "room.gltf"), "{unbaked:?}");
    let mut json: serde_json::Value = serde_json::from_slice(&file()).unwrap();
    json["nodes"][1]["translation"] = serde_json::json!([2, 0, 0]);
    let stale = VlmAsset::from_slice(json.to_string().as_bytes(), "room.gltf", None).unwrap_err();
    assert!(matches!(&stale, Error::Stale { stale, .. } if !stale.is_empty()), "{stale:?}");
    assert!(stale.to_string().contains("room.gltf"), "{stale}");
    json["nodes"][1]["translation"] = serde_json::json!([1, 0, 0]);
    assert!(VlmAsset::from_slice(json.to_string().as_bytes(), "room.gltf", None).is_ok(), "{EXTENSION}");
    assert!(GltfFile::from_slice(&file(), "room.gltf", None).is_ok());
}

#[test]
fn no_adapter() {
    let none = request_device(wgpu::Backends::empty());
    assert!(matches!(none, Err(Error::NoAdapter(_))), "{:?}", none.err());
}

#[test]
fn limits_are_named_with_their_numbers() {
    assert!(check_limits(&wgpu::Limits::default()).is_ok());
    let few = wgpu::Limits { max_storage_buffers_per_shader_stage: 4, ..wgpu::Limits::default() };
    let error = check_limits(&few).unwrap_err();
    assert!(matches!(error, Error::Limit { needed: 8, limit: 4, .. }), "{error:?}");
    let text = error.to_string();
    assert!(text.contains("4 more") && text.contains("max_storage_buffers_per_shader_stage"), "{text}");
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn an_asset_too_large_leaves_the_last_one() {
    let mut host = host(Settings::default());
    let points = host.renderer.points().unwrap().len();
    let mut data = asset().data().clone();
    // 128 MiB and a little, of 96 bytes each.
    data.triangles = vec![[0, 1, 2]; (128 << 20) / 96 + 1];
    let error = host.renderer.load(&VlmAsset::new(data, Vec::new())).unwrap_err();
    let Error::Limit { what, needed, limit, .. } = &error else { panic!("{error:?}") };
    assert!(what.contains("lights") && needed > limit, "{error}");
    assert_eq!(host.renderer.points().unwrap().len(), points, "the last one stays");
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn order() {
    let (device, queue) = request_device(wgpu::Backends::VULKAN).unwrap();
    let mut renderer = VlmRenderer::new(&device, Settings::default()).unwrap();
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    assert!(matches!(renderer.prepare(&queue, &Frame::default()), Err(Error::NotLoaded)));
    assert!(matches!(renderer.record_light(&mut encoder), Err(Error::NotLoaded)));
    assert!(matches!(renderer.points(), Err(Error::NotLoaded)));
    renderer.load(&asset()).unwrap();
    assert!(matches!(renderer.record_light(&mut encoder), Err(Error::NotPrepared)));
    assert!(matches!(renderer.pairs_evaluated(&queue), Err(Error::CountingOff)));
    renderer.prepare(&queue, &Frame::default()).unwrap();
    assert_eq!(renderer.record_light(&mut encoder).unwrap().passes[..1], ["inject"]);
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn frames() {
    let mut host = host(Settings::default());
    let points = host.renderer.points().unwrap().len();
    let sun = PunctualLight::directional(-Vec3::Y, Vec3::ONE);
    let mut refused = |frame: Frame| host.renderer.prepare(&host.queue, &frame).unwrap_err();
    let short = refused(Frame { lights: &[sun], visibility: Visibility::Given(&[1.0]), ..Frame::default() });
    assert!(matches!(short, Error::VisibilityLength { found: 1, lights: 1, .. }), "{short:?}");
    let moved = [MovedNode { node: 1, world_from_node: DMat4::IDENTITY }];
    assert!(matches!(refused(Frame { moved: &moved, ..Frame::default() }), Error::MovingOff));
    let broken = PunctualLight { intensity: Vec3::NAN, ..sun };
    let error = refused(Frame { lights: &[sun, broken], ..Frame::default() });
    assert_eq!(error.to_string(), "light 1 is not finite");
    let view = View { exposure: f32::INFINITY, ..View::default() };
    assert!(matches!(refused(Frame { view, ..Frame::default() }), Error::NotFinite { .. }));
    let many = vec![sun; MOST_REAL_LIGHTS as usize + 1];
    assert!(matches!(refused(Frame { lights: &many, ..Frame::default() }), Error::Limit { needed: 513, .. }));
    // As many as before, but one light more than visibility was given for.
    let seen = vec![1.0; points];
    let frame = Frame { lights: &[sun], visibility: Visibility::Given(&seen), ..Frame::default() };
    host.renderer.prepare(&host.queue, &frame).unwrap();
    let more = host.renderer.prepare(&host.queue, &Frame { lights: &[sun, sun], ..Frame::default() });
    assert!(matches!(more, Err(Error::VisibilityLength { lights: 2, .. })), "{more:?}");

    let mut host = self::host(Settings { moving_nodes: true, ..Settings::default() });
    let moved = [MovedNode { node: 77, world_from_node: DMat4::IDENTITY }];
    let error = host.renderer.prepare(&host.queue, &Frame { moved: &moved, ..Frame::default() });
    assert!(matches!(error, Err(Error::UnknownNode { node: 77 })), "{error:?}");
}

/// A refused frame leaves nothing half taken: the next one writes what it would have written.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn visibility_too_large_for_the_device() {
    let points = 70_000;
    let mut data = asset().data().clone();
    data.grid = None;
    data.samples = vec![data.samples[0]; points];
    data.sample_starts = vec![0; data.triangles.len()];
    data.sample_starts.push(points as u32);
    let mut host = Host::new(&VlmAsset::new(data, Vec::new()), Settings::default()).unwrap();
    let suns = vec![PunctualLight::directional(-Vec3::Y, Vec3::ONE); MOST_REAL_LIGHTS as usize];
    let seen = vec![0.5; suns.len() * points];
    let frame = Frame { lights: &suns, visibility: Visibility::Given(&seen), ..Frame::default() };
    let error = host.renderer.prepare(&host.queue, &frame).unwrap_err();
    assert!(matches!(&error, Error::Limit { what, .. } if what.contains("visibility")), "{error:?}");
    let fewer =
        Frame { lights: &suns[..1], visibility: Visibility::Given(&seen[..points]), ..Frame::default() };
    host.renderer.prepare(&host.queue, &fewer).unwrap();
    let mut encoder = host.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let stats = host.renderer.record_light(&mut encoder).unwrap();
    assert!(stats.bytes_uploaded > 4 * points as u64 && stats.passes[..1] == ["direct"], "{stats:?}");
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn textures() {
    let mut host = host(Settings::default());
    host.renderer.prepare(&host.queue, &Frame::default()).unwrap();
    let depth = host.texture([4, 4], TextureFormat::R32Float, &[0; 64]);
    let normal = host.texture([4, 4], TextureFormat::Rgba32Float, &[0; 256]);
    let small = host.texture([2, 4], TextureFormat::R32Float, &[0; 32]);
    let tag = host.texture([4, 4], TextureFormat::R32Uint, &[0; 64]);
    let view = |format| host.target([4, 4], format).create_view(&wgpu::TextureViewDescriptor::default());
    let (half, float) = (view(TextureFormat::Rgba16Float), view(TextureFormat::Rgba32Float));
    let good = Targets {
        depth: &depth,
        normal: &normal,
        geometric_normal: None,
        tag: None,
        moving: None,
        irradiance: &half,
    };
    let mut record = |targets: Targets| {
        let mut encoder = host.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        host.renderer.record(&mut encoder, &targets)
    };
    for (name, targets) in [
        ("irradiance", Targets { irradiance: &float, ..good }),
        ("depth", Targets { depth: &small, ..good }),
        ("normal", Targets { normal: &tag, ..good }),
        ("tag", Targets { tag: Some(&normal), ..good }),
        ("moving", Targets { moving: Some(&depth), ..good }),
    ] {
        let error = record(targets).unwrap_err();
        assert!(matches!(&error, Error::Target { what, .. } if *what == name), "{name}: {error:?}");
    }
    let stats = record(good).unwrap();
    assert_eq!(stats.passes[..1], ["inject"], "a refused frame did not lose its changes");
}

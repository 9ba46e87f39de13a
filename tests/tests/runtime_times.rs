//! The times of `vlm-runtime`'s passes, by timestamps of the device.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::PathBuf;
use std::time::Instant;

use vlm_bake::gbuffer::GBuffer;
use vlm_bake::options::Preset;
use vlm_bake::shade::TraceScene;
use vlm_runtime::{Frame, PunctualLight, Settings, View, VlmRenderer, request_device};
use vlm_tests::baked::Baked;
use vlm_tests::runtime_gpu::{Host, view};

fn cornell() -> Baked {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
    Baked::open(&path, Preset::Draft).unwrap()
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn passes_are_timed_a_frame_or_two_later() {
    let Baked { scene, asset, .. } = cornell();
    let (trace, camera) = (TraceScene::new(&scene), &scene.cameras[0]);
    let gbuffer = GBuffer::trace(&trace, camera, 64, 64);
    let mut host = Host::new(&asset, Settings { time_passes: true, ..Settings::default() }).unwrap();
    if !host.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
        eprintln!("ignored: the device has no timestamps");
        return;
    }
    let pictures = host.upload(&gbuffer, camera, |_| 0);
    let lit = Frame { lights: &trace.lights, view: view(camera, &gbuffer, 1.0), ..Frame::default() };
    let started = Instant::now();
    let (_, first) = host.frame(&lit, &pictures).unwrap();
    assert_eq!((first.frame, first.times), (1, None), "nothing has come back yet");
    let waited = host.renderer.wait_for_times(&host.queue).unwrap().unwrap();
    let wall = started.elapsed().as_secs_f64();
    let names: Vec<&str> = waited.passes.iter().map(|time| time.pass).collect();
    println!("{waited:?}, wall {wall} s");
    assert_eq!((waited.frame, &names), (1, &first.passes));
    let sum: f64 = waited.passes.iter().map(|time| time.seconds).sum();
    assert!(waited.passes.iter().all(|time| time.seconds > 0.0) && sum < wall, "{sum} of {wall} s");

    // Without waiting: the frame's times are there after a few more, whatever these do. Only the gather ran in them.
    let mut newest = 0;
    for number in 2..8 {
        let moved = Frame { view: View { exposure: number as f32, ..lit.view }, ..lit };
        let (_, stats) = host.frame(&moved, &pictures).unwrap();
        assert_eq!((stats.frame, &stats.passes[..]), (number, &["gather"][..]));
        let times = stats.times.unwrap();
        assert!(times.frame >= newest && times.frame < number, "{times:?} in frame {number}");
        newest = times.frame;
    }
    assert!(newest >= 5, "{newest}");
    assert_eq!(host.renderer.wait_for_times(&host.queue).unwrap().unwrap().frame, 7);
}

/// Many frames whose times nobody reads neither fail nor pile up.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn frames_under_way_may_be_many() {
    let Baked { scene, asset, .. } = cornell();
    let mut host = Host::new(&asset, Settings { time_passes: true, ..Settings::default() }).unwrap();
    let mut lights: Vec<PunctualLight> = TraceScene::new(&scene).lights.clone();
    for _ in 0..20 {
        lights[0].intensity *= 1.1;
        host.renderer.prepare(&host.queue, &Frame { lights: &lights, ..Frame::default() }).unwrap();
        let mut encoder = host.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        host.renderer.record_light(&mut encoder).unwrap();
        host.queue.submit([encoder.finish()]);
    }
    assert!(host.renderer.wait_for_times(&host.queue).is_ok());
}

/// The negative controls: not asked for, and a device without timestamps.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn no_times_where_none_are_asked_for_or_there_are_none() {
    let Baked { asset, .. } = cornell();
    let mut host = Host::new(&asset, Settings::default()).unwrap();
    let (device, queue) = request_device(wgpu::Backends::VULKAN).unwrap();
    let mut bare = VlmRenderer::new(&device, Settings { time_passes: true, ..Settings::default() }).unwrap();
    bare.load(&asset).unwrap();
    for (renderer, device, queue) in
        [(&mut host.renderer, &host.device, &host.queue), (&mut bare, &device, &queue)]
    {
        for _ in 0..3 {
            renderer.prepare(queue, &Frame::default()).unwrap();
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            assert_eq!(renderer.record_light(&mut encoder).unwrap().times, None);
            queue.submit([encoder.finish()]);
        }
        assert_eq!(renderer.wait_for_times(queue).unwrap(), None);
    }
}

//! The viewer follows its file however it changes: new light appears, what is broken leaves the last good picture and says why.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use image::{Rgb, RgbImage};
use serde_json::{Value, json};
use tempfile::TempDir;
use vlm_bake::follow::FollowOptions;
use vlm_bake::options::Preset;
use vlm_runtime::view::{
    Controls, Gpu, Look, OpenOptions, PICTURE_FORMAT, Session, ShadowsArg, Sources, Viewer, ViewerOptions,
    WatchOptions, Watcher,
};
use vlm_tests::glb::{Glb, Mesh};
use vlm_tests::viewing::baked;

/// Long enough on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

const SIZE: [u32; 2] = [24, 24];

/// A corner of a floor with a texture, and a wall: a .gltf, a .bin and a .png.
struct Folder {
    folder: TempDir,
}

impl Folder {
    fn new() -> Self {
        let this = Self { folder: TempDir::new().unwrap() };
        this.write_image([200, 200, 200]);
        this.write_scene("scene.gltf", [0.8, 0.1, 0.1], 40.0, 2.0);
        this
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write_image(&self, color: [u8; 3]) {
        RgbImage::from_pixel(4, 4, Rgb(color)).save(self.path("floor.png")).unwrap();
    }

    /// The wall's colour, the lamp's intensity (cd), and how high the wall is (m).
    fn write_scene(&self, name: &str, wall: [f32; 3], intensity: f32, height: f32) {
        let (json, bin) = scene(wall, intensity, height);
        fs::write(self.path("scene.bin"), bin).unwrap();
        fs::write(self.path(name), json.to_string()).unwrap();
    }
}

fn scene(wall: [f32; 3], intensity: f32, height: f32) -> (Value, Vec<u8>) {
    let material = |color: [f32; 3]| json!({ "pbrMetallicRoughness": { "baseColorFactor": [color[0], color[1], color[2], 1.0] } });
    let mut floor = Mesh::default();
    floor.push_quad([[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]]);
    let mut back = Mesh::default();
    back.push_quad([[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, height, -1.0], [-1.0, height, -1.0]]);
    let mut textured = material([1.0; 3]);
    textured["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    let mut glb = Glb::new(json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": intensity }] } },
        "scene": 0,
        "scenes": [{ "nodes": [0, 1, 2, 3] }],
        "nodes": [
            { "name": "floor", "mesh": 0 },
            { "name": "wall", "mesh": 1 },
            { "name": "lamp", "translation": [0.0, 1.5, 0.0], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "name": "eye", "translation": [0.0, 1.0, 4.0], "camera": 0 },
        ],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.1 } }],
        "materials": [textured, material(wall)],
        "textures": [{ "source": 0 }],
        "images": [{ "uri": "floor.png" }],
    }));
    let primitives = [glb.primitive(&floor, 0), glb.primitive(&back, 1)];
    glb.json["meshes"] = json!([{ "primitives": [primitives[0]] }, { "primitives": [primitives[1]] }]);
    let bytes = glb.finish();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let bin = bytes[28 + length..].to_vec();
    json["buffers"][0]["uri"] = json!("scene.bin");
    json["buffers"][0]["byteLength"] = json!(bin.len());
    (json, bin)
}

fn viewer(sources: Sources) -> Viewer {
    let options = ViewerOptions { format: PICTURE_FORMAT, shadows: ShadowsArg::Rays, measures: false };
    Viewer::new(Gpu::new().unwrap(), sources, options).unwrap()
}

fn session(file: &Path, sources: Sources) -> Session {
    let options = WatchOptions {
        file: file.to_owned(),
        open: OpenOptions { preset: Preset::Draft, needs_lights: true },
        shaders: sources.files(),
        follow: FollowOptions::default(),
    };
    let watcher = Watcher::start(options, Arc::new(|| ())).unwrap();
    Session::new(viewer(sources), watcher, Controls { exposure: 0.05, ..Controls::default() })
}

/// Takes news until `wanted`; fails where that takes too long.
fn until(session: &mut Session, what: &str, wanted: impl Fn(&mut Session) -> bool) {
    let start = Instant::now();
    while !wanted(session) {
        let errors: Vec<&str> = session.errors().collect();
        assert!(start.elapsed() < PATIENCE, "{what} does not come: {errors:?}");
        session.wait_for_news(Duration::from_millis(100));
    }
}

fn until_opened(session: &mut Session, times: u64) {
    until(session, "the new version", |session| session.opened() >= times && session.errors().count() == 0);
}

fn until_error(session: &mut Session, words: &str) {
    until(session, words, |session| session.errors().any(|error| error.contains(words)));
}

fn picture(session: &mut Session) -> Vec<[u8; 3]> {
    assert!(session.frame(SIZE, true), "{:?}", session.errors().collect::<Vec<_>>());
    let camera = session.camera().unwrap();
    session.viewer.picture(&session.controls, &camera).unwrap()
}

/// Mean red, green and blue.
fn mean(session: &mut Session) -> [f64; 3] {
    let picture = picture(session);
    let sum = |channel: usize| picture.iter().map(|p| f64::from(p[channel])).sum::<f64>();
    [0, 1, 2].map(|channel| sum(channel) / picture.len() as f64)
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn every_change_shows_and_what_is_broken_leaves_the_last_good_one() {
    let folder = Folder::new();
    let file = folder.path("scene.gltf");
    let mut session = session(&file, Sources::default());
    until_opened(&mut session, 1);
    assert!(session.is_baked());
    let red = mean(&mut session);

    // In place.
    folder.write_scene("scene.gltf", [0.1, 0.8, 0.1], 40.0, 2.0);
    until_opened(&mut session, 2);
    until(&mut session, "green", |session| mean(session)[1] > red[1] + 5.0);
    let green = picture(&mut session);

    // Half written.
    let whole = fs::read_to_string(&file).unwrap();
    fs::write(&file, &whole[..whole.len() / 2]).unwrap();
    until_error(&mut session, "scene.gltf");
    assert_eq!(picture(&mut session), green, "the last good one stays");

    // The rest of it, by a rename.
    let beside = folder.path("scene.gltf.tmp");
    let blue = scene([0.1, 0.1, 0.8], 40.0, 2.0).0.to_string();
    fs::write(&beside, blue).unwrap();
    fs::rename(&beside, &file).unwrap();
    until(&mut session, "blue", |session| session.errors().count() == 0 && picture(session) != green);
    let before = mean(&mut session);
    assert!(before[2] > before[1], "{before:?}");

    // What it refers to: the texture, then the buffer.
    folder.write_image([20, 20, 20]);
    until(&mut session, "a dark floor", |session| mean(session)[0] < before[0] - 2.0);
    let dark = picture(&mut session);
    fs::write(folder.path("floor.png"), b"\x89PNG\r\n\x1a\nhalf").unwrap();
    until_error(&mut session, "/images/0");
    assert_eq!(picture(&mut session), dark);
    folder.write_image([200, 200, 200]);
    until(&mut session, "a bright floor", |session| {
        session.errors().count() == 0 && mean(session)[0] > before[0] - 1.0
    });
    let tall = picture(&mut session);
    fs::write(folder.path("scene.bin"), scene([0.1, 0.1, 0.8], 40.0, 0.7).1).unwrap();
    until(&mut session, "a low wall", |session| picture(session) != tall);
    let low = picture(&mut session);

    // Deleted and made again.
    fs::remove_file(folder.path("scene.bin")).unwrap();
    until_error(&mut session, "scene.bin");
    assert_eq!(picture(&mut session), low);
    fs::remove_file(&file).unwrap();
    until_error(&mut session, "scene.gltf");
    folder.write_scene("scene.gltf", [0.8, 0.1, 0.1], 40.0, 2.0);
    until(&mut session, "the first scene", |session| session.errors().count() == 0 && mean(session) == red);
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn the_last_of_many_saves_wins() {
    let folder = Folder::new();
    let mut session = session(&folder.path("scene.gltf"), Sources::default());
    until_opened(&mut session, 1);
    let first = mean(&mut session);
    for i in 0..30 {
        folder.write_scene("scene.gltf", [0.8, 0.1, 0.1], 40.0 + i as f32, 2.0);
        std::thread::sleep(Duration::from_millis(5));
    }
    folder.write_scene("scene.gltf", [0.8, 0.1, 0.1], 4.0, 2.0);
    until(&mut session, "the last", |session| mean(session)[0] < 0.6 * first[0]);
    session.wait_for_news(Duration::from_secs(2));
    assert!(mean(&mut session)[0] < 0.6 * first[0] && session.errors().count() == 0);
}

/// A file that has lights already is not baked, and what the user chose stays when it comes again.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn choices_stay_over_a_reload() {
    let folder = TempDir::new().unwrap();
    let cornell = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
    let file = baked(&cornell, Preset::Draft, folder.path()).unwrap();
    let mut session = session(&file, Sources::default());
    until_opened(&mut session, 1);
    assert!(!session.is_baked());
    assert_eq!(session.camera().unwrap().name, "camera");
    session.controls.exposure = 0.02;
    session.controls.lights[0].intensity = 0.5;
    let wall = session.controls.bounces.iter_mut().find(|bounce| bounce.group.name == "room: red").unwrap();
    wall.tint = glam::Vec3::new(0.0, 0.0, 9.0);
    let chosen = session.controls.clone();
    let shown = picture(&mut session);
    let bytes = fs::read(&file).unwrap();
    fs::write(&file, &bytes[..bytes.len() - 100]).unwrap();
    until_error(&mut session, "baked.vlm.glb");
    fs::write(&file, &bytes).unwrap();
    until_opened(&mut session, 2);
    assert_eq!(session.controls, chosen);
    assert_eq!(picture(&mut session), shown);
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn a_camera_that_there_is_not_leaves_the_first_and_a_word() {
    let folder = Folder::new();
    let mut session = session(&folder.path("scene.gltf"), Sources::default());
    session.look = Look::Camera(Some("roof".to_owned()));
    until_error(&mut session, "`roof`");
    assert!(session.frame(SIZE, true) && session.camera().unwrap().name == "eye");
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn shaders_are_followed_too() {
    let folder = Folder::new();
    let shaders = TempDir::new().unwrap();
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../vlm-runtime/src/view/wgsl");
    for entry in fs::read_dir(own).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), shaders.path().join(entry.file_name())).unwrap();
    }
    let sources = Sources { folder: Some(shaders.path().to_owned()) };
    let mut session = session(&folder.path("scene.gltf"), sources);
    until_opened(&mut session, 1);
    let before = picture(&mut session);
    let path = shaders.path().join("resolve.wgsl");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("fn fragment(", "fn fragment(oops ")).unwrap();
    until_error(&mut session, "resolve.wgsl");
    assert_eq!(picture(&mut session), before, "the last good one stays");
    let inverted = "vec4f(1.0 - encode_srgb(tone_map(radiance * settings.exposure)), 1.0)";
    let straight = "vec4f(encode_srgb(tone_map(radiance * settings.exposure)), 1.0)";
    assert!(text.contains(straight));
    fs::write(&path, text.replace(straight, inverted)).unwrap();
    until(&mut session, "the new shader", |session| session.errors().count() == 0);
    assert_ne!(picture(&mut session), before);
}

/// Resident memory, bytes.
fn resident() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    Some(1024 * line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()?)
}

/// `VLM_RELOADS` asks for another number.
#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn reloads_pile_nothing_up() {
    let count = std::env::var("VLM_RELOADS").ok().and_then(|count| count.parse().ok()).unwrap_or(30_u64);
    let folder = Folder::new();
    let mut session = session(&folder.path("scene.gltf"), Sources::default());
    until_opened(&mut session, 1);
    let first = mean(&mut session);
    let mut memory = Vec::new();
    for i in 1..=count {
        let brightness = if i % 2 == 0 { 40.0 } else { 20.0 };
        folder.write_scene("scene.gltf", [0.8, 0.1, 0.1], brightness, 2.0);
        until(&mut session, "the next version", |session| {
            session.errors().count() == 0 && (mean(session)[0] > 0.9 * first[0]) == (i % 2 == 0)
        });
        memory.extend(resident());
    }
    let mebi = |bytes: &u64| bytes >> 20;
    let shown: Vec<u64> = memory.iter().step_by((memory.len() / 10).max(1)).map(mebi).collect();
    println!("{count} reloads, {} opened, MiB resident: {shown:?}", session.opened());
    if let (Some(warm), Some(last)) = (memory.get(memory.len() / 3), memory.last()) {
        assert!(mebi(last) <= mebi(warm) + 8, "{shown:?}");
    }
    session.viewer.gpu().check().unwrap();
}

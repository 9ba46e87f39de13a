//! Every scene and object of the test assets loads: triangles as counted, textures decoded, numbers finite.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::Path;
use std::time::Instant;
use vlm_bake::scene::{self, LoadOptions, Scene};
use vlm_format::{Error, GltfFile};

/// File, triangles, punctual lights, cameras; as the assets' README counts them.
const SCENES: [(&str, usize, usize, usize); 12] = [
    ("sponza", 262_267, 1, 2),
    ("sibenik", 75_284, 2, 1),
    ("veach_ajar", 20_764, 1, 2),
    ("dungeon_kaykit", 69_173, 2, 2),
    ("zdm2_godot", 58_772, 0, 0),
    ("CornellBox-Original", 36, 0, 0),
    ("CornellBox-Sphere", 2_188, 0, 0),
    ("CornellBox-Water", 7_088, 0, 0),
    ("irradiance_volume_bevy", 32, 0, 0),
    ("mixed_lighting_bevy", 40_898, 1, 0),
    ("room_godot", 63_720, 0, 0),
    ("house_playcanvas", 10_497, 0, 0),
];

fn load(path: &Path) -> Scene {
    let start = Instant::now();
    let file = GltfFile::open(path).unwrap();
    let read = start.elapsed();
    let scene = scene::load(&file, &LoadOptions::default()).unwrap();
    let loaded = start.elapsed();
    let surfaces = scene.triangle_surfaces();
    eprintln!(
        "{}: {} triangles (+{} without area), {} textures, read {read:.2?}, loaded {loaded:.2?}, colours {:.2?}\n  {:?}",
        path.file_name().unwrap().to_string_lossy(),
        scene.triangles.len(),
        scene.degenerate_triangles,
        scene.textures.len(),
        start.elapsed() - loaded,
        scene.notes,
    );
    check(&scene);
    let possible = |x: f32| (0.0..=1.0).contains(&x);
    for surface in surfaces {
        assert!(
            surface.albedo.to_array().into_iter().all(possible) && possible(surface.coverage),
            "{surface:?}"
        );
        assert!(surface.emission.is_finite() && surface.emission.min_element() >= 0.0, "{surface:?}");
    }
    scene
}

/// The invariants that [`Scene`] promises.
fn check(scene: &Scene) {
    let vertices = scene.positions.len();
    assert!([scene.vertex_normals.len(), scene.vertex_colors.len()] == [vertices; 2]);
    assert!([scene.vertex_uvs.len(), scene.vertex_emissive_uvs.len()] == [vertices; 2]);
    assert!(scene.positions.iter().all(|p| p.is_finite()));
    assert!(scene.vertex_normals.iter().all(|n| n.is_normalized()));
    assert!(scene.triangles.iter().flatten().all(|&v| (v as usize) < vertices));
    assert_eq!(scene.triangle_primitive.len(), scene.triangles.len());
    assert_eq!(scene.triangle_in_primitive.len(), scene.triangles.len());
    for (p, primitive) in scene.primitives.iter().enumerate() {
        let [first, count] = primitive.triangles.map(|n| n as usize);
        assert!(scene.triangle_primitive[first..first + count].iter().all(|&owner| owner as usize == p));
        let numbers = &scene.triangle_in_primitive[first..first + count];
        assert!(numbers.is_sorted_by(|a, b| a < b));
        assert!(numbers.last().is_none_or(|&last| last < primitive.drawn_triangles));
        assert!((primitive.object as usize) < scene.objects.len());
        assert!((primitive.material as usize) < scene.materials.len());
    }
}

#[test]
fn every_scene_loads() {
    let Some(folder) = vlm_tests::assets::find("scenes") else { return };
    for (name, triangles, lights, cameras) in SCENES {
        let scene = load(&folder.join(name).with_extension("glb"));
        assert_eq!(scene.triangles.len() + scene.degenerate_triangles, triangles, "{name}");
        assert_eq!((scene.lights.len(), scene.cameras.len()), (lights, cameras), "{name}");
    }
}

#[test]
fn every_object_loads() {
    let Some(folder) = vlm_tests::assets::find("objects") else { return };
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    assert_eq!(paths.len(), 20);
    for path in paths {
        load(&path);
    }
}

/// The corpus is full of oddities: whatever the reader accepts becomes a scene that keeps its promises, or an error
/// that says why not.
#[test]
fn the_corpus_loads_or_says_why_not() {
    let Some(folder) = vlm_tests::assets::find("corpus") else { return };
    let mut pending = vec![folder];
    let mut files = Vec::new();
    while let Some(path) = pending.pop() {
        if path.is_dir() {
            pending.extend(std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()));
        } else if path.extension().is_some_and(|kind| kind == "glb" || kind == "gltf") {
            files.push(path);
        }
    }
    files.sort();
    let (mut loaded, mut refused) = (0, 0);
    for path in &files {
        let Ok(file) = GltfFile::open(path) else { continue };
        match scene::load(&file, &LoadOptions::default()) {
            Ok(scene) => {
                check(&scene);
                assert_eq!(scene.triangle_surfaces().len(), scene.triangles.len());
                loaded += 1;
            }
            Err(error) => {
                eprintln!("{error}");
                refused += 1;
            }
        }
    }
    eprintln!("{} files: {loaded} loaded, {refused} without a scene", files.len());
    assert!(loaded > 100, "only {loaded} of {} load", files.len());
}

#[test]
fn our_own_boxes_load() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets");
    let cornell = load(&folder.join("cornell.glb"));
    assert_eq!((cornell.triangles.len(), cornell.lights.len(), cornell.cameras.len()), (34, 1, 1));
    assert_eq!(cornell.cameras[0].name, "camera");
    let sphere = load(&folder.join("cornell_sphere.glb"));
    assert_eq!((sphere.triangles.len(), sphere.lights.len(), sphere.cameras.len()), (22 + 5120, 1, 1));
}

/// The divergence theorem: a closed, outward object has its volume, and one turned inside out its negative.
#[test]
fn our_own_boxes_wind_the_right_way() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets");
    let scene = load(&folder.join("cornell_sphere.glb"));
    let volume = |object: u32| -> f32 {
        let of_object = |&t: &usize| scene.primitives[scene.triangle_primitive[t] as usize].object == object;
        let signed = |t: usize| scene.corners(t).map_or(0.0, |[a, b, c]| a.dot(b.cross(c)) / 6.0);
        (0..scene.triangles.len()).filter(of_object).map(signed).sum()
    };
    // The room is open in front, in the plane z = 0 through the origin, which adds nothing.
    let room = -(5.528 * 5.488 * 5.592);
    assert!((volume(0) / room - 1.0).abs() < 1e-4, "{} against {room}", volume(0));
    // Gauss' area formula over the tall block's footprint, times its height.
    assert!((volume(1) / (2.762_65 * 3.3) - 1.0).abs() < 1e-4, "{}", volume(1));
    let sphere = 4.0 / 3.0 * std::f32::consts::PI * 0.9_f32.powi(3);
    assert!((0.99..1.0).contains(&(volume(2) / sphere)), "{} against {sphere}", volume(2));
}

#[test]
fn draco_is_refused_kindly() {
    let Some(path) = vlm_tests::assets::find("scenes/sponza_draco_webp.glb") else { return };
    let error = GltfFile::open(&path).unwrap_err();
    assert!(matches!(&error, Error::Invalid { .. }));
    let message = error.to_string();
    assert!(message.contains("Draco") && message.contains("gltf-transform"), "{message}");
}

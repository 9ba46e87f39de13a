//! Damaged files: whatever a byte, a number or a cut does to a file, it opens or is refused, and nothing panics.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use gltf::camera::Projection;
use gltf::khr_lights_punctual::Kind;
use serde_json::{Value, json};
use vlm_format::{Container, GltfFile, Target, read_vlm, read_vlm_unchecked, strip_vlm, write_vlm};
use vlm_tests::sample_asset::{quads, room};

/// Xorshift (Marsaglia 2003): the same damage on every run.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit as u64) as usize
    }
}

fn baked(container: Container) -> Vec<u8> {
    let file = room();
    let target = Target { container, file_name: String::from("room.glb") };
    write_vlm(&file, &quads(&file), &target).unwrap().swap_remove(0).bytes
}

/// Does all that can be done with a file; returns whether it opened.
fn use_all(bytes: &[u8]) -> bool {
    let Ok(file) = GltfFile::from_slice(bytes, "damaged", None) else { return false };
    for accessor in file.document().accessors() {
        let _ = file.read_floats(accessor.index()).and_then(|_| file.read_positions(accessor.index()));
        let _ = file.read_indices(accessor.index(), 3);
    }
    walk(&file);
    let _ = (read_vlm(&file), read_vlm_unchecked(&file));
    let asset = quads(&file);
    for container in [Container::Glb, Container::Gltf { embedded: false }] {
        let target = Target { container, file_name: String::from("out.glb") };
        let _ = (strip_vlm(&file, &target), write_vlm(&file, &asset, &target));
    }
    true
}

/// Follows every reference of the typed view.
fn walk(file: &GltfFile) {
    let document = file.document();
    for image in document.images() {
        let _ = (file.image_bytes(image.index()), image.source());
    }
    for scene in document.scenes() {
        let _ = scene.nodes().map(|node| node.children().count()).sum::<usize>();
    }
    for node in document.nodes() {
        let _ = (node.transform().matrix(), node.light().map(|light| matches!(light.kind(), Kind::Point)));
        let _ = node.camera().map(|camera| matches!(camera.projection(), Projection::Perspective(_)));
        let _ = (node.mesh(), node.skin());
    }
    for primitive in document.meshes().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>()) {
        let _ = (primitive.attributes().count(), primitive.mode(), primitive.indices());
        let material = primitive.material();
        let _ = (material.alpha_mode(), material.emissive_strength(), material.pbr_metallic_roughness());
        let texture = material.emissive_texture().map(|info| (info.texture_transform(), info.texture()));
        let Some((_, texture)) = texture else { continue };
        let _ = (texture.source(), texture.sampler().wrap_s(), texture.sampler().mag_filter());
    }
}

#[test]
fn flipped_bytes_and_cuts_never_panic() {
    let bytes = baked(Container::Glb);
    assert!(use_all(&bytes), "the undamaged file does not open");
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let mut opened = 0;
    for _ in 0..10_000 {
        let mut damaged = bytes.clone();
        for _ in 0..=random.below(3) {
            let at = random.below(damaged.len());
            damaged[at] ^= 1 << random.below(8);
        }
        if random.below(4) == 0 {
            damaged.truncate(random.below(damaged.len()));
        }
        opened += usize::from(use_all(&damaged));
    }
    assert!(opened > 100, "only {opened} damaged files opened: the damage is too crude to test what follows");
    println!("{opened} of 10000 opened");
}

/// Pointers to everything inside a JSON value.
fn places(value: &Value, pointer: &str, found: &mut Vec<String>) {
    found.push(pointer.to_owned());
    match value {
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(i, item)| places(item, &format!("{pointer}/{i}"), found));
        }
        Value::Object(map) => {
            map.iter().for_each(|(key, item)| places(item, &format!("{pointer}/{key}"), found));
        }
        _ => {}
    }
}

#[test]
fn changed_values_never_panic() {
    let json: Value = serde_json::from_slice(&baked(Container::Gltf { embedded: true })).unwrap();
    let mut pointers = Vec::new();
    places(&json, "", &mut pointers);
    let values = [
        json!(0),
        json!(1),
        json!(-1),
        json!(2.5),
        json!(5121),
        json!(0xFFFF_FFFF_u32),
        json!(u64::MAX),
        json!(1e39),
        json!(null),
        json!(true),
        json!("MAT3"),
        json!("data:;base64,AAAA"),
        json!([]),
        json!({}),
        json!([0, 0, 0]),
    ];
    let mut opened = 0;
    let mut random = Random(1);
    let tries = pointers.len() * values.len();
    for pointer in &pointers {
        for value in &values {
            let mut damaged = json.clone();
            *damaged.pointer_mut(pointer).unwrap() = value.clone();
            // A second change reaches what one alone is refused for.
            let second = &pointers[random.below(pointers.len())];
            if let Some(place) = damaged.pointer_mut(second) {
                *place = values[random.below(values.len())].clone();
            }
            opened += usize::from(use_all(damaged.to_string().as_bytes()));
        }
    }
    assert!(opened > tries / 20, "only {opened} of {tries} opened");
    println!("{opened} of {tries} opened");
}

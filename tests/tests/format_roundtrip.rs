//! Writing changes nothing but what it adds, stripping restores the file, and what was written is read back.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::fs;
use std::path::Path;

use serde_json::Value;
use vlm_format::{
    Container, EXTENSION, GltfFile, OutputFile, Target, read_vlm, strip_vlm, write_atomic, write_vlm,
};
use vlm_tests::glb::{Glb, Mesh, container};
use vlm_tests::{assets, sample_asset};

/// GLB, side files, data URIs; quantised, compressed and sparse data; instances, unknown extensions, extras, skins.
const FILES: &[&str] = &[
    "generated/bunny_meshopt_si10.glb",
    "generated/dungeon_gpu_instancing_meshopt.glb",
    "generated/suzanne_quantized.glb",
    "generated/sparse_positions.gltf",
    "generated/extreme_scales.gltf",
    "blender_io/19_sheen/19_sheen.gltf",
    "blender_io/24_animation_pointer/24_animation_pointer.gltf",
    "gltf_transform/extensions/test/in/EXT_structural_metadata/SharedPropertyTable.gltf",
    "magnum/mesh-morph-target-attributes.gltf",
    "sascha/CesiumMan/glTF-Binary/CesiumMan.glb",
    "sharpgltf/XmpJsonLd.gltf",
    "tinygltf/models/Extensions-overwrite-issue261/issue-261.gltf",
    "trimesh/CesiumMilkTruck.glb",
];

/// What the test knows of a file without the library's help.
struct Raw {
    json: Value,
    bin: Vec<u8>,
}

fn raw(bytes: &[u8]) -> Raw {
    if !bytes.starts_with(b"glTF") {
        return Raw { json: serde_json::from_slice(bytes).unwrap(), bin: Vec::new() };
    }
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let end = 20 + word(12);
    let bin = if end + 8 < bytes.len() { bytes[end + 8..end + 8 + word(end)].to_vec() } else { Vec::new() };
    Raw { json: serde_json::from_slice(&bytes[20..end]).unwrap(), bin }
}

/// Takes out of `after` what writing is allowed to add to `before`, and nothing else.
fn remove_additions(after: &mut Value, before: &Value) {
    for list in ["accessors", "bufferViews", "buffers", "extensionsUsed"] {
        let length = before.get(list).map_or(0, |list| list.as_array().unwrap().len());
        if let Some(found) = after.get_mut(list) {
            found.as_array_mut().unwrap().truncate(length);
        }
        if before.get(list).is_none() {
            after.as_object_mut().unwrap().shift_remove(list);
        }
    }
    if let Some(length) = before.pointer("/buffers/0/byteLength")
        && before.pointer("/buffers/0/uri").is_none()
    {
        after["buffers"][0]["byteLength"] = length.clone();
    }
    remove_extension(after, before);
}

fn remove_extension(after: &mut Value, before: &Value) {
    if let Some(extensions) = after.get_mut("extensions").and_then(Value::as_object_mut) {
        extensions.shift_remove(EXTENSION);
        if extensions.is_empty() && before.get("extensions").is_none() {
            after.as_object_mut().unwrap().shift_remove("extensions");
        }
    }
    for list in ["nodes", "meshes", "primitives"] {
        let Some(items) = after.get_mut(list).and_then(Value::as_array_mut) else { continue };
        for (i, item) in items.iter_mut().enumerate() {
            remove_extension(item, &before[list][i]);
        }
    }
}

/// Compares all that was there before, bytes and values, the order of keys included.
fn only_added(before: &Raw, after: &Raw) -> Result<(), String> {
    let mut rest = after.json.clone();
    remove_additions(&mut rest, &before.json);
    let (expected, found) = (before.json.to_string(), rest.to_string());
    if expected != found {
        let at = expected
            .bytes()
            .zip(found.bytes())
            .position(|(a, b)| a != b)
            .unwrap_or(expected.len().min(found.len()));
        let context = |text: &str| text.chars().skip(at.saturating_sub(40)).take(80).collect::<String>();
        return Err(format!("JSON differs:\n  before {}\n  after  {}", context(&expected), context(&found)));
    }
    if !after.bin.starts_with(&before.bin) {
        return Err(String::from("BIN differs"));
    }
    Ok(())
}

fn same_container(path: &Path) -> Target {
    Target::from_path(path).unwrap()
}

fn reopen(outputs: &[OutputFile]) -> (tempfile::TempDir, GltfFile) {
    let folder = tempfile::tempdir().unwrap();
    write_atomic(outputs, folder.path()).unwrap();
    let file = GltfFile::open(&folder.path().join(&outputs[0].path)).unwrap();
    (folder, file)
}

#[test]
#[cfg_attr(not(has_corpus), ignore = "the corpus is neither in VLM_ASSETS nor in ../shared/assets")]
fn ten_files_keep_every_byte_and_value() {
    let Some(corpus) = assets::find("corpus") else { return };
    let (mut checked, mut by_triangle) = (0, 0);
    for path in FILES.iter().map(|name| corpus.join(name)) {
        let file = GltfFile::open(&path).unwrap();
        let asset = sample_asset::quads(&file);
        by_triangle += asset.triangle_tags.len();
        let target = same_container(&path);
        let outputs = write_vlm(&file, &asset, &target).unwrap();
        let before = fs::read(&path).unwrap();
        only_added(&raw(&before), &raw(&outputs[0].bytes))
            .unwrap_or_else(|why| panic!("{}: {why}", path.display()));
        for side in outputs.iter().filter(|output| output.copied_from.is_some()) {
            assert_eq!(side.bytes, fs::read(path.parent().unwrap().join(&side.path)).unwrap());
        }

        let (_folder, written) = reopen(&outputs);
        assert_eq!(read_vlm(&written).unwrap().as_ref(), Some(&asset), "{}", path.display());

        let again = write_vlm(&written, &asset, &target).unwrap();
        assert_eq!(
            again[0].bytes,
            outputs[0].bytes,
            "{}: writing twice differs from writing once",
            path.display()
        );

        let stripped = strip_vlm(&written, &target).unwrap();
        let (expected, found) = (raw(&before), raw(&stripped[0].bytes));
        assert_eq!(found.json.to_string(), expected.json.to_string(), "{}", path.display());
        assert_eq!(found.bin, expected.bin, "{}", path.display());
        checked += 1;
    }
    assert!(checked >= 10, "only {checked} files were there");
    assert!(by_triangle > 0, "no file has tags by triangle");
    println!("{checked} files unchanged but for what was added");
}

#[test]
#[cfg_attr(not(has_corpus), ignore = "the corpus is neither in VLM_ASSETS nor in ../shared/assets")]
fn the_comparison_sees_every_kind_of_change() {
    let Some(path) = assets::find("corpus/trimesh/CesiumMilkTruck.glb") else { return };
    let file = GltfFile::open(&path).unwrap();
    let outputs = write_vlm(&file, &sample_asset::quads(&file), &same_container(&path)).unwrap();
    let before = raw(&fs::read(&path).unwrap());
    type Spoil = fn(&mut Raw);
    let spoil: [(&str, Spoil); 6] = [
        ("value", |raw| raw.json["asset"]["generator"] = "another".into()),
        ("last digit", |raw| {
            let accessors = raw.json["accessors"].as_array_mut().unwrap();
            let number = accessors.iter_mut().find_map(|accessor| accessor.pointer_mut("/max/0")).unwrap();
            *number = f64::from_bits(number.as_f64().unwrap().to_bits() + 1).into();
        }),
        ("order of keys", |raw| {
            let asset = raw.json["asset"].as_object_mut().unwrap();
            let (key, value) = asset.iter().next().map(|(key, value)| (key.clone(), value.clone())).unwrap();
            asset.shift_remove(&key);
            asset.insert(key, value);
        }),
        ("order of accessors", |raw| raw.json["accessors"].as_array_mut().unwrap().swap(0, 1)),
        ("lost node", |raw| drop(raw.json["nodes"].as_array_mut().unwrap().pop())),
        ("byte", |raw| raw.bin[100] ^= 1),
    ];
    for (what, spoil) in spoil {
        let mut after = raw(&outputs[0].bytes);
        assert_eq!(only_added(&before, &after), Ok(()));
        spoil(&mut after);
        assert!(only_added(&before, &after).is_err(), "a changed {what} was not seen");
    }
}

#[test]
#[cfg_attr(not(has_corpus), ignore = "the corpus is neither in VLM_ASSETS nor in ../shared/assets")]
fn every_container_converts_to_every_other() {
    let Some(corpus) = assets::find("corpus") else { return };
    let targets = [
        Target { container: Container::Glb, file_name: String::from("out.glb") },
        Target { container: Container::Gltf { embedded: false }, file_name: String::from("a b#1.gltf") },
        Target { container: Container::Gltf { embedded: true }, file_name: String::from("out.gltf") },
    ];
    for name in [
        "trimesh/CesiumMilkTruck.glb",
        "generated/sparse_positions.gltf",
        "blender_io/19_sheen/19_sheen.gltf",
    ] {
        let file = GltfFile::open(&corpus.join(name)).unwrap();
        let asset = sample_asset::quads(&file);
        for target in &targets {
            let (_first, once) = reopen(&write_vlm(&file, &asset, target).unwrap());
            assert_eq!(read_vlm(&once).unwrap().as_ref(), Some(&asset), "{name} to {target:?}");
            for next in &targets {
                let (_second, twice) = reopen(&write_vlm(&once, &asset, next).unwrap());
                assert_eq!(
                    read_vlm(&twice).unwrap().as_ref(),
                    Some(&asset),
                    "{name} to {target:?} to {next:?}"
                );
                let images = |file: &GltfFile| -> Vec<Vec<u8>> {
                    file.document()
                        .images()
                        .map(|image| file.image_bytes(image.index()).unwrap().into_owned())
                        .collect()
                };
                assert_eq!(images(&twice), images(&file));
            }
        }
    }
}

/// Found by fuzzing: a node placed its instances by an array of the extension, which stripping then took away from under it.
#[test]
fn what_others_use_of_the_extension_stays() {
    let file = sample_asset::room();
    let asset = sample_asset::quads(&file);
    let target = Target { container: Container::Gltf { embedded: true }, file_name: String::from("a.gltf") };
    let written = write_vlm(&file, &asset, &target).unwrap();
    let mut json = raw(&written[0].bytes).json;
    let positions = json["extensions"][EXTENSION]["lights"]["positions"]["accessor"].clone();
    assert!(positions.as_u64() >= Some(2), "it is the extension's own");
    json["nodes"][2]["extensions"]["EXT_mesh_gpu_instancing"] =
        serde_json::json!({ "attributes": { "TRANSLATION": positions } });

    let used = GltfFile::from_slice(json.to_string().as_bytes(), "a.gltf", None).unwrap();
    let open = |outputs: Vec<OutputFile>| GltfFile::from_slice(&outputs[0].bytes, "b.gltf", None).unwrap();
    let stripped = open(strip_vlm(&used, &target).unwrap());
    assert_eq!(read_vlm(&stripped).unwrap(), None);
    assert_eq!(stripped.json()["accessors"], used.json()["accessors"], "all of them stay");
    let again = open(write_vlm(&used, &asset, &target).unwrap());
    assert_eq!(read_vlm(&again).unwrap(), Some(asset));
    // The negative control: without that use they go.
    let plain = open(strip_vlm(&open(written), &target).unwrap());
    assert_eq!(plain.json()["accessors"].as_array().map(Vec::len), Some(2));
}

/// Found by fuzzing: stripping shortened the buffer to a wrong length, and views of others then reached past it.
#[test]
fn a_wrong_length_from_before_writing_is_not_believed() {
    let mut glb = Glb::new(serde_json::json!({ "asset": { "version": "2.0" } }));
    let triangle = Mesh {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        normals: vec![[0.0, 0.0, 1.0]; 3],
        indices: vec![0, 1, 2],
    };
    let primitive = glb.primitive(&triangle, 0);
    glb.json["materials"] = serde_json::json!([{}]);
    glb.json["meshes"] = serde_json::json!([{ "primitives": [primitive] }]);
    glb.json["nodes"] = serde_json::json!([{ "mesh": 0 }]);
    let file = GltfFile::from_slice(&glb.finish(), "a.glb", None).unwrap();
    let target = Target { container: Container::Glb, file_name: String::from("a.glb") };
    let written = write_vlm(&file, &sample_asset::quads(&file), &target).unwrap();
    let Raw { mut json, bin } = raw(&written[0].bytes);
    let before = json["extensions"][EXTENSION]["data"]["bufferByteLength"].as_u64().unwrap();
    for (length, is_right) in [(before, true), (before - 8, false), (before + 8, false)] {
        json["extensions"][EXTENSION]["data"]["bufferByteLength"] = length.into();
        let told = GltfFile::from_slice(&container(&json, &bin), "b.glb", None).unwrap();
        let stripped = strip_vlm(&told, &target).unwrap();
        let stripped = GltfFile::from_slice(&stripped[0].bytes, "c.glb", None).unwrap();
        let left = stripped.json()["buffers"][0]["byteLength"].as_u64().unwrap();
        assert_eq!(left == before, is_right, "{left} bytes for {length}");
    }
}

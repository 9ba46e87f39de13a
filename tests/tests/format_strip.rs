//! Taking the Virtual Light Meshes out gives back the bytes of the source, and says where it cannot.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use vlm_format::{
    Container, Difference, GltfFile, OutputFile, Stripped, Target, WriteOptions, read_vlm,
    strip_vlm_compared, write_atomic, write_vlm_with,
};
use vlm_tests::{assets, sample_asset};

const PLAIN: WriteOptions = WriteOptions { compress: false };
const COMPRESSED: WriteOptions = WriteOptions { compress: true };

/// The room's JSON: all data in a data URI.
fn room() -> Value {
    sample_asset::room().json().clone()
}

/// A GLB of chunks that the caller has padded.
fn glb(json: &[u8], bin: Option<&[u8]>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut chunk = |kind: u32, data: &[u8]| {
        bytes.extend((data.len() as u32).to_le_bytes());
        bytes.extend(kind.to_le_bytes());
        bytes.extend(data);
    };
    chunk(0x4E4F_534A, json);
    if let Some(bin) = bin {
        chunk(0x004E_4942, bin);
    }
    let mut whole = b"glTF\x02\0\0\0".to_vec();
    whole.extend((bytes.len() as u32 + 12).to_le_bytes());
    whole.extend(bytes);
    whole
}

fn padded(json: &str, padding: &str) -> Vec<u8> {
    let mut bytes = json.as_bytes().to_vec();
    bytes.resize(bytes.len().next_multiple_of(4), b' ');
    bytes.extend(padding.as_bytes());
    bytes
}

/// The room with its data in the BIN chunk, and that data with some bytes more than the buffer has.
fn room_for_bin(extra: usize) -> (Value, Vec<u8>) {
    let file = sample_asset::room();
    let target = Target { container: Container::Glb, file_name: String::from("room.glb") };
    let outputs = vlm_format::strip_vlm(&file, &target).unwrap();
    let bytes = &outputs[0].bytes;
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let json = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let mut bin = bytes[28 + length..].to_vec();
    bin.extend(vec![0; extra]);
    (json, bin)
}

fn pretty(json: &Value, indent: &str, newline: &str) -> String {
    let text = serde_json::to_string_pretty(json).unwrap();
    let lines = text.lines().map(|line| {
        let rest = line.trim_start_matches(' ');
        format!("{}{rest}", indent.repeat((line.len() - rest.len()) / 2))
    });
    lines.collect::<Vec<_>>().join(newline)
}

/// Files by name, in every layout that exporters write.
fn sources() -> Vec<(&'static str, Vec<u8>)> {
    let json = room();
    let (in_bin, bin) = room_for_bin(0);
    let (_, longer) = room_for_bin(8);
    let no_data = r#"{"asset":{"version":"2.0"},"nodes":[{"name":"Empty"}],"scenes":[{"nodes":[0]}]}"#;
    let odd_numbers = json.to_string().replace("0.5", "5.0e-1").replace("Table", r"T\u0061ble");
    vec![
        ("minified.gltf", json.to_string().into_bytes()),
        ("pretty.gltf", (pretty(&json, "  ", "\n") + "\n").into_bytes()),
        ("tabs_crlf.gltf", pretty(&json, "\t", "\r\n").into_bytes()),
        ("spaced.gltf", json.to_string().replace(",\"", " , \"").replace("\":", "\" : ").into_bytes()),
        ("odd_numbers.gltf", odd_numbers.into_bytes()),
        ("marked.gltf", [b"\xEF\xBB\xBF\n", json.to_string().as_bytes(), b"\r\n"].concat()),
        ("no_data.gltf", no_data.as_bytes().to_vec()),
        ("no_data.glb", glb(&padded(no_data, ""), None)),
        ("bin.glb", glb(&padded(&in_bin.to_string(), ""), Some(&bin))),
        ("long_bin.glb", glb(&padded(&in_bin.to_string(), ""), Some(&longer))),
        ("padded.glb", glb(&padded(&in_bin.to_string(), "        "), Some(&bin))),
        ("zeros.glb", glb(&padded(&in_bin.to_string(), "\0\0\0\0"), Some(&bin))),
        ("newline.glb", glb(&padded(&in_bin.to_string(), "  \n "), Some(&bin))),
        ("pretty.glb", glb(&padded(&pretty(&in_bin, "    ", "\n"), ""), Some(&bin))),
    ]
}

fn target(name: &str) -> Target {
    Target::from_path(Path::new(name)).unwrap()
}

/// Bakes bytes into `to`, and strips that into `back`.
fn there_and_back(name: &str, bytes: &[u8], to: &Target, back: &Target, options: &WriteOptions) -> Stripped {
    let folder = tempfile::tempdir().unwrap();
    let file = GltfFile::from_slice(bytes, name, Some(folder.path())).unwrap();
    let asset = sample_asset::many_quads(&file, 20);
    write_atomic(&write_vlm_with(&file, &asset, to, options).unwrap(), folder.path()).unwrap();
    let baked = GltfFile::open(&folder.path().join(&to.file_name)).unwrap();
    assert_eq!(read_vlm(&baked).unwrap().as_ref(), Some(&asset), "{name}");
    strip_vlm_compared(&baked, back).unwrap()
}

#[test]
fn every_layout_comes_back_byte_by_byte() {
    for (name, bytes) in sources() {
        for options in [PLAIN, COMPRESSED] {
            let to = target(name);
            let stripped = there_and_back(name, &bytes, &to, &to, &options);
            assert!(
                stripped.files[0].bytes == bytes,
                "{name}: {}",
                first_difference(&stripped.files, &bytes)
            );
            assert_eq!(stripped.difference, None, "{name}");
        }
    }
}

#[test]
fn embedded_data_comes_back_too() {
    let bytes = pretty(&room(), "  ", "\n").into_bytes();
    let to = Target { container: Container::Gltf { embedded: true }, file_name: String::from("room.gltf") };
    let stripped = there_and_back("room.gltf", &bytes, &to, &to, &PLAIN);
    assert_eq!((stripped.files.len(), stripped.difference), (1, None));
    assert!(stripped.files[0].bytes == bytes);
}

#[test]
fn data_beside_the_file_is_passed_on_and_ours_is_gone() {
    let folder = tempfile::tempdir().unwrap();
    let (mut json, bin) = room_for_bin(0);
    json["buffers"][0]["uri"] = json!("room.bin");
    fs::write(folder.path().join("room.bin"), &bin).unwrap();
    let source = json.to_string();
    let file = GltfFile::from_slice(source.as_bytes(), "room.gltf", Some(folder.path())).unwrap();
    let written = write_vlm_with(&file, &sample_asset::quads(&file), &target("room.gltf"), &PLAIN).unwrap();
    assert_eq!(written.len(), 3, "main, data and ours");
    write_atomic(&written, folder.path()).unwrap();
    let baked = GltfFile::open(&folder.path().join("room.gltf")).unwrap();
    let stripped = strip_vlm_compared(&baked, &target("room.gltf")).unwrap();
    let names: Vec<_> = stripped.files.iter().map(|file| file.path.display().to_string()).collect();
    assert_eq!(names, ["room.gltf", "room.bin"]);
    assert!(stripped.files[0].bytes == source.as_bytes() && stripped.files[1].bytes == bin);
}

#[test]
fn what_cannot_come_back_is_named() {
    let (json, bin) = room_for_bin(0);
    let source = glb(&padded(&json.to_string(), ""), Some(&bin));
    let (to_glb, to_gltf) = (target("room.glb"), target("room.gltf"));
    let differs = |bytes: &[u8], to: &Target, back: &Target| {
        let stripped = there_and_back("room", bytes, to, back, &PLAIN);
        assert!(stripped.files[0].bytes != bytes);
        stripped.difference
    };
    assert_eq!(differs(&source, &to_glb, &to_gltf), Some(Difference::Container));
    assert_eq!(differs(room().to_string().as_bytes(), &to_glb, &to_glb), Some(Difference::Rewritten));
    let mut trailing = source.clone();
    trailing.extend(b"bytes that belong to no chunk");
    assert_eq!(differs(&trailing, &to_glb, &to_glb), Some(Difference::Unknown));
}

#[test]
fn a_tool_in_between_is_named() {
    let bytes = room().to_string().into_bytes();
    let file = GltfFile::from_slice(&bytes, "room.gltf", None).unwrap();
    let to = Target { container: Container::Gltf { embedded: true }, file_name: String::from("room.gltf") };
    let written = write_vlm_with(&file, &sample_asset::quads(&file), &to, &PLAIN).unwrap();
    let strip_changed = |change: fn(&mut Value)| {
        let mut json: Value = serde_json::from_slice(&written[0].bytes).unwrap();
        change(&mut json);
        let file = GltfFile::from_slice(json.to_string().as_bytes(), "room.gltf", None).unwrap();
        strip_vlm_compared(&file, &to).unwrap().difference
    };
    assert_eq!(strip_changed(|_| ()), None);
    assert_eq!(
        strip_changed(|json| json["asset"]["generator"] = json!("other")),
        Some(Difference::Rewritten)
    );
    let append = |json: &mut Value| {
        let view = json["bufferViews"][0].clone();
        json["bufferViews"].as_array_mut().unwrap().push(view);
    };
    assert_eq!(strip_changed(append), Some(Difference::DataStays));
    let forget = |json: &mut Value| {
        let data = json["extensions"]["VLM_virtual_light_mesh"]["data"].as_object_mut().unwrap();
        data.shift_remove("sourceDigest").unwrap();
    };
    assert_eq!(strip_changed(forget), Some(Difference::Unknown));
}

#[test]
fn baking_again_knows_the_first_source() {
    for (name, bytes) in sources() {
        let folder = tempfile::tempdir().unwrap();
        let to = target(name);
        let mut source = GltfFile::from_slice(&bytes, name, Some(folder.path())).unwrap();
        let mut written = Vec::new();
        // Another asset in between shows that nothing of it stays.
        for times in [3, 50, 3] {
            let asset = sample_asset::many_quads(&source, times);
            let outputs = write_vlm_with(&source, &asset, &to, &PLAIN).unwrap();
            write_atomic(&outputs, folder.path()).unwrap();
            source = GltfFile::open(&folder.path().join(name)).unwrap();
            written.push(outputs[0].bytes.clone());
        }
        assert!(written[0] == written[2], "{name}: baking again differs from baking once");
        let stripped = strip_vlm_compared(&source, &to).unwrap();
        assert!(stripped.files[0].bytes == bytes, "{name}: {}", first_difference(&stripped.files, &bytes));
    }
}

fn first_difference(files: &[OutputFile], expected: &[u8]) -> String {
    let found = &files[0].bytes;
    let at = found.iter().zip(expected).position(|(a, b)| a != b).unwrap_or(found.len().min(expected.len()));
    let context = |bytes: &[u8]| {
        String::from_utf8_lossy(&bytes[at.saturating_sub(40)..(at + 40).min(bytes.len())]).into_owned()
    };
    format!("byte {at}:\n  expected {}\n  found    {}", context(expected), context(found))
}

fn gltf_files(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            gltf_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "glb" || extension == "gltf") {
            found.push(path);
        }
    }
}

/// JSON of a file without the library's help.
fn json_of(bytes: &[u8]) -> Value {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    if !bytes.starts_with(b"glTF") {
        return serde_json::from_slice(bytes).unwrap();
    }
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(bytes[20..20 + length].trim_ascii_end().split(|&b| b == 0).next().unwrap())
        .unwrap()
}

#[test]
#[cfg_attr(not(has_corpus), ignore = "the corpus is neither in VLM_ASSETS nor in ../shared/assets")]
fn the_corpus_comes_back() {
    let Some(corpus) = assets::find("corpus") else { return };
    let mut paths = Vec::new();
    gltf_files(&corpus, &mut paths);
    let mut outcomes: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for path in paths {
        let Ok(file) = GltfFile::open(&path) else { continue };
        let source = fs::read(&path).unwrap();
        let to = target(path.to_str().unwrap());
        // Geometry that cannot be decoded has no digest, and so no Virtual Light Mesh.
        let Ok(written) = write_vlm_with(&file, &sample_asset::quads(&file), &to, &PLAIN) else {
            outcomes.entry(String::from("cannot be written")).or_default().push(path);
            continue;
        };
        let folder = tempfile::tempdir().unwrap();
        write_atomic(&written, folder.path()).unwrap();
        let baked = GltfFile::open(&folder.path().join(&to.file_name)).unwrap();
        let stripped = strip_vlm_compared(&baked, &to).unwrap();
        let same = stripped.files[0].bytes == source;
        let (before, after) = (json_of(&source), json_of(&stripped.files[0].bytes));
        assert!(before == after, "{}: the JSON differs", path.display());
        let outcome = match stripped.difference {
            None => String::from("same bytes"),
            Some(difference) => difference.to_string(),
        };
        // The digest tells the truth, except where it is not known.
        assert_eq!(same, stripped.difference.is_none(), "{}: {outcome}", path.display());
        outcomes.entry(outcome).or_default().push(path);
    }
    for (outcome, paths) in &outcomes {
        println!("{:>4}  {outcome:20} {}", paths.len(), paths[0].display());
    }
    let same = outcomes.get("same bytes").map_or(0, Vec::len);
    let all: usize = outcomes.values().map(Vec::len).sum();
    assert!(same >= 170 && same * 100 >= all * 98, "{same} of {all} come back byte by byte");
}

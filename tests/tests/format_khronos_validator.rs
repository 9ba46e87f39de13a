//! What is written passes the Khronos validator (npm package `gltf-validator`) with 0 errors.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::path::PathBuf;

use serde_json::{Value, json};
use vlm_format::{Container, GltfFile, Target, WriteOptions, write_atomic, write_vlm_with};
use vlm_tests::khronos::{errors, has_validator, validate};
use vlm_tests::{assets, sample_asset};

/// Files that are valid as they are.
const FILES: &[&str] = &[
    "trimesh/CesiumMilkTruck.glb",
    "sascha/CesiumMan/glTF-Binary/CesiumMan.glb",
    "generated/suzanne_quantized.glb",
    "generated/sparse_positions.gltf",
    "blender_io/19_sheen/19_sheen.gltf",
];

/// What each of them is written to, plain and compressed.
const CONTAINERS: [(Container, &str); 3] = [
    (Container::Glb, "out.glb"),
    (Container::Gltf { embedded: false }, "out.gltf"),
    (Container::Gltf { embedded: true }, "embedded.gltf"),
];

#[test]
#[cfg_attr(not(has_corpus), ignore = "the corpus is neither in VLM_ASSETS nor in ../shared/assets")]
#[cfg_attr(all(has_corpus, not(has_validator)), ignore = "tests/js has no node_modules: run tests/run")]
fn written_files_have_no_errors() {
    let (true, Some(corpus)) = (has_validator(), assets::find("corpus")) else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut written = Vec::new();
    let mut by_triangle = 0;
    for (i, name) in FILES.iter().enumerate() {
        let file = GltfFile::open(&corpus.join(name)).unwrap();
        let asset = sample_asset::many_quads(&file, 20);
        by_triangle += asset.triangle_tags.len();
        for (options, (container, file_name)) in [false, true]
            .into_iter()
            .flat_map(|compress| CONTAINERS.map(|to| (WriteOptions { compress }, to)))
        {
            let below = folder.path().join(format!("{i}{}", if options.compress { "c" } else { "" }));
            std::fs::create_dir_all(&below).unwrap();
            let target = Target { container, file_name: file_name.to_owned() };
            write_atomic(&write_vlm_with(&file, &asset, &target, &options).unwrap(), &below).unwrap();
            written.push(below.join(file_name));
            let json = GltfFile::open(&below.join(file_name)).unwrap().json().to_string();
            assert_eq!(json.contains("\"compression\":{\"mode\""), options.compress, "{name}");
            let required =
                GltfFile::open(&corpus.join(name)).unwrap().json().get("extensionsRequired").cloned();
            let json: Value = serde_json::from_str(&json).unwrap();
            assert_eq!(json.get("extensionsRequired"), required.as_ref(), "{name}");
        }
    }
    let inputs: Vec<PathBuf> = FILES.iter().map(|name| corpus.join(name)).collect();
    for report in validate(&inputs).iter().chain(&validate(&written)) {
        assert_eq!(errors(report), Vec::<&Value>::new(), "{}", report["file"]);
    }
    assert!(by_triangle > 0, "no file has tags by triangle");
    println!("{} files written, 0 errors", written.len());
}

#[test]
#[cfg_attr(not(has_corpus), ignore = "the corpus is neither in VLM_ASSETS nor in ../shared/assets")]
#[cfg_attr(all(has_corpus, not(has_validator)), ignore = "tests/js has no node_modules: run tests/run")]
fn a_broken_file_has_errors() {
    let (true, Some(corpus)) = (has_validator(), assets::find("corpus")) else { return };
    let file = GltfFile::open(&corpus.join("generated/sparse_positions.gltf")).unwrap();
    let target =
        Target { container: Container::Gltf { embedded: true }, file_name: String::from("broken.gltf") };
    let folder = tempfile::tempdir().unwrap();
    for compress in [false, true] {
        let asset = sample_asset::many_quads(&file, 20);
        let outputs = write_vlm_with(&file, &asset, &target, &WriteOptions { compress }).unwrap();
        let mut json: Value = serde_json::from_slice(&outputs[0].bytes).unwrap();
        *json["accessors"].as_array_mut().unwrap().last_mut().unwrap().get_mut("count").unwrap() =
            json!(100_000);
        json["extensionsUsed"] = json!([]);

        let path = folder.path().join("broken.gltf");
        std::fs::write(&path, json.to_string()).unwrap();
        let reports = validate(&[path]);
        let codes: Vec<&Value> = errors(&reports[0]).iter().map(|message| &message["code"]).collect();
        assert!(codes.contains(&&json!("ACCESSOR_TOO_LONG")), "{codes:?}");
    }
}

#[test]
fn the_validator_is_there_where_it_is_promised() {
    _ = has_validator();
}

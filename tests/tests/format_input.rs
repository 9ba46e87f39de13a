//! Bad and extreme input: one clear error with file, place, cause and remedy, or none at all.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::json;
use vlm_format::{Code, Container, Error, GltfFile, Target, VlmAsset, write_vlm};

fn open(json: &str) -> Result<GltfFile, Error> {
    GltfFile::from_slice(json.as_bytes(), "test.gltf", None)
}

fn first(result: Result<GltfFile, Error>) -> (Code, String) {
    match result {
        Err(Error::Invalid { issues, .. }) => (issues[0].code, issues[0].pointer.clone()),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("not refused"),
    }
}

/// A chain of nodes, each the child of the one before; the last has the given child.
fn chain(length: usize, last: &str) -> String {
    let mut nodes = String::new();
    for node in 1..length {
        write!(nodes, r#"{{"children":[{node}],"translation":[1,0,0]}},"#).unwrap();
    }
    format!(r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}{{{last}}}]}}"#)
}

#[test]
fn deep_hierarchies_do_not_exhaust_the_stack() {
    let length = 200_000;
    let file = open(&chain(length, r#""name":"leaf""#)).unwrap();
    assert_eq!(file.document().nodes().count(), length);
    let asset = VlmAsset { sample_starts: vec![0], grid: None, ..VlmAsset::default() };
    let target = Target { container: Container::Glb, file_name: String::from("deep.glb") };
    assert_eq!(write_vlm(&file, &asset, &target).unwrap().len(), 1);
    assert_eq!(first(open(&chain(length, r#""children":[0]"#))).0, Code::NodeCycle);
}

#[test]
fn nested_json_is_refused_before_it_exhausts_the_stack() {
    let deep = "[".repeat(100_000) + &"]".repeat(100_000);
    let text = format!(r#"{{"asset":{{"version":"2.0","extras":{deep}}}}}"#);
    assert_eq!(first(open(&text)).0, Code::JsonSyntax);
}

#[test]
fn many_warnings_do_not_hide_an_error() {
    let mut images = vec![json!({}); 5000];
    let json = |images: &[serde_json::Value]| {
        json!({ "asset": { "version": "2.0" }, "images": images, "cameras": [{ "type": "orthographic" }] })
            .to_string()
    };
    assert_eq!(first(open(&json(&images))), (Code::Missing, String::from("/cameras/0")));
    images.clear();
    assert_eq!(first(open(&json(&images))), (Code::Missing, String::from("/cameras/0")));
}

#[test]
fn a_file_that_is_not_there_is_named() {
    for path in ["/no/such/file.glb", "/"] {
        let error = GltfFile::open(Path::new(path)).unwrap_err().to_string();
        assert!(error.starts_with(path) && error.contains("cannot read"), "{error}");
    }
}

#[test]
fn a_pipe_has_no_files_beside_it() {
    let text = json!({ "asset": { "version": "2.0" }, "buffers": [{ "byteLength": 1, "uri": "a.bin" }] })
        .to_string();
    assert_eq!(first(open(&text)), (Code::UriNeedsFolder, String::from("/buffers/0/uri")));
}

#[cfg(unix)]
#[test]
fn only_regular_files_inside_the_folder_are_read() {
    let outside = tempfile::tempdir().unwrap();
    let folder = tempfile::tempdir().unwrap();
    fs::write(outside.path().join("secret.bin"), "x").unwrap();
    fs::write(folder.path().join("real.bin"), "x").unwrap();
    fs::create_dir(folder.path().join("folder.bin")).unwrap();
    std::os::unix::fs::symlink(outside.path(), folder.path().join("way_out")).unwrap();
    std::os::unix::fs::symlink(folder.path().join("real.bin"), folder.path().join("inside.bin")).unwrap();
    let open = |uri: &str| {
        let json = json!({ "asset": { "version": "2.0" }, "buffers": [{ "byteLength": 1, "uri": uri }] });
        GltfFile::from_slice(json.to_string().as_bytes(), "test.gltf", Some(folder.path()))
    };
    assert!(open("real.bin").is_ok() && open("./inside.bin").is_ok());
    assert_eq!(first(open("way_out/secret.bin")).0, Code::UriUnsafe);
    assert_eq!(first(open("folder.bin")).0, Code::UriUnreadable);
    assert_eq!(first(open("missing.bin")).0, Code::UriUnreadable);
}

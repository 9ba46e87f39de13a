//! The extension lives through glTF-Transform with our plugin, and `vlm check` says when it no longer fits.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use tempfile::TempDir;
use vlm_format::{
    GltfFile, Target, TriangleTags, VlmAsset, WriteOptions, read_vlm, read_vlm_unchecked, write_atomic,
    write_vlm_with,
};

use crate::support::{bake, check, npm, repository, said, vlm};

/// Steps of `tests/js/transform.mjs` that leave the scene as it is.
const KEPT: [&str; 8] = [
    "copy.glb",
    "copy.gltf",
    "clone.glb",
    "prune.glb",
    "dedup.glb",
    "resample.glb",
    "node_before.glb",
    "lights_only.glb",
];

/// Steps that change it, and what is then stale.
const CHANGED: [(&str, &str); 7] = [
    ("triangle_before.glb", "grid"),
    ("moved.glb", "grid"),
    // Pruning leaves a node that bears lights, though nothing is drawn there any more.
    ("undrawn.glb", "room"),
    ("simplify.glb", "sphere"),
    ("quantize.glb", "room"),
    ("join.glb", "room"),
    ("optimize.glb", "room"),
];

/// Runs all steps on a file of the folder; why each was not written, empty if it was.
fn transform(folder: &Path, input: &str, flags: &[&str]) -> BTreeMap<String, String> {
    npm();
    let script = repository("tests/js/transform.mjs");
    let output = Command::new("node").current_dir(folder).arg(script).args([input, "."]).args(flags).output();
    let output = output.unwrap();
    assert!(output.status.success(), "{}", said(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn open(folder: &Path, name: &str) -> GltfFile {
    GltfFile::open(&folder.join(name)).unwrap()
}

/// The asset, with nodes by name in place of their numbers, which may change.
fn lights(file: &GltfFile) -> (VlmAsset, Vec<String>) {
    let mut asset = read_vlm(file).unwrap().unwrap();
    let name = |node: u32| file.json()["nodes"][node as usize]["name"].as_str().unwrap().to_owned();
    let mut bearers: Vec<String> = asset.vlms.iter().map(|vlm| name(vlm.node)).collect();
    bearers.extend(asset.node_tags.iter().map(|&(node, tag)| format!("{} {tag}", name(node))));
    asset.vlms.iter_mut().for_each(|vlm| vlm.node = 0);
    asset.node_tags.clear();
    (asset, bearers)
}

/// A baked Cornell box with tags of every kind.
fn baked(compress: bool) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    bake("cornell.glb", folder.path(), "plain.glb");
    let file = open(folder.path(), "plain.glb");
    let tags = (0..file.triangle_count(0, 0).unwrap() as u32).map(|triangle| triangle % 3).collect();
    let asset = VlmAsset {
        primitive_tags: vec![(1, 0, 7)],
        triangle_tags: vec![TriangleTags { mesh: 0, primitive: 0, tags }],
        node_tags: vec![(2, 5)],
        ..read_vlm(&file).unwrap().unwrap()
    };
    let target = Target::from_path(Path::new("in.glb")).unwrap();
    write_atomic(&write_vlm_with(&file, &asset, &target, &WriteOptions { compress }).unwrap(), folder.path())
        .unwrap();
    folder
}

#[test]
#[cfg_attr(not(has_npm), ignore = "tests/js has no node_modules: run tests/run")]
fn lights_live_through_transforms_that_keep_the_scene() {
    for compress in [false, true] {
        let folder = baked(compress);
        let before = lights(&open(folder.path(), "in.glb"));
        let results = transform(folder.path(), "in.glb", &[]);
        for name in KEPT {
            assert_eq!(results[name], "", "{name}");
            assert_eq!(check(folder.path(), name), None, "{name}");
            assert_eq!(lights(&open(folder.path(), name)), before, "{name}");
            let json = open(folder.path(), name).json().to_string();
            assert_eq!(json.contains("\"compression\":{\"mode\""), compress, "{name}");
        }
        let numbers = |name| open(folder.path(), name).json()["nodes"].as_array().unwrap().len();
        assert_eq!(numbers("node_before.glb"), numbers("in.glb") + 1, "nothing was renumbered");
    }
}

#[test]
#[cfg_attr(not(has_npm), ignore = "tests/js has no node_modules: run tests/run")]
fn without_the_plugin_the_extension_is_gone() {
    let folder = baked(false);
    transform(folder.path(), "in.glb", &["--without-plugin"]);
    for name in KEPT {
        assert_eq!(check(folder.path(), name).as_deref(), Some("NO_VLM"), "{name}");
    }
}

#[test]
#[cfg_attr(not(has_npm), ignore = "tests/js has no node_modules: run tests/run")]
fn what_changes_the_scene_makes_the_lights_stale() {
    let folder = tempfile::tempdir().unwrap();
    bake("cornell_sphere.glb", folder.path(), "in.glb");
    let before = read_vlm(&open(folder.path(), "in.glb")).unwrap().unwrap();
    let results = transform(folder.path(), "in.glb", &[]);
    for (name, stale) in CHANGED {
        assert_eq!(results[name], "", "{name}");
        assert_eq!(check(folder.path(), name).as_deref(), Some("STALE"), "{name}");
        let words = said(&vlm(folder.path(), &["check", name]));
        assert!(words.contains(&format!("`{stale}`")), "{name}: {words}");
        // The lights themselves are whole: only what they stand for is another.
        let after = read_vlm_unchecked(&open(folder.path(), name)).unwrap().unwrap();
        assert_eq!(after.positions, before.positions, "{name}");
    }
}

#[test]
#[cfg_attr(not(has_npm), ignore = "tests/js has no node_modules: run tests/run")]
fn lights_of_two_files_are_not_merged() {
    let folder = baked(false);
    let why = &transform(folder.path(), "in.glb", &[])["twice.glb"];
    for part in ["2 files", "cannot be merged", "vlm strip", "vlm bake"] {
        assert!(why.contains(part), "`{part}` is missing in: {why}");
    }
}

#[test]
#[cfg_attr(not(has_npm), ignore = "tests/js has no node_modules: run tests/run")]
fn strip_takes_out_what_the_plugin_wrote() {
    let folder = baked(false);
    transform(folder.path(), "in.glb", &[]);
    assert!(vlm(folder.path(), &["strip", "copy.glb", "-o", "stripped.glb"]).status.success());
    assert!(vlm(folder.path(), &["strip", "in.glb", "-o", "bare.glb"]).status.success());
    transform(folder.path(), "bare.glb", &[]);
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(bytes("stripped.glb") == bytes("copy.glb"), "not what copying the source gives");
    assert!(bytes("stripped.glb") != bytes("in.glb"));
}

#[test]
#[cfg_attr(not(has_npm), ignore = "tests/js has no node_modules: run tests/run")]
fn a_damaged_extension_is_left_out_and_the_file_refused() {
    let folder = tempfile::tempdir().unwrap();
    bake("cornell.glb", folder.path(), "plain.gltf");
    let path = folder.path().join("plain.gltf");
    let mut json: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    json["extensions"]["VLM_virtual_light_mesh"]["lights"]["albedo"]["accessor"] = serde_json::json!(99);
    std::fs::write(&path, json.to_string()).unwrap();
    let results = transform(folder.path(), "plain.gltf", &[]);
    assert_eq!(results["copy.glb"], "");
    assert_eq!(check(folder.path(), "copy.glb").as_deref(), Some("STALE"));
}

#[test]
#[cfg_attr(not(has_npm), ignore = "tests/js has no node_modules: run tests/run")]
fn the_installed_plugin_is_this_one() {
    for file in ["index.js", "arrays.js", "properties.js", "package.json", "gltf-transform.config.mjs"] {
        let ours = std::fs::read(repository("vlm-format/gltf-transform-vlm").join(file)).unwrap();
        let installed = std::fs::read(npm().join("gltf-transform-vlm").join(file)).unwrap();
        assert!(ours == installed, "{file} differs from the installed one: run `npm ci --prefix tests/js`");
    }
}

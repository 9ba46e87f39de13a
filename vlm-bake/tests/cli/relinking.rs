//! `vlm relink` and sidecars, on files altered as other tools alter them, and on files of the tools themselves.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::{Value, json};
use vlm_format::{EXTENSION, GltfFile, VlmAsset, read_vlm};

use crate::support::{Document, Folders, read, repository, run, text};

const QUAD: [[f32; 3]; 4] = [[-0.5, -1.0, -0.5], [-0.5, -1.0, 0.5], [0.5, -1.0, 0.5], [0.5, -1.0, -0.5]];
const TALL: [[f32; 3]; 4] = [[-0.5, -1.0, -0.5], [0.5, -1.0, -0.5], [0.5, 1.0, -0.5], [-0.5, 1.0, -0.5]];

/// A room with a table and a screen in it.
fn furnished() -> Document {
    let mut document = Document::room();
    document.push("table", &[QUAD], Some(1));
    document.push("screen", &[TALL], Some(0));
    document
}

struct Baked {
    folders: Folders,
    source: Value,
    baked: String,
    sidecar: String,
}

fn baked(flags: &[&str]) -> Baked {
    let folders = Folders::new();
    let text_of_source = furnished().to_string();
    let input = folders.input("in.gltf", &text_of_source);
    let (baked, sidecar) = (folders.output("baked.gltf"), folders.output("sidecar.glb"));
    let arguments = ["bake", &input, "-o", &baked, "--lights", "60", "--sidecar", &sidecar];
    let result = run(arguments.into_iter().chain(flags.iter().copied()));
    assert!(result.status.success(), "{}", text(&result.stderr));
    Baked { folders, source: serde_json::from_str(&text_of_source).unwrap(), baked, sidecar }
}

impl Baked {
    /// Relinks the source as a tool has left it, from `from`.
    fn relink(&self, changed: &Value, from: &str, flags: &[&str]) -> (Output, String) {
        let (input, output) =
            (self.folders.input("tool.gltf", changed.to_string()), self.folders.output("out.glb"));
        let arguments = ["relink", &input, "-o", &output, "--from", from];
        (run(arguments.into_iter().chain(flags.iter().copied())), output)
    }
}

/// What a renumbering must not change.
fn content(asset: &VlmAsset) -> VlmAsset {
    let mut asset = asset.clone();
    asset.vlms.iter_mut().for_each(|vlm| vlm.node = 0);
    asset
}

#[track_caller]
fn passes(output: &Output, relinked: &str, expected: &VlmAsset) {
    assert!(output.status.success(), "{}", text(&output.stderr));
    let check = run(["check", relinked]);
    assert!(check.status.success(), "{}", text(&check.stderr));
    assert_eq!(content(&read(relinked)), content(expected));
}

#[track_caller]
fn refused(output: &Output, relinked: &str, parts: &[&str]) {
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    parts.iter().for_each(|part| assert!(message.contains(part), "`{part}` is missing in: {message}"));
    assert!(!Path::new(relinked).exists(), "something was written");
}

#[test]
fn what_was_dropped_comes_back_from_the_file_and_from_the_sidecar() {
    let baked = baked(&[]);
    let expected = read(&baked.baked);
    let bytes = |path: &Path| fs::metadata(path).unwrap().len();
    let is_data = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "bin");
    let data: u64 = baked.folders.outputs().iter().filter(|path| is_data(path)).map(|path| bytes(path)).sum();
    let small = bytes(Path::new(&baked.sidecar));
    assert!(small < data, "{small} bytes for {data}, which are not compressed");
    for from in [&baked.baked, &baked.sidecar] {
        let (output, relinked) = baked.relink(&baked.source, from, &[]);
        passes(&output, &relinked, &expected);
        assert_eq!(read(&relinked), expected);
    }
}

#[test]
fn a_sidecar_is_a_gltf_of_its_own() {
    let baked = baked(&[]);
    assert!(run(["check", &baked.sidecar]).status.success());
    let file = GltfFile::open(Path::new(&baked.sidecar)).unwrap();
    assert_eq!(file.document().meshes().count(), 0);
    assert_eq!(read_vlm(&file).unwrap().unwrap().triangles.len(), read(&baked.baked).triangles.len());
    let taken = baked.folders.output("taken.glb");
    let stripped = baked.folders.output("stripped.gltf");
    assert!(run(["strip", &baked.baked, "-o", &stripped, "--sidecar", &taken]).status.success());
    assert!(fs::read(taken).unwrap() == fs::read(&baked.sidecar).unwrap(), "another sidecar than the bake's");
}

#[test]
fn renumbered_and_renamed_nodes_are_found_by_what_they_show() {
    let baked = baked(&[]);
    let mut json = baked.source.clone();
    json["nodes"].as_array_mut().unwrap().swap(0, 2);
    json["meshes"].as_array_mut().unwrap().swap(0, 1);
    for node in json["nodes"].as_array_mut().unwrap() {
        let mesh = node["mesh"].as_u64().unwrap();
        node["mesh"] = json!([1, 0, 2][mesh as usize]);
        node["name"] = json!(format!("Mesh_{mesh}"));
    }
    for from in [&baked.baked, &baked.sidecar] {
        let (output, relinked) = baked.relink(&json, from, &[]);
        passes(&output, &relinked, &read(&baked.baked));
        assert!(text(&output.stdout).contains("`table` is now `Mesh_1`"), "{}", text(&output.stdout));
        let nodes: Vec<u32> = read(&relinked).vlms.iter().map(|vlm| vlm.node).collect();
        assert_eq!(nodes[0], 2, "the room is the last node now");
    }
}

#[test]
fn what_changed_is_refused_by_name() {
    let baked = baked(&[]);
    let change = |change: fn(&mut Value), parts: &[&str]| {
        let mut json = baked.source.clone();
        change(&mut json);
        for from in [&baked.baked, &baked.sidecar] {
            let (output, relinked) = baked.relink(&json, from, &[]);
            refused(&output, &relinked, parts);
        }
    };
    change(
        |json| json["materials"][1]["pbrMetallicRoughness"]["baseColorFactor"][0] = json!(0.2),
        &["`table`: geometry or colours of `table` changed"],
    );
    change(|json| json["nodes"][2]["translation"] = json!([0, 0, 1]), &["`grid`: `screen` was moved"]);
    change(
        |json| {
            json["nodes"].as_array_mut().unwrap().pop();
            json["scenes"][0]["nodes"] = json!([0, 1]);
        },
        &["no object has the geometry of `screen`"],
    );
    change(
        |json| {
            json["nodes"].as_array_mut().unwrap().push(json!({ "mesh": 1, "name": "second" }));
            json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
        },
        &["`grid`: `second` was added"],
    );
}

#[test]
fn without_a_grid_objects_may_move() {
    let baked = baked(&["--probes", "0"]);
    let mut json = baked.source.clone();
    json["nodes"][2]["translation"] = json!([0, 0, 1]);
    let (output, relinked) = baked.relink(&json, &baked.baked, &[]);
    passes(&output, &relinked, &read(&baked.baked));
}

#[test]
fn force_takes_what_still_hides_its_lights() {
    let baked = baked(&["--probes", "0"]);
    let mut recoloured = baked.source.clone();
    recoloured["materials"][1]["pbrMetallicRoughness"]["baseColorFactor"][0] = json!(0.2);
    let (output, relinked) = baked.relink(&recoloured, &baked.baked, &["--force"]);
    passes(&output, &relinked, &read(&baked.baked));
    assert!(text(&output.stderr).contains("`table` changed"), "{}", text(&output.stderr));
    fs::remove_file(relinked).unwrap();

    // Only a floor is left of the room, and 0.1 m higher: what the lights of the rest stood for is gone.
    let mut floor = Document::new();
    floor.push(
        "room",
        &[[[-1.9, -1.9, 1.9], [1.9, -1.9, 1.9], [1.9, -1.9, -1.9], [-1.9, -1.9, -1.9]]],
        Some(0),
    );
    floor.push("table", &[QUAD], Some(1));
    floor.push("screen", &[TALL], Some(0));
    let floor: Value = serde_json::from_str(&floor.to_string()).unwrap();
    let (output, relinked) = baked.relink(&floor, &baked.baked, &["--force"]);
    refused(&output, &relinked, &["`room` changed", "no longer lie on a surface", "STALE"]);
}

#[test]
fn renumbered_accessors_are_found_by_their_content() {
    for flags in [&[][..], &["--compress"]] {
        let baked = baked(flags);
        let expected = read(&baked.baked);
        let mut json: Value = serde_json::from_slice(&fs::read(&baked.baked).unwrap()).unwrap();
        // The last becomes the first: all others move on by one.
        json["accessors"].as_array_mut().unwrap().rotate_right(1);
        let count = json["accessors"].as_array().unwrap().len() as u64;
        for primitive in ["0", "1", "2"].map(|mesh| format!("/meshes/{mesh}/primitives/0")) {
            for key in ["/indices", "/attributes/POSITION"] {
                let accessor = json.pointer_mut(&format!("{primitive}{key}")).unwrap();
                *accessor = json!((accessor.as_u64().unwrap() + 1) % count);
            }
        }
        fs::write(&baked.baked, json.to_string()).unwrap();
        assert_eq!(run(["check", &baked.baked]).status.code(), Some(1), "the negative control");
        let relinked = baked.folders.output("out.glb");
        let output = run(["relink", &baked.baked, "-o", &relinked]);
        passes(&output, &relinked, &expected);
    }
}

#[test]
fn a_file_without_anything_to_attach_is_refused() {
    let folders = Folders::new();
    let (source, relinked) = (repository("assets/cornell.glb"), folders.output("out.glb"));
    refused(&run(["relink", &source, "-o", &relinked]), &relinked, &["NO_VLM", "--from"]);
    let from = run(["relink", &source, "-o", &relinked, "--from", &source]);
    refused(&from, &relinked, &["cornell.glb", "NO_VLM"]);
}

/// A program of an npm package, where it is installed; its absence fails where `VLM_REQUIRE_NPM=1` promises it.
fn npm(program: &str) -> Option<PathBuf> {
    let path = PathBuf::from(repository("tests/js/node_modules/.bin")).join(program);
    let required = std::env::var("VLM_REQUIRE_NPM").is_ok_and(|value| value == "1");
    assert!(path.exists() || !required, "tests/js has no `{program}` although VLM_REQUIRE_NPM=1");
    if !path.exists() {
        eprintln!("ignored: `{program}` is not among the node modules of tests/js");
    }
    path.exists().then_some(path)
}

#[test]
fn real_tools_drop_it_and_relink_attaches_it() {
    let folders = Folders::new();
    let (source, baked) = (repository("assets/cornell.glb"), folders.output("baked.glb"));
    let sidecar = folders.output("sidecar.glb");
    let arguments =
        ["bake", &source, "-o", &baked, "--lights", "60", "--probes", "100", "--sidecar", &sidecar];
    assert!(run(arguments).status.success());
    let tools: [(&str, &[&str]); 3] = [
        ("gltf-transform", &["copy", "IN", "OUT"]),
        ("gltf-pipeline", &["-i", "IN", "-o", "OUT"]),
        ("gltfpack", &["-i", "IN", "-o", "OUT", "-noq", "-kn", "-km"]),
    ];
    for (tool, arguments) in tools {
        let Some(program) = npm(tool) else { continue };
        let optimised = folders.output(&format!("{tool}.glb"));
        let arguments = arguments.iter().map(|&argument| match argument {
            "IN" => baked.as_str(),
            "OUT" => optimised.as_str(),
            other => other,
        });
        let output = Command::new(program).args(arguments).output().unwrap();
        assert!(output.status.success(), "{tool}: {}", text(&output.stderr));
        assert_eq!(run(["check", &optimised]).status.code(), Some(1), "{tool} kept the extension");
        for from in [&baked, &sidecar] {
            let relinked = folders.output("out.glb");
            let output = run(["relink", &optimised, "-o", &relinked, "--from", from]);
            passes(&output, &relinked, &read(&baked));
        }
    }
}

#[test]
fn the_tree_of_a_sidecar_names_no_mesh_and_keeps_places() {
    let baked = baked(&[]);
    let file = GltfFile::open(Path::new(&baked.sidecar)).unwrap();
    let nodes = file.json()["nodes"].as_array().unwrap();
    assert!(nodes.iter().all(|node| node.get("mesh").is_none()));
    let names: Vec<&str> = nodes.iter().map(|node| node["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["room", "table", "screen"]);
    assert!(file.json()["extensions"].get(EXTENSION).is_some());
}

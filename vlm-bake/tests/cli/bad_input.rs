//! Bad input: one clear error with file, place, cause and remedy, the right exit code, and no file left behind.

use std::fs::File;
use std::process::{Command, Output};

use serde_json::json;

use crate::support::{Document, Folders, repository, run, text, vlm};

/// The input or the result failed a check.
const FAILED: i32 = 1;
/// The command could not run.
const COULD_NOT_RUN: i32 = 2;

/// Bakes an input that must be refused with all `parts` in the message.
#[track_caller]
fn refused(name: &str, bytes: impl AsRef<[u8]>, parts: &[&str]) {
    let folders = Folders::new();
    let input = folders.input(name, bytes);
    let output = run(["bake", &input, "-o", &folders.output("out.glb")]);
    one_error(&output, FAILED, parts);
    one_error(&output, FAILED, &[name]);
    assert!(folders.outputs().is_empty(), "{:?}", folders.outputs());
}

#[track_caller]
fn one_error(output: &Output, code: i32, parts: &[&str]) {
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{message}");
    assert_eq!(message.lines().count(), 1, "{message}");
    assert!(message.starts_with("error: "), "{message}");
    for part in parts {
        assert!(message.contains(part), "`{part}` is missing in: {message}");
    }
    assert_eq!(text(&output.stdout), "");
}

/// A room whose only buffer has this URI.
fn with_buffer_uri(uri: &str) -> String {
    let mut document = Document::room();
    document.json["buffers"] = json!([{ "byteLength": 1024, "uri": uri }]);
    document.to_string()
}

#[test]
fn the_room_itself_is_accepted() {
    // The negative control of every case below.
    let folders = Folders::new();
    let lights = folders.bake(&Document::room(), &["--lights", "100"]).triangles.len();
    assert!(lights > 0);
}

#[test]
fn not_a_gltf() {
    refused(
        "picture.glb",
        b"\x89PNG\r\n\x1a\n no model at all",
        &["NOT_GLTF", "export the model as glTF 2.0"],
    );
}

#[test]
fn empty_file() {
    refused("empty.glb", b"", &["export"]);
}

#[test]
fn truncated_glb() {
    let whole = std::fs::read(repository("assets/cornell.glb")).unwrap();
    refused("short.glb", &whole[..whole.len() / 2], &["GLB_DAMAGED", "download the file again"]);
}

#[test]
fn buffer_file_missing() {
    refused(
        "a.gltf",
        with_buffer_uri("gone.bin"),
        &["/buffers/0", "gone.bin", "put the file beside the glTF"],
    );
}

#[test]
fn buffer_uri_leaves_the_folder() {
    refused("a.gltf", with_buffer_uri("../secret.bin"), &["/buffers/0", "../secret.bin", "relative path"]);
}

#[test]
fn buffer_uri_is_absolute() {
    for uri in ["/etc/passwd", "file:///etc/passwd"] {
        refused("a.gltf", with_buffer_uri(uri), &["/buffers/0", uri, "relative path"]);
    }
}

#[test]
fn vertex_index_out_of_range() {
    let mut document = Document::room();
    document.json["accessors"][0]["count"] = json!(8);
    refused("a.gltf", document.to_string(), &["/accessors/1", "VERTEX_INDEX", "export the file again"]);
}

#[test]
fn material_index_out_of_range() {
    let mut document = Document::room();
    document.json["meshes"][0]["primitives"][0]["material"] = json!(99);
    let place = "/meshes/0/primitives/0/material";
    refused("a.gltf", document.to_string(), &[place, "INDEX_OUT_OF_RANGE", "export the file again"]);
}

#[test]
fn positions_not_numbers() {
    let mut document = Document::new();
    document.push(
        "hole",
        &[[[0.0, 0.0, 0.0], [1.0, f32::NAN, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]],
        Some(0),
    );
    refused("a.gltf", document.to_string(), &["/accessors/0", "VERTEX_NOT_FINITE", "delete the vertex"]);
}

#[test]
fn nodes_in_a_circle() {
    let mut document = Document::room();
    document.json["nodes"] = json!([{ "children": [1], "mesh": 0 }, { "children": [0] }]);
    document.json["scenes"][0]["nodes"] = json!([0]);
    refused("a.gltf", document.to_string(), &["/nodes/", "NODE_CYCLE", "make the node hierarchy a tree"]);
}

#[test]
fn no_triangles() {
    let document =
        json!({ "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{}] });
    refused("a.gltf", document.to_string(), &["no triangles"]);
}

#[test]
fn meshes_that_no_scene_draws() {
    let json = Document::room().to_string();
    let mut nowhere: serde_json::Value = serde_json::from_str(&json).unwrap();
    nowhere["scenes"][0]["nodes"] = json!([]);
    nowhere["nodes"] = json!([]);
    refused("a.gltf", nowhere.to_string(), &["no node places any of its meshes", "check what was exported"]);
    let mut elsewhere: serde_json::Value = serde_json::from_str(&json).unwrap();
    elsewhere["scenes"][0]["nodes"] = json!([]);
    refused(
        "a.gltf",
        elsewhere.to_string(),
        &["in the scene that is drawn", "which scene is the file's default"],
    );
    elsewhere["meshes"] = json!([]);
    elsewhere["nodes"] = json!([]);
    refused("a.gltf", elsewhere.to_string(), &["it holds no mesh", "check what was exported"]);
}

#[test]
fn triangles_too_thin_for_any_light() {
    let mut document = Document::new();
    document.push(
        "wire",
        &[[[0.0, 0.0, 0.0], [1000.0, 0.0, 0.0], [1000.0, 0.01, 0.0], [0.0, 0.01, 0.0]]],
        Some(0),
    );
    refused("a.gltf", document.to_string(), &["more than 100 times as long as high", "divide them"]);
}

#[test]
fn scenes_that_single_precision_cannot_hold() {
    let scaled = |key: &str, value: serde_json::Value| {
        let mut document = Document::room();
        document.json["nodes"][0][key] = value;
        document.to_string()
    };
    let far = &["/meshes/0/primitives/0", "farther than 100000000 m", "correct the mesh"];
    refused("a.gltf", scaled("scale", json!([1e8, 1e8, 1e8])), far);
    refused("a.gltf", scaled("translation", json!([1e30, 0, 0])), far);
    refused("a.gltf", scaled("translation", json!([1e7, 0, 0])), &["move the scene to the origin"]);
    refused("a.gltf", scaled("scale", json!([1e-12, 1e-12, 1e-12])), &["m wide", "glTF's unit is the metre"]);
}

#[test]
fn authored_meshes_that_leave_nothing() {
    let mut document = Document::room();
    document.push(
        "VLM_hole",
        &[[[-9.0, -9.0, -9.0], [9.0, -9.0, -9.0], [9.0, 9.0, 9.0], [-9.0, 9.0, 9.0]]],
        None,
    )["extras"] = json!({ "vlm": { "mode": "subtract" } });
    refused("a.gltf", document.to_string(), &["authored meshes take all of them away", "smaller"]);
}

#[test]
fn more_vertices_than_allowed() {
    let folders = Folders::new();
    let (input, output) = (folders.input("a.gltf", Document::room().to_string()), folders.output("out.glb"));
    let bake = |limit| {
        run(["bake", &input, "-o", &output, "--lights", "60", "--probes", "0", "--max-vertices", limit])
    };
    one_error(&bake("35"), FAILED, &["a.gltf", "more than 35 vertices", "--max-vertices"]);
    // Flat shading: the corners of twelve triangles.
    assert!(bake("36").status.success());
}

#[test]
fn textures_in_ktx2() {
    let mut document = Document::room();
    document.json["extensionsUsed"] = json!(["KHR_texture_basisu"]);
    document.json["extensionsRequired"] = json!(["KHR_texture_basisu"]);
    let command = "npx @gltf-transform/cli ktxdecompress";
    refused("a.gltf", document.to_string(), &["/extensionsRequired/0", "KTX2", command]);
}

#[test]
fn a_newer_reader_is_needed() {
    let mut document = Document::room();
    document.json["asset"]["minVersion"] = json!("2.1");
    refused("a.gltf", document.to_string(), &["/asset/minVersion", "needs a reader of glTF `2.1`"]);
}

#[test]
fn buffer_without_data() {
    let mut document = Document::room();
    document.json["buffers"] = json!([{ "byteLength": 1024 }]);
    refused("a.gltf", document.to_string(), &["/buffers/0", "no uri", "1024 bytes", "BUFFER_MISSING"]);
}

#[test]
fn glb_without_chunks() {
    refused("a.glb", b"glTF\x02\0\0\0\x0c\0\0\0", &["promises 12 bytes, too few for a chunk", "GLB_DAMAGED"]);
}

#[test]
fn draco() {
    let mut document = Document::room();
    document.json["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    document.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    let command = "npx @gltf-transform/cli copy";
    refused("a.gltf", document.to_string(), &["/extensionsRequired/0", "DRACO", command]);
}

#[test]
fn nothing_reflects() {
    let mut document = Document::room();
    document.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0, 0, 0, 1]);
    refused("a.gltf", document.to_string(), &["reflects or emits", "Give at least one surface"]);
}

#[test]
fn input_that_does_not_exist() {
    let output = run(["bake", "no such file.glb", "-o", "out.glb"]);
    one_error(&output, COULD_NOT_RUN, &["no such file.glb", "cannot read", "check the path"]);
}

#[test]
fn output_folder_that_does_not_exist() {
    let folders = Folders::new();
    let target = folders.output("missing/out.glb");
    let output = run(["bake", &repository("assets/cornell.glb"), "-o", &target]);
    one_error(&output, COULD_NOT_RUN, &[&target, "does not exist", "create it"]);
    assert!(folders.outputs().is_empty());
}

#[test]
fn output_neither_glb_nor_gltf() {
    let folders = Folders::new();
    let target = folders.output("out.obj");
    let output = run(["bake", &repository("assets/cornell.glb"), "-o", &target]);
    one_error(&output, COULD_NOT_RUN, &[&target, "name the output .glb or .gltf"]);
}

#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "there is no /dev/full")]
fn full_disk_behind_a_pipe() {
    for arguments in [["bake", "-o", "-"].as_slice(), ["strip", "-o", "-"].as_slice(), &["bake", "-o", "OUT"]]
    {
        let folders = Folders::new();
        let target = folders.output("out.glb");
        let input = repository("assets/cornell.glb");
        let arguments = arguments.iter().map(|&a| if a == "OUT" { target.as_str() } else { a });
        let full = File::options().write(true).open("/dev/full").unwrap();
        let output = vlm(arguments.chain([input.as_str()])).stdout(full).output().unwrap();
        one_error(&output, COULD_NOT_RUN, &["standard output", "No space left", "check the disk"]);
    }
}

/// A disk of 4 KiB; only root may make one.
#[test]
#[ignore = "needs root to mount a small disk; run with --ignored"]
fn full_disk() {
    let folders = Folders::new();
    let disk = folders.output("");
    let mount = Command::new("mount").args(["-t", "tmpfs", "-o", "size=4k", "tmpfs", &disk]).status();
    assert!(mount.unwrap().success());
    let output = run(["bake", &repository("assets/cornell.glb"), "-o", &folders.output("out.glb")]);
    let left = folders.outputs();
    assert!(Command::new("umount").arg(&disk).status().unwrap().success());
    one_error(&output, COULD_NOT_RUN, &["out.glb", "free some disk space"]);
    assert!(left.is_empty(), "{left:?}");
}

//! `vlm check`, `vlm inspect` and `vlm strip` on what was baked.

use std::path::Path;

use serde_json::{Value, json};
use vlm_format::{GltfFile, Target, TriangleTags, VlmAsset, write_atomic, write_vlm};

use crate::support::{Document, Folders, repository, run, text};

fn json_of(output: &std::process::Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Bakes a room into a .gltf with its data inside and beside it.
fn baked_room(folders: &Folders) -> String {
    let (input, output) =
        (folders.input("room.gltf", Document::room().to_string()), folders.output("room.gltf"));
    assert!(run(["bake", &input, "-o", &output, "--lights", "60"]).status.success());
    output
}

#[test]
fn check_accepts_what_was_baked() {
    let folders = Folders::new();
    let baked = baked_room(&folders);
    let output = run(["check", &baked]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).starts_with("ok "));
    let output = run(["check", &baked, "--json"]);
    assert_eq!(json_of(&output)[0]["ok"], json!(true));
    assert_eq!(json_of(&output)[0]["issues"], json!([]));
}

#[test]
fn check_names_what_is_stale() {
    let folders = Folders::new();
    let baked = baked_room(&folders);
    let mut json: Value = serde_json::from_slice(&std::fs::read(&baked).unwrap()).unwrap();
    // Moves one vertex of the room: its data is the first buffer, a data URI.
    let uri = json["buffers"][0]["uri"].as_str().unwrap().to_owned();
    let (head, data) = uri.split_once(',').unwrap();
    let moved = format!("{head},{}{}", if data.starts_with('A') { "C" } else { "A" }, &data[1..]);
    json["buffers"][0]["uri"] = json!(moved);
    std::fs::write(&baked, json.to_string()).unwrap();

    let output = run(["check", &baked, "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let message = text(&output.stderr);
    assert_eq!(message.lines().count(), 1, "{message}");
    for part in ["error: ", "room.gltf", "`room`", "bake again"] {
        assert!(message.contains(part), "`{part}` is missing in: {message}");
    }
    let issues = &json_of(&output)[0]["issues"];
    assert_eq!(issues[0]["code"], json!("STALE"));
    assert_eq!(issues[0]["vlm"], json!("room"));
}

#[test]
fn check_sees_that_another_tool_dropped_the_extension() {
    let output = run(["check", &repository("assets/cornell.glb"), "--json"]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(json_of(&output)[0]["issues"][0]["code"], json!("NO_VLM"));
}

#[test]
fn check_lists_every_issue_of_every_file() {
    let folders = Folders::new();
    let mut document = Document::room();
    document.json["meshes"][0]["primitives"][0]["material"] = json!(99);
    document.json["scenes"][0]["nodes"] = json!([0, 7]);
    let broken = folders.input("broken.gltf", document.to_string());
    let output = run(["check", &baked_room(&folders), &broken, "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let found = json_of(&output);
    assert_eq!((&found[0]["ok"], &found[1]["ok"]), (&json!(true), &json!(false)));
    let pointers: Vec<&str> =
        found[1]["issues"].as_array().unwrap().iter().map(|i| i["pointer"].as_str().unwrap()).collect();
    assert!(pointers.contains(&"/scenes/0/nodes/1"), "{pointers:?}");
    assert!(pointers.contains(&"/meshes/0/primitives/0/material"), "{pointers:?}");
}

#[test]
fn inspect_counts() {
    let folders = Folders::new();
    let baked = baked_room(&folders);
    let asset = crate::support::read(&baked);
    let content = json_of(&run(["inspect", &baked, "--json"]));
    assert_eq!(content["lights"], json!(asset.triangles.len()));
    assert_eq!(content["samples"], json!(asset.samples.len()));
    assert_eq!(content["vlms"][0]["node"], json!(0));
    assert_eq!(content["settings"]["preset"], json!("game"));
    let grid = asset.grid.unwrap();
    assert_eq!(content["grid"]["near_entries"], json!(grid.near.len()));
    assert_eq!(content["grid"]["probes"], json!(grid.probes.len()));
    assert_eq!(content["grid"]["leaves"], json!(grid.leaves.len() - 1));
    let sum = |list: &str, key: &str| -> u64 {
        content["grid"][list].as_array().unwrap().iter().map(|item| item[key].as_u64().unwrap()).sum()
    };
    for histogram in ["probes_of_leaves", "near_lights_of_leaves"] {
        assert_eq!(sum(histogram, "count"), grid.leaves.len() as u64 - 1, "{histogram}");
    }
    let levels = content["grid"]["leaves_by_level"].as_array().unwrap();
    assert_eq!(levels.iter().map(|n| n.as_u64().unwrap()).sum::<u64>(), grid.leaves.len() as u64 - 1);
    assert_eq!(sum("bytes_by_array", "bytes"), grid.byte_len() as u64);
    let lines = run(["inspect", &baked]);
    for line in ["vlm       room (node 0)", "grid      ", "bytes     rows", " #"] {
        assert!(text(&lines.stdout).contains(line), "{line} in {}", text(&lines.stdout));
    }
}

#[test]
fn the_grid_is_as_large_as_asked_or_not_there() {
    let folders = Folders::new();
    let bake = |flags: &[&str]| folders.bake(&Document::room(), &[&["--lights", "60"], flags].concat());
    // However few are asked, probes lie no farther apart than a 16th of the scene.
    let (coarse, fine) = (bake(&["--probes", "20"]), bake(&["--probes", "6000"]));
    let probes = |asset: &VlmAsset| asset.grid.as_ref().unwrap().probes.len();
    assert!(3 * probes(&coarse) < 2 * probes(&fine), "{} and {}", probes(&coarse), probes(&fine));
    assert_eq!((coarse.settings.probes, fine.settings.probes), (20, 6000));

    let near = |asset: &VlmAsset| asset.grid.as_ref().unwrap().near.len();
    assert_eq!(near(&bake(&["--probes", "20", "--near", "0"])), 0);
    assert!(near(&coarse) > 0);
    let rows = |asset: &VlmAsset| asset.grid.as_ref().unwrap().rows.len();
    assert!(rows(&bake(&["--probes", "20", "--rays", "16"])) < rows(&coarse), "few rays meet fewer sources");

    assert_eq!(bake(&["--probes", "0"]).grid, None);
    let content = run(["inspect", &folders.output("out.glb")]);
    assert!(text(&content.stdout).contains("grid      none"), "{}", text(&content.stdout));
    assert_eq!(json_of(&run(["inspect", &folders.output("out.glb"), "--json"]))["grid"], Value::Null);
}

#[test]
fn inspect_counts_tags() {
    let folders = Folders::new();
    let baked = baked_room(&folders);
    let file = GltfFile::open(Path::new(&baked)).unwrap();
    let drawn = file.triangle_count(0, 0).unwrap();
    let tags = (0..drawn as u32).map(|triangle| triangle % 3).collect();
    let asset = VlmAsset {
        primitive_tags: Vec::new(),
        triangle_tags: vec![TriangleTags { mesh: 0, primitive: 0, tags }],
        node_tags: vec![(0, 5)],
        ..crate::support::read(&baked)
    };
    let outputs = write_vlm(&file, &asset, &Target::from_path(Path::new(&baked)).unwrap()).unwrap();
    write_atomic(&outputs, Path::new(&baked).parent().unwrap()).unwrap();

    let content = json_of(&run(["inspect", &baked, "--json"]));
    assert_eq!((drawn, &content["tagged_triangles"]), (12, &json!(8)));
    assert_eq!((&content["partly_tagged_primitives"], &content["tagged_primitives"]), (&json!(1), &json!(0)));
    assert_eq!(content["tagged_nodes"], json!(1));
    let lines = run(["inspect", &baked]);
    let expected = "tagged 1 nodes, 0 primitives, 8 triangles of 1 more primitives";
    assert!(text(&lines.stdout).contains(expected), "{}", text(&lines.stdout));
}

#[test]
fn inspect_without_a_vlm_fails() {
    let output = run(["inspect", &repository("assets/cornell.glb")]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("bake it first"));
}

#[test]
fn strip_gives_back_what_was_baked() {
    let folders = Folders::new();
    let source = repository("assets/cornell.glb");
    let (baked, stripped) = (folders.output("baked.glb"), folders.output("stripped.glb"));
    assert!(run(["bake", &source, "-o", &baked, "--lights", "60"]).status.success());
    let output = run(["strip", &baked, "-o", &stripped]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(std::fs::read(stripped).unwrap() == std::fs::read(source).unwrap(), "not the same bytes");
}

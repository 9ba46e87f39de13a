//! `vlm diff`, and the bytes of `vlm inspect`.

use std::path::Path;
use std::process::Output;

use glam::Vec3;
use serde_json::{Value, json};
use vlm_format::{GltfFile, VlmAsset, write_atomic, write_vlm};

use crate::support::{Document, Folders, read, repository, run, text};

fn json_of(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A baked room, and the same with its asset altered.
fn pair(folders: &Folders, alter: impl FnOnce(&mut VlmAsset)) -> [String; 2] {
    let input = folders.input("room.gltf", Document::room().to_string());
    let [a, b] = ["a.glb", "b.glb"].map(|name| folders.output(name));
    let result = run(["bake", &input, "-o", &a, "--lights", "60", "--probes", "20"]);
    assert!(result.status.success(), "{}", text(&result.stderr));
    let file = GltfFile::open(Path::new(&a)).unwrap();
    let mut asset = read(&a);
    alter(&mut asset);
    let target = vlm_format::Target::from_path(Path::new(&b)).unwrap();
    write_atomic(&write_vlm(&file, &asset, &target).unwrap(), Path::new(&b).parent().unwrap()).unwrap();
    [a, b]
}

#[track_caller]
fn differs([a, b]: &[String; 2], part: &str) -> Value {
    let output = run(["diff", a, b]);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "", "a difference is no error");
    assert!(text(&output.stdout).contains(part), "`{part}` is missing in: {}", text(&output.stdout));
    json_of(&run(["diff", a, b, "--json"]))
}

#[test]
fn the_same_is_the_same() {
    let folders = Folders::new();
    let [a, b] = pair(&folders, |_| ());
    let output = run(["diff", &a, &b]);
    assert_eq!(output.status.code(), Some(0), "{}{}", text(&output.stdout), text(&output.stderr));
    assert!(text(&output.stdout).starts_with("same "));
    assert_eq!(json_of(&run(["diff", &a, &b, "--json"]))["same"], json!(true));
}

#[test]
fn moved_lights_are_counted_and_measured() {
    let folders = Folders::new();
    // The vertices of one light move as a whole; those that share them change their shape.
    let files = pair(&folders, |asset| {
        let corners = asset.triangles[3];
        corners.iter().for_each(|&vertex| asset.positions[vertex as usize] += Vec3::new(0.0, 0.0, 0.003));
    });
    let report = differs(&files, "moved by up to 3.000 mm");
    let object = &report["objects"][0];
    assert!((object["moved"]["max"].as_f64().unwrap() - 0.003).abs() < 1e-6, "{object}");
    assert_eq!((&object["added"], &object["removed"]), (&json!(0), &json!(0)));
    assert_eq!(object["recoloured"]["count"], json!(0));
}

#[test]
fn colour_emission_tags_and_samples_are_told_apart() {
    let folders = Folders::new();
    let of = |alter: fn(&mut VlmAsset), part: &str| {
        let report = differs(&pair(&folders, alter), part);
        assert_eq!(report["objects"][0]["moved"]["count"], json!(0));
        report
    };
    let report = of(
        |asset| {
            let range = asset.sample_starts[5] as usize..asset.sample_starts[6] as usize;
            asset.samples[range].iter_mut().for_each(|sample| sample.reflectance *= 0.5);
        },
        "1 light recoloured by up to",
    );
    let power = |key: &str| report["reflected_m2"][key][0].as_f64().unwrap();
    assert!(power("to") < power("from"), "{report}");
    of(
        |asset| {
            asset.emission = vec![Vec3::ZERO; asset.triangles.len()];
            asset.emission[2] = Vec3::ONE;
        },
        "1 light emit otherwise, by up to 1.000 lx",
    );
    of(
        |asset| asset.tags = (0..asset.triangles.len() as u32).map(|i| u32::from(i < 2)).collect(),
        "2 lights with another tag",
    );
    of(|asset| asset.samples[0].position.x += 1e-4, "1 light with other samples");
}

#[test]
fn another_budget_adds_and_removes() {
    let folders = Folders::new();
    let input = folders.input("room.gltf", Document::room().to_string());
    let [a, b] = ["a.glb", "b.glb"].map(|name| folders.output(name));
    for (output, lights) in [(&a, "60"), (&b, "200")] {
        assert!(run(["bake", &input, "-o", output, "--lights", lights]).status.success());
    }
    let report = differs(&[a.clone(), b.clone()], "settings  lights 60 -> 200");
    let object = &report["objects"][0];
    let number = |key: &str| object[key].as_i64().unwrap();
    let lights = [0, 1].map(|side| object["lights"][side].as_i64().unwrap());
    assert_eq!(lights[0] + number("added") - number("removed"), lights[1], "{object}");
    assert!(number("added") > 0, "{object}");
    assert!(!report["grid"]["numbers"].as_array().unwrap().is_empty(), "{report}");
    let clearance = run(["diff", &a, &b, "--clearance", "--json"]);
    assert_eq!(json_of(&clearance)["clearance"][1]["violations"], json!(0));
}

#[test]
fn objects_come_and_go() {
    let folders = Folders::new();
    let mut document = Document::room();
    let (with, without) = (folders.output("with.glb"), folders.output("without.glb"));
    let bake = |document: &Document, output: &str| {
        let input = folders.input("in.gltf", document.to_string());
        assert!(run(["bake", &input, "-o", output, "--lights", "60", "--probes", "0"]).status.success());
    };
    bake(&document, &without);
    document.push(
        "table",
        &[[[-0.5, -1.0, -0.5], [-0.5, -1.0, 0.5], [0.5, -1.0, 0.5], [0.5, -1.0, -0.5]]],
        Some(1),
    );
    bake(&document, &with);
    differs(&[without.clone(), with.clone()], "`table`: new, with");
    differs(&[with, without], "`table`: gone, with its");
}

#[test]
fn what_cannot_be_compared_exits_with_2() {
    let folders = Folders::new();
    let [a, _] = pair(&folders, |_| ());
    for other in [repository("assets/cornell.glb"), folders.output("gone.glb")] {
        let output = run(["diff", &a, &other]);
        assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
        assert!(text(&output.stderr).starts_with("error: "));
    }
}

#[test]
fn inspect_says_what_each_part_costs() {
    let folders = Folders::new();
    let input = folders.input("room.gltf", Document::room().to_string());
    for (name, flags) in [("a.glb", &[][..]), ("b.gltf", &[]), ("c.glb", &["--compress"])] {
        let baked = folders.output(name);
        let arguments = ["bake", &input, "-o", &baked, "--lights", "200"];
        assert!(run(arguments.into_iter().chain(flags.iter().copied())).status.success());
        let bytes = json_of(&run(["inspect", &baked, "--json"]))["bytes"].clone();
        let part = |name: &str, key: &str| {
            let parts = bytes["parts"].as_array().unwrap();
            parts.iter().find(|part| part["part"] == name).unwrap()[key].as_u64().unwrap()
        };
        let asset = read(&baked);
        let (lights, samples) = (asset.triangles.len() as u64, asset.samples.len() as u64);
        assert_eq!(part("lights", "memory"), 24 * lights + 12 * asset.positions.len() as u64);
        assert_eq!(part("samples", "memory"), 36 * samples + 4 * (lights + 1));
        let smaller = flags.contains(&"--compress");
        assert_eq!(part("grid", "stored") < part("grid", "memory"), smaller, "{name}");
        assert_eq!(part("grid", "memory"), asset.grid.as_ref().unwrap().byte_len() as u64);

        // With what was there before, the parts are the file, but for padding and the base64 of the source.
        let source = std::fs::metadata(&input).unwrap().len();
        let (stored, file) = (bytes["stored"].as_u64().unwrap(), bytes["file"].as_u64().unwrap());
        assert!(stored < file && stored + source > file * 98 / 100, "{name}: {stored} + {source} of {file}");
        let share = bytes["share"].as_f64().unwrap();
        assert!((share - stored as f64 / file as f64).abs() < 1e-12);
        let lines = run(["inspect", &baked]);
        for line in ["size      ", "part      lights", "part      json"] {
            assert!(text(&lines.stdout).contains(line), "{line} in {}", text(&lines.stdout));
        }
    }
}

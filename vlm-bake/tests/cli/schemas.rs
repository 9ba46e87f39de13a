//! The JSON Schemas of reports: the committed ones are the program's, and its reports are valid by them.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::Stdio;

use jsonschema::{Validator, validator_for};
use serde_json::{Value, json};

use crate::support::{Document, Folders, repository, run, text, vlm};

/// The reports, as `vlm schema` lists them.
fn names() -> Vec<String> {
    let list = run(["schema"]);
    text(&list.stdout).lines().map(|line| line.split_whitespace().next().unwrap().to_owned()).collect()
}

fn schema(name: &str) -> Value {
    let output = run(["schema", name]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn validator(name: &str) -> Validator {
    validator_for(&schema(name)).unwrap()
}

/// What is wrong with a report.
fn errors(validator: &Validator, report: &Value) -> Vec<String> {
    validator.iter_errors(report).map(|error| format!("{}: {error}", error.instance_path())).collect()
}

fn json_of(arguments: &[&str]) -> Value {
    let output = run(arguments.iter().copied());
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {}", text(&output.stderr)))
}

/// Real reports of a name, from commands that pass and that fail.
fn reports(name: &str) -> Vec<Value> {
    let folders = Folders::new();
    let (room, baked, report) = (
        folders.input("room.gltf", Document::room().to_string()),
        folders.output("b.glb"),
        folders.output("r.json"),
    );
    let made = run(["bake", &room, "-o", &baked, "--lights", "60", "--probes", "200", "--report", &report]);
    assert!(made.status.success(), "{}", text(&made.stderr));
    match name {
        "bake" => vec![serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap()],
        "batch" => {
            folders.input("broken.gltf", "{}");
            let folder = Path::new(&room).parent().unwrap().join("*.gltf").display().to_string();
            let (out, cache) = (folders.output("batch"), folders.output("cache"));
            let flags = ["--lights", "60", "--probes", "200", "--cache-dir", &cache, "--json"];
            let batch =
                |more: &[&str]| json_of(&[&["bake", &folder, "--out-dir", &out], &flags[..], more].concat());
            vec![batch(&["--dry-run"]), batch(&[]), batch(&[])]
        }
        "watch" => vec![first_event(&room, &folders.output("watched"))],
        "check" => vec![
            json_of(&["check", &baked, &room, "--json"]),
            json_of(&["check", &baked, "--geometry", &room, "--json"]),
        ],
        "inspect" => {
            let bare = folders.output("bare.glb");
            assert!(run(["bake", &room, "-o", &bare, "--lights", "60", "--probes", "0"]).status.success());
            vec![json_of(&["inspect", &baked, "--json"]), json_of(&["inspect", &bare, "--json"])]
        }
        "diff" => {
            let other = folders.output("other.glb");
            assert!(run(["bake", &room, "-o", &other, "--lights", "90", "--probes", "0"]).status.success());
            vec![
                json_of(&["diff", &baked, &other, "--clearance", "--json"]),
                json_of(&["diff", &baked, &baked, "--json"]),
            ]
        }
        "render" => vec![json_of(&["render", &baked, "--size", "8x8", "--json"])],
        other => panic!("no test makes a report `{other}`: add one here"),
    }
}

/// The first line of a watch, which is then ended.
fn first_event(input: &str, out: &str) -> Value {
    let flags = ["--lights", "60", "--probes", "200", "--no-cache", "--json", "--poll"];
    let mut watch = vlm([&["watch", input, "--out-dir", out], flags.as_slice()].concat());
    let mut child = watch.stdout(Stdio::piped()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
    serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"))
}

/// Every object within a value, by its pointer.
fn objects(value: &Value, pointer: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(map) => {
            found.push(pointer.to_owned());
            map.iter().for_each(|(key, item)| objects(item, &format!("{pointer}/{key}"), found));
        }
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(i, item)| objects(item, &format!("{pointer}/{i}"), found));
        }
        _ => {}
    }
}

#[test]
fn committed_schemas_are_those_of_the_program() {
    let path = |name: &str| PathBuf::from(repository("docs/schemas")).join(format!("{name}.schema.json"));
    for name in names() {
        let generated = run(["schema", &name]).stdout;
        if std::env::var_os("VLM_UPDATE_EXPECTED").is_some_and(|value| value == "1") {
            std::fs::write(path(&name), &generated).unwrap();
        }
        let committed = std::fs::read(path(&name)).unwrap_or_default();
        assert!(
            committed == generated,
            "docs/schemas/{name}.schema.json is stale: run with VLM_UPDATE_EXPECTED=1"
        );
    }
    let files = std::fs::read_dir(repository("docs/schemas")).unwrap();
    let schemas =
        files.filter(|file| file.as_ref().unwrap().file_name().to_string_lossy().ends_with(".json"));
    assert_eq!(schemas.count(), names().len(), "docs/schemas has schemas of no report");
}

#[test]
fn real_reports_are_valid() {
    for name in names() {
        let validator = validator(&name);
        for report in reports(&name) {
            assert_eq!(errors(&validator, &report), Vec::<String>::new(), "{name}: {report:#}");
        }
    }
}

#[test]
fn changed_reports_are_not() {
    for name in names() {
        let validator = validator(&name);
        for report in reports(&name) {
            let mut places = Vec::new();
            objects(&report, "", &mut places);
            for place in places {
                // A property that no one described, and one of another type.
                let mut more = report.clone();
                more.pointer_mut(&place).unwrap()["unheard_of"] = json!(1);
                let map = report.pointer(&place).unwrap().as_object().unwrap();
                // Stages by name; what is in a picture's seconds is known.
                let open = place.ends_with("/seconds") && name != "render" || place.ends_with("/stages");
                assert!(open || !validator.is_valid(&more), "{name}: {place} takes any property");
                for key in map.keys() {
                    let mut other = report.clone();
                    other.pointer_mut(&place).unwrap()[key] = json!([["of another type"]]);
                    assert!(!validator.is_valid(&other), "{name}: {place}/{key} takes any type");
                }
            }
        }
    }
}

#[test]
fn a_report_without_a_property_is_not_valid() {
    for (name, key) in [
        ("bake", "clearance"),
        ("check", "issues"),
        ("inspect", "vlms"),
        ("diff", "objects"),
        ("render", "seconds"),
    ] {
        let mut report = reports(name).remove(0);
        let object = if report.is_array() { &mut report[0] } else { &mut report };
        let value = object.as_object_mut().unwrap().remove(key).unwrap();
        object[&format!("{key}_renamed")] = value;
        assert!(!validator(name).is_valid(&report), "{name} without {key}");
    }
}

#[test]
fn an_unknown_report_is_an_error_that_lists_them() {
    let output = run(["schema", "nothing"]);
    assert_eq!(output.status.code(), Some(2));
    for part in ["`nothing`", "bake", "inspect"] {
        assert!(text(&output.stderr).contains(part), "{}", text(&output.stderr));
    }
}

//! `vlm check`: files and folders, codes, pointers, warnings, SARIF.

use std::fs;
use std::path::Path;
use std::process::Output;

use serde_json::{Value, json};
use vlm_format::{Code, GltfFile};

use crate::support::{Document, Folders, repository, run, text, vlm};

fn json_of(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

fn schema() -> jsonschema::Validator {
    let text = fs::read_to_string(repository("tests/expected/sarif-2.1.0.schema.json")).unwrap();
    // The published schema has a bracket too many in the pattern of languages.
    let text = text.replace("[a-zA-Z]{2}]?$", "[a-zA-Z]{2}$");
    jsonschema::validator_for(&serde_json::from_str(&text).unwrap()).unwrap()
}

/// A room with a root that is a child, which is a warning.
fn room_with_warning() -> Document {
    let mut document = Document::room();
    document.json["nodes"].as_array_mut().unwrap().push(json!({ "name": "parent", "children": [0] }));
    document.json["scenes"][0]["nodes"] = json!([0, 1]);
    document
}

fn bake(input: &str, output: &str) {
    let result = run(["bake", input, "-o", output, "--lights", "60", "--probes", "0"]);
    assert!(result.status.success(), "{}", text(&result.stderr));
}

#[test]
fn a_folder_stands_for_the_files_below_it() {
    let folders = Folders::new();
    let baked = folders.output("b.glb");
    bake(&folders.input("room.gltf", Document::room().to_string()), &baked);
    let folder = Path::new(&baked).parent().unwrap();
    fs::create_dir_all(folder.join("a/deep")).unwrap();
    fs::copy(&baked, folder.join("a/deep/c.GLB")).unwrap();
    fs::copy(&baked, folder.join("a.glb")).unwrap();
    fs::write(folder.join("notes.txt"), "no glTF").unwrap();
    let output = run(["check", folder.to_str().unwrap(), "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let found = json_of(&output);
    let files: Vec<&Path> =
        found.as_array().unwrap().iter().map(|f| Path::new(f["file"].as_str().unwrap())).collect();
    assert_eq!(files, [folder.join("a/deep/c.GLB"), folder.join("a.glb"), folder.join("b.glb")]);

    fs::write(folder.join("a/broken.glb"), "no glTF").unwrap();
    assert_eq!(run(["check", folder.to_str().unwrap()]).status.code(), Some(1), "the negative control");
}

#[test]
fn a_folder_without_files_cannot_pass() {
    let folders = Folders::new();
    let empty = folders.output("empty");
    fs::create_dir(&empty).unwrap();
    let output = run(["check", &empty]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("no .glb or .gltf"), "{}", text(&output.stderr));
}

#[test]
fn an_unreadable_file_is_one_finding_among_others() {
    let folders = Folders::new();
    let (baked, gone) = (folders.output("b.glb"), folders.output("gone.glb"));
    bake(&folders.input("room.gltf", Document::room().to_string()), &baked);
    let output = run(["check", &gone, &baked, "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let found = json_of(&output);
    assert_eq!(found[0]["issues"][0]["code"], json!("IO"));
    assert_eq!((&found[0]["ok"], &found[1]["ok"]), (&json!(false), &json!(true)));
    let output = run(["check", &gone]);
    assert_eq!(output.status.code(), Some(2), "nothing could be checked");
    assert!(text(&output.stderr).contains("check the path"), "{}", text(&output.stderr));
}

#[test]
fn what_is_stale_has_a_pointer_into_the_file() {
    let folders = Folders::new();
    let baked = folders.output("room.gltf");
    bake(&folders.input("in.gltf", Document::room().to_string()), &baked);
    let mut json: Value = serde_json::from_slice(&fs::read(&baked).unwrap()).unwrap();
    json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][0] = json!(0.1);
    fs::write(&baked, json.to_string()).unwrap();
    let output = run(["check", &baked, "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let issue = &json_of(&output)[0]["issues"][0];
    assert_eq!((&issue["code"], &issue["vlm"]), (&json!("STALE"), &json!("room")));
    let pointer = issue["pointer"].as_str().unwrap();
    assert_eq!(pointer, "/extensions/VLM_virtual_light_mesh/vlms/0/digests/geometry");
    assert!(json.pointer(pointer).is_some(), "the pointer leads somewhere");
}

#[test]
fn broken_arrays_have_pointers_into_the_file() {
    let folders = Folders::new();
    let baked = folders.output("room.gltf");
    bake(&folders.input("in.gltf", Document::room().to_string()), &baked);
    let mut json: Value = serde_json::from_slice(&fs::read(&baked).unwrap()).unwrap();
    let extension = &mut json["extensions"]["VLM_virtual_light_mesh"];
    extension["vlms"][0]["lights"][0] = json!(1);
    fs::write(&baked, json.to_string()).unwrap();
    let issues = json_of(&run(["check", &baked, "--json"]))[0]["issues"].clone();
    let pointers: Vec<&str> =
        issues.as_array().unwrap().iter().map(|issue| issue["pointer"].as_str().unwrap()).collect();
    assert!(pointers.contains(&"/extensions/VLM_virtual_light_mesh/vlms/0/lights"), "{pointers:?}");
    assert!(pointers.iter().all(|pointer| json.pointer(pointer).is_some()), "{pointers:?}");
}

#[test]
fn warnings_show_and_do_not_fail() {
    let folders = Folders::new();
    let baked = folders.output("b.glb");
    bake(&folders.input("in.gltf", room_with_warning().to_string()), &baked);
    let output = run(["check", &baked, "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let finding = &json_of(&output)[0];
    let issue = &finding["issues"][0];
    assert_eq!((&finding["ok"], &issue["severity"]), (&json!(true), &json!("warning")));
    assert_eq!(issue["pointer"], json!("/scenes/0/nodes/0"));
    let lines = run(["check", &baked]);
    assert!(text(&lines.stdout).contains("1 warning"), "{}", text(&lines.stdout));
    assert!(text(&lines.stdout).contains("[NODE_CYCLE]"), "{}", text(&lines.stdout));

    let warnings = GltfFile::open(Path::new(&baked)).unwrap().warnings().to_vec();
    assert!(warnings.iter().all(|warning| warning.code.severities().contains(&warning.severity)));
}

#[test]
fn sarif_is_what_code_scanning_takes() {
    let folders = Folders::new();
    let folder = Path::new(&folders.output("x")).parent().unwrap().to_owned();
    bake(&folders.input("in.gltf", room_with_warning().to_string()), &folders.output("good.glb"));
    fs::write(folder.join("bäd #1.gltf"), r#"{"asset":{"version":"2.0"},"scene":3}"#).unwrap();
    let output = vlm(["check", ".", "gone.glb", "--sarif"]).current_dir(&folder).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let log = json_of(&output);
    let errors: Vec<String> = schema().iter_errors(&log).map(|error| error.to_string()).collect();
    assert_eq!(errors, Vec::<String>::new());

    let driver = &log["runs"][0]["tool"]["driver"];
    assert_eq!((&driver["name"], &driver["version"]), (&json!("vlm"), &json!(env!("CARGO_PKG_VERSION"))));
    let rules = driver["rules"].as_array().unwrap();
    assert_eq!(rules.len(), Code::ALL.len());
    assert!(rules.iter().all(|rule| !rule["help"]["text"].as_str().unwrap().is_empty()));
    let results = log["runs"][0]["results"].as_array().unwrap();
    let found: Vec<(&str, &str, &str)> = results
        .iter()
        .map(|result| {
            let place = &result["locations"][0]["physicalLocation"];
            assert_eq!(place["region"]["startLine"], json!(1));
            let rule = &rules[result["ruleIndex"].as_u64().unwrap() as usize];
            assert_eq!(rule["id"], result["ruleId"]);
            let uri = place["artifactLocation"]["uri"].as_str().unwrap();
            (result["ruleId"].as_str().unwrap(), result["level"].as_str().unwrap(), uri)
        })
        .collect();
    let expected = [
        ("INDEX_OUT_OF_RANGE", "error", "b%C3%A4d%20%231.gltf"),
        ("NODE_CYCLE", "warning", "good.glb"),
        ("IO", "error", "gone.glb"),
    ];
    assert_eq!(found, expected);
    let logical = &results[0]["locations"][0]["logicalLocations"][0];
    assert_eq!(logical["fullyQualifiedName"], json!("/scene"));
}

#[test]
fn the_schema_sees_what_is_missing() {
    let output = run(["check", &repository("assets/cornell.glb"), "--sarif"]);
    let log = json_of(&output);
    assert!(schema().is_valid(&log));
    type Spoil = fn(&mut Value);
    let spoil: [Spoil; 4] = [
        |log| log["version"] = json!("2.0"),
        |log| drop(log["runs"][0]["tool"]["driver"].as_object_mut().unwrap().remove("name")),
        |log| log["runs"][0]["results"][0]["level"] = json!("fatal"),
        |log| drop(log["runs"][0]["results"][0].as_object_mut().unwrap().remove("message")),
    ];
    for spoil in spoil {
        let mut log = log.clone();
        spoil(&mut log);
        assert!(!schema().is_valid(&log), "{log}");
    }
}

/// docs/codes.md.
fn codes_page() -> String {
    let mut page = String::from(
        "# Codes\n\n\
         Every problem that `vlm` reports, as `vlm check --json` and `--sarif` name it. Names never change; the list only grows.\n\n\
         | code | severity | what is wrong | what to do |\n|---|---|---|---|\n",
    );
    for code in Code::ALL {
        let severities: Vec<&str> = code.severities().iter().map(|severity| severity.as_str()).collect();
        let row =
            format!("| `{code}` | {} | {} | {} |\n", severities.join(" or "), code.meaning(), code.remedy());
        page.push_str(&row);
    }
    page
}

#[test]
fn the_page_of_codes_is_up_to_date() {
    let path = repository("docs/codes.md");
    if std::env::var_os("VLM_UPDATE_EXPECTED").is_some_and(|value| value == "1") {
        fs::write(&path, codes_page()).unwrap();
    }
    let found = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found == codes_page(),
        "{path} is not what the code says; run this test with VLM_UPDATE_EXPECTED=1"
    );
}

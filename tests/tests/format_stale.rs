//! What other tools do to a file after the bake, and what the reader says about it.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use serde_json::{Value, json};
use vlm_format::{Container, EXTENSION, Error, GltfFile, Target, read_vlm, read_vlm_unchecked, write_vlm};
use vlm_tests::sample_asset::{quads, room};

fn baked() -> Value {
    let file = room();
    let target =
        Target { container: Container::Gltf { embedded: true }, file_name: String::from("room.gltf") };
    let outputs = write_vlm(&file, &quads(&file), &target).unwrap();
    serde_json::from_slice(&outputs[0].bytes).unwrap()
}

fn open(json: &Value) -> GltfFile {
    GltfFile::from_slice(json.to_string().as_bytes(), "room.gltf", None).unwrap()
}

fn extension(json: &mut Value) -> &mut Value {
    &mut json["extensions"][EXTENSION]
}

/// A changed file is refused, and the message has all the given parts.
fn assert_stale(change: impl FnOnce(&mut Value), parts: &[&str]) {
    let mut json = baked();
    change(&mut json);
    let error = read_vlm(&open(&json)).unwrap_err();
    assert!(matches!(error, Error::Stale { .. }), "{error}");
    let message = error.to_string();
    for part in ["room.gltf", "bake again"].iter().chain(parts) {
        assert!(message.contains(part), "`{part}` is missing in: {message}");
    }
}

#[test]
fn an_untouched_file_is_read() {
    let file = open(&baked());
    assert_eq!(read_vlm(&file).unwrap(), Some(quads(&room())));
    assert_eq!(read_vlm(&room()).unwrap(), None);
}

#[test]
fn consistent_renumbering_is_no_change() {
    let mut json = baked();
    json["accessors"].as_array_mut().unwrap().swap(0, 1);
    json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(1);
    json["meshes"][1]["primitives"][0]["attributes"]["POSITION"] = json!(0);
    assert!(read_vlm(&open(&json)).unwrap().is_some());
}

#[test]
fn renumbered_accessors_are_named() {
    let swap = |json: &mut Value| json["accessors"].as_array_mut().unwrap().swap(2, 4);
    assert_stale(
        swap,
        &["accessor 2 `lights/positions` was renumbered or altered", "accessor 4 `lights/albedo`"],
    );
    let remove = |json: &mut Value| {
        let accessors = json["accessors"].as_array_mut().unwrap();
        accessors.truncate(accessors.len() - 2);
    };
    assert_stale(
        remove,
        &[
            "/extensions/VLM_virtual_light_mesh/grid/rows",
            "/meshes/1/primitives/0/extensions/VLM_virtual_light_mesh/triangleTags",
            "is no index into /accessors",
        ],
    );
}

#[test]
fn a_changed_vertex_names_the_object() {
    let change = |json: &mut Value| {
        let uri = json["buffers"][0]["uri"].as_str().unwrap().replacen("AACAPw", "AACAQA", 1);
        json["buffers"][0]["uri"] = json!(uri);
    };
    assert_stale(change, &["`vlm-1`: geometry or colours of `Room/Table` changed", "`vlm-2`", "`Room/Lamp`"]);
}

#[test]
fn a_changed_colour_names_the_object() {
    let change =
        |json: &mut Value| json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][0] = json!(0.6);
    assert_stale(change, &["geometry or colours of `Room/Table` changed"]);
}

#[test]
fn moved_objects_make_the_grid_stale() {
    assert_stale(|json| json["nodes"][1]["translation"][0] = json!(2), &["`grid`: `Room/Table` was moved"]);
    assert_stale(|json| json["nodes"][0]["scale"] = json!([1, 1, 2]), &["`grid`: `Room/Table` was moved"]);
    assert_stale(|json| json["nodes"][3]["mesh"] = json!(0), &["`grid`: a visible object was added"]);
}

#[test]
fn moving_without_a_grid_is_no_change() {
    let mut json = baked();
    extension(&mut json).as_object_mut().unwrap().remove("grid");
    json["nodes"][1]["translation"][0] = json!(2);
    assert!(read_vlm(&open(&json)).unwrap().is_some());
}

#[test]
fn lost_and_doubled_references_are_named() {
    let lose = |json: &mut Value| drop(json["nodes"][1].as_object_mut().unwrap().remove("extensions"));
    assert_stale(lose, &["`vlm-1`: no node refers to it any more"]);
    let double = |json: &mut Value| json["nodes"][3]["extensions"] = json["nodes"][1]["extensions"].clone();
    assert_stale(double, &["`vlm-1`: both `Room/Table` and `Spare` refer to it"]);
    let unknown = |json: &mut Value| json["nodes"][3]["extensions"] = json!({ EXTENSION: { "vlms": ["x"] } });
    assert_stale(unknown, &["`x`: `Spare` refers to it, but it does not exist"]);
    let root = |json: &mut Value| drop(json["extensions"].as_object_mut().unwrap().remove(EXTENSION));
    assert_stale(root, &["`Room/Table` refers to a VLM, but another tool removed the root object"]);
    let all_but_a_tag = |json: &mut Value| {
        root(json);
        json["nodes"][1].as_object_mut().unwrap().remove("extensions");
        json["nodes"][2].as_object_mut().unwrap().remove("extensions");
    };
    assert_stale(all_but_a_tag, &["`Spare` has a tag of a VLM, but another tool removed the root object"]);
}

#[test]
fn unchecked_reading_ignores_digests_only() {
    let mut json = baked();
    json["nodes"][1]["translation"][0] = json!(2);
    assert!(read_vlm_unchecked(&open(&json)).unwrap().is_some());
    extension(&mut json).as_object_mut().unwrap().remove("vlms");
    assert!(matches!(read_vlm_unchecked(&open(&json)), Err(Error::Stale { .. })));
}

//! What is written conforms to the JSON Schemas of the extension.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::fs;
use std::path::Path;

use jsonschema::Validator;
use serde_json::{Value, json};
use vlm_format::{
    Container, EXTENSION, GltfFile, OutputFile, Target, VlmAsset, WriteOptions, write_vlm, write_vlm_with,
};
use vlm_tests::sample_asset::{many_quads, quads, room};

fn schema(object: &str) -> Validator {
    let name = format!("../vlm-format/schema/{object}.{EXTENSION}.schema.json");
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap();
    let schema: Value = serde_json::from_str(&text).unwrap();
    jsonschema::draft202012::meta::validate(&schema).unwrap();
    jsonschema::draft202012::new(&schema).unwrap()
}

fn target() -> Target {
    Target { container: Container::Gltf { embedded: true }, file_name: String::from("room.gltf") }
}

fn json_of(outputs: &[OutputFile]) -> Value {
    serde_json::from_slice(&outputs[0].bytes).unwrap()
}

fn written(file: &GltfFile, asset: &VlmAsset) -> Value {
    json_of(&write_vlm(file, asset, &target()).unwrap())
}

/// With all arrays compressed that are long enough.
fn compressed() -> Value {
    let file = room();
    let options = WriteOptions { compress: true };
    json_of(&write_vlm_with(&file, &many_quads(&file, 50), &target(), &options).unwrap())
}

#[test]
fn written_extensions_conform() {
    let file = room();
    let nothing = VlmAsset { sample_starts: vec![0], ..VlmAsset::default() };
    for asset in [quads(&file), nothing] {
        let json = written(&file, &asset);
        let root = &json["extensions"][EXTENSION];
        schema("glTF").validate(root).unwrap_or_else(|error| panic!("{error}: {root:#}"));
        for vlm in &asset.vlms {
            schema("node").validate(&json["nodes"][vlm.node as usize]["extensions"][EXTENSION]).unwrap();
        }
        for &(mesh, primitive, _) in &asset.primitive_tags {
            let primitive = &json["meshes"][mesh as usize]["primitives"][primitive as usize];
            schema("mesh.primitive").validate(&primitive["extensions"][EXTENSION]).unwrap();
        }
        for tags in &asset.triangle_tags {
            let primitive = &json["meshes"][tags.mesh as usize]["primitives"][tags.primitive as usize];
            schema("mesh.primitive").validate(&primitive["extensions"][EXTENSION]).unwrap();
        }
        for &(node, _) in &asset.node_tags {
            schema("node").validate(&json["nodes"][node as usize]["extensions"][EXTENSION]).unwrap();
        }
    }
}

#[test]
fn every_property_is_described() {
    let file = room();
    let json = written(&file, &quads(&file));
    let mut root = json["extensions"][EXTENSION].clone();
    let mut compressed = compressed()["extensions"][EXTENSION].clone();
    let text = fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../vlm-format/schema/glTF.VLM_virtual_light_mesh.schema.json"),
    )
    .unwrap();
    let mut strict: Value = serde_json::from_str(&text).unwrap();
    forbid_others(&mut strict);
    let strict = jsonschema::draft202012::new(&strict).unwrap();
    strict.validate(&root).unwrap_or_else(|error| panic!("{error}"));
    root["lights"]["undescribed"] = json!(1);
    assert!(!strict.is_valid(&root));
    strict.validate(&compressed).unwrap_or_else(|error| panic!("{error}"));
    compressed["lights"]["positions"]["compression"]["undescribed"] = json!(1);
    assert!(!strict.is_valid(&compressed));
}

/// Makes every object of a schema refuse properties that it does not describe.
fn forbid_others(schema: &mut Value) {
    match schema {
        Value::Object(map) => {
            map.values_mut().for_each(forbid_others);
            if map.get("properties").is_some_and(Value::is_object) {
                map.insert(String::from("additionalProperties"), json!(false));
            }
        }
        Value::Array(list) => list.iter_mut().for_each(forbid_others),
        _ => {}
    }
}

#[test]
fn broken_extensions_do_not_conform() {
    let file = room();
    let json = written(&file, &quads(&file));
    let root = &json["extensions"][EXTENSION];
    let schema = schema("glTF");
    for (pointer, value) in [
        ("/vlms/0/id", json!("")),
        ("/vlms/0/lights", json!([0])),
        ("/vlms/0/digests/geometry", json!("xyz")),
        ("/lights/positions/accessor", json!(-1)),
        ("/lights/albedo", json!(3)),
        ("/samples/starts", json!(null)),
        ("/grid/cellSize", json!(0)),
        ("/grid/dimensions", json!([1, 2])),
        ("/grid/surfaceProbes", json!(-1)),
        ("/grid/sceneDigest", json!("xyz")),
        ("/data/bufferView", json!("0")),
    ] {
        let mut broken = root.clone();
        *broken.pointer_mut(pointer).unwrap() = value;
        assert!(!schema.is_valid(&broken), "a wrong {pointer} conforms");
    }
}

#[test]
fn compression_conforms_and_what_is_broken_in_it_does_not() {
    let root = &compressed()["extensions"][EXTENSION];
    let (schema, primitive) = (schema("glTF"), schema("mesh.primitive"));
    schema.validate(root).unwrap_or_else(|error| panic!("{error}"));
    let tags = |array: &Value| primitive.is_valid(&json!({ "triangleTags": array }));
    assert!(tags(&root["lights"]["tags"]));
    for (key, value) in [
        ("mode", json!("TRIANGLES")),
        ("count", json!(0)),
        ("byteStride", json!(6)),
        ("byteStride", json!(260)),
        ("byteLength", json!("all")),
    ] {
        let mut broken = root.clone();
        broken["lights"]["tags"]["compression"][key] = value.clone();
        assert!(!schema.is_valid(&broken), "{key} {value} conforms");
        assert!(!tags(&broken["lights"]["tags"]), "{key} {value} conforms in a primitive");
    }
    for required in ["mode", "count", "byteStride", "byteLength"] {
        let mut broken = root.clone();
        broken["lights"]["tags"]["compression"].as_object_mut().unwrap().remove(required);
        assert!(!schema.is_valid(&broken), "compression without {required} conforms");
        assert!(!tags(&broken["lights"]["tags"]), "in a primitive, too");
    }
}

#[test]
fn every_array_of_the_grid_is_described() {
    let file = room();
    let asset = quads(&file);
    let json = written(&file, &asset);
    let root = &json["extensions"][EXTENSION];
    let schema = schema("glTF");
    for (array, bytes) in asset.grid.as_ref().unwrap().sizes() {
        let accessor = root["grid"][array]["accessor"].as_u64().unwrap() as usize;
        let accessor = &json["accessors"][accessor];
        let width = if accessor["type"] == "VEC4" { 16 } else { 4 };
        assert_eq!(accessor["count"].as_u64().unwrap() as usize * width, bytes, "{array}");
        let mut broken = root.clone();
        broken["grid"][array] = json!(3);
        assert!(!schema.is_valid(&broken), "a wrong {array} conforms");
    }
    for required in ["cells", "leaves", "nearStarts", "rowStarts", "surfaceProbes", "sceneDigest"] {
        let mut broken = root.clone();
        broken["grid"].as_object_mut().unwrap().remove(required);
        assert!(!schema.is_valid(&broken), "a grid without {required} conforms");
    }
}

#[test]
fn broken_tags_do_not_conform() {
    let array = json!({ "accessor": 3, "digest": "0123456789abcdef0123456789abcdef" });
    let (node, primitive) = (schema("node"), schema("mesh.primitive"));
    for (schema, valid) in [
        (&node, json!({ "vlms": ["a"] })),
        (&node, json!({ "tag": 1 })),
        (&node, json!({ "vlms": ["a"], "tag": 4_294_967_295_u32 })),
        (&primitive, json!({ "tag": 1 })),
        (&primitive, json!({ "triangleTags": array })),
    ] {
        schema.validate(&valid).unwrap_or_else(|error| panic!("{error}: {valid}"));
    }
    for (schema, broken) in [
        (&node, json!({})),
        (&node, json!({ "vlms": [] })),
        (&node, json!({ "tag": 0 })),
        (&node, json!({ "tag": 4_294_967_296_u64 })),
        (&primitive, json!({})),
        (&primitive, json!({ "tag": 0 })),
        (&primitive, json!({ "triangleTags": [1, 0] })),
        (&primitive, json!({ "triangleTags": { "accessor": 3 } })),
        (&primitive, json!({ "tag": 1, "triangleTags": array })),
    ] {
        assert!(!schema.is_valid(&broken), "{broken} conforms");
    }
}

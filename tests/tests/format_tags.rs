//! Tags of the visible surface: by node, by primitive, by triangle.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use base64::Engine;
use glam::Vec3;
use serde_json::{Value, json};
use vlm_format::{
    Code, Container, EXTENSION, Error, GltfFile, Target, TriangleTags, VlmAsset, read_vlm, strip_vlm,
    write_vlm,
};

/// Two nodes that share a mesh of one strip and one list, and a third without a mesh:
/// ```text
/// 1---3---5---7   strip: six triangles
/// | \ | \ | \ |   list: the first of them alone
/// 0---2---4---6
/// ```
fn banners() -> GltfFile {
    let corners = (0..8_u8).map(|v| Vec3::new(f32::from(v / 2), f32::from(v % 2), 0.0));
    let bytes: Vec<u8> = corners.flat_map(|corner| corner.to_array()).flat_map(f32::to_le_bytes).collect();
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let positions = |count: u32| json!({ "bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3", "min": [0, 0, 0], "max": [3, 1, 0] });
    let json = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0, 1, 2] }],
        "nodes": [{ "mesh": 0 }, { "mesh": 0, "translation": [0, 0, 1] }, { "name": "Empty" }],
        "meshes": [{ "primitives": [
            { "attributes": { "POSITION": 0 }, "mode": 5 },
            { "attributes": { "POSITION": 1 } },
        ] }],
        "accessors": [positions(8), positions(3)],
        "bufferViews": [{ "buffer": 0, "byteLength": bytes.len() }],
        "buffers": [{ "byteLength": bytes.len(), "uri": format!("data:application/octet-stream;base64,{data}") }],
    });
    GltfFile::from_slice(json.to_string().as_bytes(), "banners.gltf", None).unwrap()
}

/// No light, but every kind of tag.
fn tagged() -> VlmAsset {
    VlmAsset {
        sample_starts: vec![0],
        primitive_tags: vec![(0, 1, 4)],
        triangle_tags: vec![TriangleTags { mesh: 0, primitive: 0, tags: vec![0, 1, 0, 2, u32::MAX, 0] }],
        node_tags: vec![(1, 8), (2, u32::MAX)],
        ..VlmAsset::default()
    }
}

fn target(container: Container) -> Target {
    let file_name = if container == Container::Glb { "banners.glb" } else { "banners.gltf" };
    Target { container, file_name: file_name.to_owned() }
}

const EMBEDDED: Container = Container::Gltf { embedded: true };

fn written() -> Value {
    serde_json::from_slice(&write_vlm(&banners(), &tagged(), &target(EMBEDDED)).unwrap()[0].bytes).unwrap()
}

fn open(json: &Value) -> GltfFile {
    GltfFile::from_slice(json.to_string().as_bytes(), "banners.gltf", None).unwrap()
}

/// The extension's object of the strip.
fn strip(json: &mut Value) -> &mut Value {
    &mut json["meshes"][0]["primitives"][0]["extensions"][EXTENSION]
}

#[test]
fn tags_are_read_as_written_and_stripped_without_a_trace() {
    for container in [Container::Glb, EMBEDDED] {
        let plain = strip_vlm(&banners(), &target(container)).unwrap();
        let outputs = write_vlm(&banners(), &tagged(), &target(container)).unwrap();
        let file = GltfFile::from_slice(&outputs[0].bytes, "banners", None).unwrap();
        assert_eq!(read_vlm(&file).unwrap(), Some(tagged()));
        assert_ne!(outputs[0].bytes, plain[0].bytes);
        assert_eq!(strip_vlm(&file, &target(container)).unwrap()[0].bytes, plain[0].bytes, "{container:?}");
    }
}

#[test]
fn the_file_holds_them_as_specified() {
    let mut json = written();
    assert_eq!(json["nodes"][1]["extensions"][EXTENSION], json!({ "tag": 8 }));
    assert_eq!(json["meshes"][0]["primitives"][1]["extensions"][EXTENSION], json!({ "tag": 4 }));
    let accessor = strip(&mut json)["triangleTags"]["accessor"].as_u64().unwrap() as usize;
    let file = open(&json);
    assert_eq!(file.read_u32(accessor).unwrap(), tagged().triangle_tags[0].tags);
    assert_eq!(json["accessors"][accessor]["componentType"], json!(5125));
    assert_eq!(
        json["accessors"][accessor]["bufferView"],
        json["extensions"][EXTENSION]["data"]["bufferView"]
    );
    assert_eq!(file.triangle_count(0, 0), Some(6));
}

#[test]
fn altered_tags_are_stale() {
    type Change = fn(&mut Value);
    let cases: &[(Change, &str)] = &[
        (
            |json| strip(json)["triangleTags"]["digest"] = json!("0123456789abcdef0123456789abcdef"),
            "accessor 3 `meshes/0/primitives/0/triangleTags` was renumbered or altered by another tool",
        ),
        (
            |json| strip(json)["triangleTags"]["accessor"] = json!(2),
            "accessor 2 `meshes/0/primitives/0/triangleTags` was renumbered or altered by another tool",
        ),
        (|json| strip(json)["triangleTags"]["accessor"] = json!(9), "is no index into /accessors"),
        (|json| strip(json)["tag"] = json!(1), "`tag` or `triangleTags` may stand alone only"),
        (|json| *strip(json) = json!({}), "`tag` or `triangleTags` is missing"),
        (|json| *strip(json) = json!({ "tag": 0 }), "0 is not a tag"),
        (|json| *strip(json) = json!({ "tag": 1_u64 << 32 }), "4294967296 is not a tag"),
        (|json| json["nodes"][1]["extensions"][EXTENSION] = json!({}), "`vlms` or `tag` is missing"),
        (|json| json["nodes"][1]["extensions"][EXTENSION]["tag"] = json!("8"), "\"8\" is not a tag"),
    ];
    for (change, expected) in cases {
        let mut json = written();
        change(&mut json);
        let error = read_vlm(&open(&json)).unwrap_err();
        let message = error.to_string();
        assert!(matches!(error, Error::Stale { .. }), "{message}");
        for part in ["`asset`", expected, "bake again"] {
            assert!(message.contains(part), "`{part}` is missing in: {message}");
        }
    }
    assert_eq!(read_vlm(&open(&written())).unwrap(), Some(tagged()));
}

#[test]
fn one_array_is_not_read_for_many_primitives() {
    let mut json = written();
    let extension = strip(&mut json).clone();
    let copy = json["meshes"][0]["primitives"][0].clone();
    assert_eq!(copy["extensions"][EXTENSION], extension);
    json["meshes"][0]["primitives"].as_array_mut().unwrap().extend(vec![copy; 20]);
    let message = read_vlm(&open(&json)).unwrap_err().to_string();
    assert!(message.contains("triangleTags` claims more than there is"), "{message}");
}

#[test]
fn tags_must_fit_the_file() {
    type Break = fn(&mut VlmAsset);
    let cases: &[(Code, &str, Break)] = &[
        (Code::VlmLength, "/triangle_tags/0", |a| a.triangle_tags[0].tags.push(1)),
        (Code::VlmLength, "/triangle_tags/0", |a| a.triangle_tags[0].tags.truncate(5)),
        (Code::VlmNode, "/triangle_tags/0", |a| a.triangle_tags[0].mesh = 1),
        (Code::VlmNode, "/primitive_tags/0", |a| a.primitive_tags[0].1 = 2),
        (Code::VlmNode, "/node_tags/1", |a| a.node_tags[1].0 = 3),
    ];
    for (code, pointer, spoil) in cases {
        let mut asset = tagged();
        spoil(&mut asset);
        let Err(Error::Asset { issues }) = write_vlm(&banners(), &asset, &target(EMBEDDED)) else {
            panic!("{} at {pointer} was not seen", code.as_str());
        };
        assert!(issues.iter().any(|i| i.code == *code && i.pointer == *pointer), "{pointer}: {issues:?}");
    }
}

#[test]
fn a_primitive_that_lost_a_triangle_is_refused() {
    let mut json = written();
    json["accessors"][0]["count"] = json!(7);
    let error = read_vlm(&open(&json)).unwrap_err().to_string();
    assert!(error.contains("6 tags for 5 triangles [VLM_LENGTH]"), "{error}");
}

//! Accessors decode to the values that the specification gives for their bytes.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]
#![allow(clippy::needless_pass_by_value, reason = "literals read better without borrows")]

use glam::{Mat4, Vec2, Vec3, Vec4};
use serde_json::{Value, json};
use vlm_format::{Code, Error, GltfFile};

/// A file of one buffer, given as bytes, with one buffer view over all of it and one accessor.
fn file(bytes: &[u8], view: Value, accessor: Value) -> Result<GltfFile, Error> {
    use base64::Engine;
    let data = base64::engine::general_purpose::STANDARD.encode(bytes);
    let mut whole = json!({ "buffer": 0, "byteLength": bytes.len() });
    for (key, value) in view.as_object().unwrap() {
        whole[key] = value.clone();
    }
    let json = json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": bytes.len(), "uri": format!("data:;base64,{data}") }],
        "bufferViews": [whole],
        "accessors": [accessor],
    });
    GltfFile::from_slice(json.to_string().as_bytes(), "test", None)
}

fn open(bytes: &[u8], view: Value, accessor: Value) -> GltfFile {
    file(bytes, view, accessor).unwrap()
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn code(result: Result<impl Sized, Error>) -> Code {
    match result {
        Err(Error::Invalid { issues, .. }) => issues[0].code,
        _ => panic!("not refused"),
    }
}

#[test]
fn stride_and_offset_are_honoured() {
    let bytes = floats(&[9.0, 1.0, 2.0, 9.0, 3.0, 4.0, 9.0, 5.0, 6.0]);
    let accessor =
        json!({ "bufferView": 0, "byteOffset": 4, "componentType": 5126, "count": 3, "type": "VEC2" });
    let file = open(&bytes, json!({ "byteStride": 12 }), accessor);
    assert_eq!(file.read_vec2(0).unwrap(), [Vec2::new(1.0, 2.0), Vec2::new(3.0, 4.0), Vec2::new(5.0, 6.0)]);
}

#[test]
fn normalised_integers_span_their_range() {
    let read = |bytes: &[u8], component: u32, normalized: bool| {
        let count = bytes.len() / if component > 5121 { 2 } else { 1 };
        let accessor = json!({
            "bufferView": 0, "componentType": component, "normalized": normalized, "count": count, "type": "SCALAR",
        });
        open(bytes, json!({}), accessor).read_floats(0).unwrap()
    };
    assert_eq!(read(&[0, 255, 51], 5121, true), [0.0, 1.0, 0.2]);
    assert_eq!(read(&[127, 0x81, 0x80], 5120, true), [1.0, -1.0, -1.0]);
    assert_eq!(read(&[0xFF, 0xFF, 0, 0], 5123, true), [1.0, 0.0]);
    assert_eq!(read(&[0xFF, 0x7F, 0, 0x80], 5122, true), [1.0, -1.0]);
    assert_eq!(read(&[200, 1], 5121, false), [200.0, 1.0]);
    assert_eq!(read(&[0xFE, 0xFF], 5122, false), [-2.0]);
}

#[test]
fn sparse_values_replace_zeros_or_data() {
    let bytes = [floats(&[1.0, 2.0, 3.0]), floats(&[7.0]), vec![1, 0, 0, 0]].concat();
    let sparse = json!({
        "count": 1,
        "indices": { "bufferView": 0, "byteOffset": 16, "componentType": 5121 },
        "values": { "bufferView": 0, "byteOffset": 12 },
    });
    let over_data =
        json!({ "bufferView": 0, "componentType": 5126, "count": 3, "type": "SCALAR", "sparse": sparse });
    assert_eq!(open(&bytes, json!({}), over_data).read_floats(0).unwrap(), [1.0, 7.0, 3.0]);
    let over_zeros = json!({ "componentType": 5126, "count": 3, "type": "SCALAR", "sparse": sparse });
    assert_eq!(open(&bytes, json!({}), over_zeros).read_floats(0).unwrap(), [0.0, 7.0, 0.0]);
    let outside = json!({ "componentType": 5126, "count": 1, "type": "SCALAR", "sparse": sparse });
    assert_eq!(code(open(&bytes, json!({}), outside).read_floats(0)), Code::SparseIndex);
}

#[test]
fn matrices_lose_the_padding_between_columns() {
    let bytes = [1, 2, 0, 0, 3, 4, 0, 0];
    let accessor = json!({ "bufferView": 0, "componentType": 5121, "count": 1, "type": "MAT2" });
    assert_eq!(open(&bytes, json!({}), accessor).read_floats(0).unwrap(), [1.0, 2.0, 3.0, 4.0]);
    let columns: Vec<f32> = (0..16_u8).map(f32::from).collect();
    let accessor = json!({ "bufferView": 0, "componentType": 5126, "count": 1, "type": "MAT4" });
    let file = open(&floats(&columns), json!({}), accessor);
    assert_eq!(file.read_mat4(0).unwrap(), [Mat4::from_cols_slice(&columns)]);
}

#[test]
fn colours_without_alpha_are_opaque() {
    let accessor =
        json!({ "bufferView": 0, "componentType": 5121, "normalized": true, "count": 1, "type": "VEC3" });
    let file = open(&[255, 0, 255], json!({}), accessor);
    assert_eq!(file.read_colors(0).unwrap(), [Vec4::new(1.0, 0.0, 1.0, 1.0)]);
}

#[test]
fn positions_must_be_finite_and_indices_in_range() {
    let accessor = json!({ "bufferView": 0, "componentType": 5126, "count": 2, "type": "VEC3" });
    let file = open(&floats(&[0.0, 1.0, 2.0, 0.0, f32::NAN, 0.0]), json!({}), accessor);
    let error = file.read_positions(0).unwrap_err().to_string();
    assert!(error.contains("/accessors/0") && error.contains("element 1"), "{error}");
    assert_eq!(file.read_vec3(0).unwrap()[0], Vec3::new(0.0, 1.0, 2.0));

    let accessor = json!({ "bufferView": 0, "componentType": 5121, "count": 3, "type": "SCALAR" });
    let file = open(&[0, 1, 2], json!({}), accessor);
    assert_eq!(file.read_indices(0, 3).unwrap(), [0, 1, 2]);
    assert_eq!(code(file.read_indices(0, 2)), Code::VertexIndex);
    assert_eq!(code(file.read_vec3(0)), Code::AccessorType);
    assert_eq!(code(file.read_u32(1)), Code::IndexOutOfRange);
}

#[test]
fn claims_beyond_the_data_are_refused() {
    let accessor =
        |count: u64| json!({ "bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3" });
    assert!(file(&[0; 24], json!({}), accessor(2)).is_ok());
    for count in [3, 1 << 31, u64::MAX] {
        assert_eq!(code(file(&[0; 24], json!({}), accessor(count))), Code::AccessorOutOfRange);
    }
    let zeros = json!({ "componentType": 5126, "count": 1_u64 << 31, "type": "VEC3" });
    assert_eq!(code(file(&[0; 24], json!({}), zeros)), Code::AccessorTooLarge);
    assert_eq!(code(file(&[0; 24], json!({ "byteLength": 25 }), accessor(2))), Code::ViewOutOfRange);
    assert_eq!(code(file(&[0; 24], json!({ "byteOffset": u64::MAX }), accessor(1))), Code::ViewOutOfRange);
    assert_eq!(code(file(&[0; 24], json!({ "byteStride": 8 }), accessor(2))), Code::WrongValue);
    let codec = json!({
        "buffer": 0, "byteLength": 24, "byteStride": 12, "count": 1 << 20, "mode": "ATTRIBUTES", "filter": "NONE",
    });
    let bomb = json!({ "extensions": { "EXT_meshopt_compression": codec } });
    assert_eq!(code(file(&[0; 24], bomb, accessor(1 << 20))), Code::AccessorTooLarge);
}

/// Found by fuzzing: what was appended to such a file seemed to belong to the view, and stripping left it behind.
#[test]
fn the_place_of_a_decoded_view_lies_inside_its_buffer() {
    let view = |offset: u32| {
        let codec = json!({
            "buffer": 0, "byteLength": 24, "byteStride": 12, "count": 2, "mode": "ATTRIBUTES", "filter": "NONE",
        });
        json!({ "byteOffset": offset, "extensions": { "EXT_meshopt_compression": codec } })
    };
    let accessor = json!({ "bufferView": 0, "componentType": 5126, "count": 2, "type": "VEC3" });
    assert!(file(&[0; 24], view(0), accessor.clone()).is_ok());
    assert_eq!(code(file(&[0; 24], view(12), accessor)), Code::ViewOutOfRange);
}

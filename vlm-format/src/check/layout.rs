//! Offsets, strides and counts against the bytes that are there.

use serde_json::Value;

use super::{Report, array, count, index};
use crate::error::Code;

/// Elements that an accessor may have without data of its own (all zero, or sparse over zeros).
///
/// Higher values let a file of a few bytes claim more memory (4 Mi elements are 48 MiB of positions); lower values
/// refuse real morph targets and placeholders, which have as many elements as their mesh has vertices.
pub(crate) const MAX_ZERO_ELEMENTS: u64 = 1 << 22;

/// How many bytes one encoded byte of EXT_meshopt_compression can decode to.
///
/// A vertex block holds at most 256 vertices and costs at least one control byte per four bytes of a vertex, so 1024
/// bytes per byte; the index codecs cost at least one byte per triangle or index.
pub(crate) const MAX_MESHOPT_RATIO: u64 = 1024;

/// The codec object of a compressed buffer view, and the name of its extension.
pub(crate) fn meshopt(view: &Value) -> Option<(&'static str, &Value)> {
    ["EXT_meshopt_compression", "KHR_meshopt_compression"]
        .into_iter()
        .find_map(|name| Some((name, view.get("extensions")?.get(name)?)))
}

/// Bytes per component of a glTF component type.
pub(crate) fn component_bytes(component_type: u64) -> u64 {
    match component_type {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        _ => 4,
    }
}

/// Columns and rows of a glTF accessor type; vectors are one column.
pub(crate) fn columns_and_rows(kind: &str) -> (u64, u64) {
    match kind {
        "VEC2" => (1, 2),
        "VEC3" => (1, 3),
        "VEC4" => (1, 4),
        "MAT2" => (2, 2),
        "MAT3" => (3, 3),
        "MAT4" => (4, 4),
        _ => (1, 1),
    }
}

/// Bytes from one column of a matrix to the next: columns start at multiples of 4 bytes.
pub(crate) fn column_bytes(columns: u64, rows: u64, component: u64) -> u64 {
    if columns > 1 { (rows * component).next_multiple_of(4) } else { rows * component }
}

/// Bytes of one element of an accessor, with the padding between the columns of a matrix.
pub(crate) fn element_bytes(accessor: &Value) -> u64 {
    let (columns, rows) = columns_and_rows(accessor.get("type").and_then(Value::as_str).unwrap_or_default());
    columns
        * column_bytes(columns, rows, component_bytes(count(accessor, "componentType").unwrap_or_default()))
}

/// Bytes that a buffer view yields once decoded.
pub(crate) fn decoded_bytes(view: &Value) -> u64 {
    match meshopt(view) {
        Some((_, codec)) => {
            let (count, stride) = (count(codec, "count"), count(codec, "byteStride"));
            count.unwrap_or_default().saturating_mul(stride.unwrap_or_default())
        }
        None => count(view, "byteLength").unwrap_or_default(),
    }
}

/// Compares buffer views and accessors with `buffer_bytes`, the number of bytes that each buffer really has.
pub(crate) fn check(root: &Value, buffer_bytes: &[u64], report: &mut Report) {
    let promised: Vec<u64> = array(root, "/buffers")
        .iter()
        .map(|buffer| count(buffer, "byteLength").unwrap_or_default())
        .collect();
    for (i, view) in array(root, "/bufferViews").iter().enumerate() {
        let pointer = format!("/bufferViews/{i}");
        match meshopt(view) {
            Some((name, codec)) => {
                // What it decodes to need not be in the file, but has a place there: what is appended later must not fall into it.
                check_range(view, &promised, &pointer, report);
                let pointer = format!("{pointer}/extensions/{name}");
                check_range(codec, buffer_bytes, &pointer, report);
                check_codec(codec, &pointer, report);
            }
            None => check_range(view, buffer_bytes, &pointer, report),
        }
    }
    let views = array(root, "/bufferViews");
    for (i, accessor) in array(root, "/accessors").iter().enumerate() {
        check_accessor(accessor, views, &format!("/accessors/{i}"), report);
    }
}

/// `byteOffset + byteLength` lies inside the buffer.
fn check_range(view: &Value, buffer_bytes: &[u64], pointer: &str, report: &mut Report) {
    let buffer = index(view, "buffer").unwrap_or(usize::MAX);
    let available = buffer_bytes.get(buffer).copied().unwrap_or_default();
    let (offset, length) = (count(view, "byteOffset").unwrap_or(0), count(view, "byteLength").unwrap_or(0));
    if offset.checked_add(length).is_none_or(|end| end > available) {
        let message = format!(
            "{length} bytes from byte {offset} on do not fit into buffer {buffer} of {available} bytes"
        );
        report.error(Code::ViewOutOfRange, pointer, message);
    }
}

/// The decoder's preconditions, and a bound on what it may claim.
fn check_codec(codec: &Value, pointer: &str, report: &mut Report) {
    let number = |key| count(codec, key).unwrap_or_default();
    let (elements, stride, encoded) = (number("count"), number("byteStride"), number("byteLength"));
    let filter = codec.get("filter").and_then(Value::as_str).unwrap_or("NONE");
    let fits = match codec.get("mode").and_then(Value::as_str).unwrap_or_default() {
        "ATTRIBUTES" => stride.is_multiple_of(4) && (4..=256).contains(&stride),
        "TRIANGLES" => (stride == 2 || stride == 4) && elements.is_multiple_of(3) && filter == "NONE",
        _ => (stride == 2 || stride == 4) && filter == "NONE",
    };
    let filter_fits = match filter {
        "OCTAHEDRAL" | "COLOR" => stride == 4 || stride == 8,
        "QUATERNION" => stride == 8,
        _ => true,
    };
    if !fits || !filter_fits {
        let message =
            format!("{elements} elements of {stride} bytes do not suit the mode and filter (`{filter}`)");
        report.error(Code::Compression, pointer, message);
    }
    let limit = encoded.saturating_mul(MAX_MESHOPT_RATIO);
    if elements.checked_mul(stride).is_none_or(|decoded| decoded > limit) {
        let message =
            format!("{elements} elements of {stride} bytes cannot come from {encoded} encoded bytes");
        report.error(Code::AccessorTooLarge, pointer, message);
    }
}

fn check_accessor(accessor: &Value, views: &[Value], pointer: &str, report: &mut Report) {
    let elements = count(accessor, "count").unwrap_or_default();
    let bytes = element_bytes(accessor);
    match index(accessor, "bufferView").and_then(|i| views.get(i)) {
        Some(view) => check_elements(
            &Elements { owner: accessor, view, count: elements, bytes, may_stride: true },
            pointer,
            report,
        ),
        None if elements > MAX_ZERO_ELEMENTS => {
            let message = format!("{elements} elements without a bufferView, more than {MAX_ZERO_ELEMENTS}");
            report.error(Code::AccessorTooLarge, pointer, message);
        }
        None => {}
    }
    if let Some(sparse) = accessor.get("sparse") {
        check_sparse(sparse, elements, bytes, views, pointer, report);
    }
}

fn check_sparse(
    sparse: &Value,
    elements: u64,
    bytes: u64,
    views: &[Value],
    pointer: &str,
    report: &mut Report,
) {
    let replaced = count(sparse, "count").unwrap_or_default();
    if replaced > elements {
        let message = format!("{replaced} replaced elements of {elements}");
        report.error(Code::AccessorOutOfRange, format!("{pointer}/sparse/count"), message);
    }
    for key in ["indices", "values"] {
        let Some(owner) = sparse.get(key) else { continue };
        let bytes = if key == "indices" {
            component_bytes(count(owner, "componentType").unwrap_or_default())
        } else {
            bytes
        };
        if let Some(view) = index(owner, "bufferView").and_then(|i| views.get(i)) {
            let elements = Elements { owner, view, count: replaced, bytes, may_stride: false };
            check_elements(&elements, &format!("{pointer}/sparse/{key}"), report);
        }
    }
}

/// A run of elements in a buffer view.
struct Elements<'a> {
    /// Has the `byteOffset`.
    owner: &'a Value,
    view: &'a Value,
    count: u64,
    /// Bytes of one element.
    bytes: u64,
    may_stride: bool,
}

fn check_elements(elements: &Elements<'_>, pointer: &str, report: &mut Report) {
    let Elements { owner, view, count: elements, bytes, may_stride } = *elements;
    let offset = count(owner, "byteOffset").unwrap_or(0);
    let stride = if may_stride { view_stride(view).unwrap_or(bytes) } else { bytes };
    if stride < bytes {
        report.error(
            Code::WrongValue,
            pointer,
            format!("elements of {bytes} bytes overlap at a stride of {stride}"),
        );
    }
    let available = decoded_bytes(view);
    let end = elements
        .checked_sub(1)
        .map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(bytes)?.checked_add(offset));
    if end.is_none_or(|end| end > available) {
        let message = format!(
            "{elements} elements of {bytes} bytes, {stride} apart, from byte {offset} on do not fit into {available} bytes"
        );
        report.error(Code::AccessorOutOfRange, pointer, message);
    }
}

/// Bytes from one element to the next, where the buffer view says so. A stride of 0 is read as none.
pub(crate) fn view_stride(view: &Value) -> Option<u64> {
    let stride = meshopt(view).map_or(view, |(_, codec)| codec);
    count(stride, "byteStride").filter(|&stride| stride > 0)
}

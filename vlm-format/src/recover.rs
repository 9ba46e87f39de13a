//! Finds arrays of the extension by their digests, where another tool renumbered the accessors.

use std::collections::HashMap;

use serde_json::Value;

use crate::check::{array, count, layout};
use crate::compress::Codec;
use crate::container::GltfFile;
use crate::digest;

/// Accessors by the digest of what they hold.
#[derive(Default)]
pub(crate) struct Arrays {
    plain: HashMap<String, usize>,
    /// Those of unsigned bytes, which compressed arrays are stored in.
    bytes: Vec<usize>,
}

impl Arrays {
    /// All accessors that could be an array's. What cannot be read is none.
    pub(crate) fn of(file: &GltfFile) -> Self {
        let mut arrays = Self::default();
        for (accessor, json) in array(file.json(), "/accessors").iter().enumerate() {
            let kind = json.get("type").and_then(Value::as_str).unwrap_or_default();
            let bytes = match (kind, count(json, "componentType")) {
                ("SCALAR", Some(5121)) => {
                    arrays.bytes.push(accessor);
                    continue;
                }
                ("SCALAR" | "VEC3" | "VEC4", Some(5126)) => {
                    file.read_floats(accessor).map(|values| words(&values))
                }
                ("SCALAR", Some(5125)) => file.read_u32(accessor).map(|values| words(&values)),
                _ => continue,
            };
            if let Ok(bytes) = bytes {
                arrays.plain.entry(digest::of_array(kind, &bytes)).or_insert(accessor);
            }
        }
        arrays
    }

    /// The accessor that holds an array with this digest, plain or as its `compression` says.
    pub(crate) fn find(
        &self,
        file: &GltfFile,
        codec: Option<&Value>,
        kind: &str,
        digest: &str,
    ) -> Option<usize> {
        match codec {
            None => self.plain.get(digest).copied(),
            Some(codec) => self.compressed(file, codec, kind, digest),
        }
    }

    fn compressed(&self, file: &GltfFile, codec: &Value, kind: &str, digest: &str) -> Option<usize> {
        let (_, components) = layout::columns_and_rows(kind);
        let codec = Codec::read(codec, components * size_of::<u32>() as u64, "").ok()?;
        let holds = |accessor: usize| {
            let json = array(file.json(), "/accessors").get(accessor)?;
            count(json, "count").filter(|&count| count == codec.byte_length)?;
            let bytes = codec.decode(&file.read_bytes(accessor).ok()?, "").ok()?;
            (digest::of_array(kind, &bytes) == digest).then_some(accessor)
        };
        self.bytes.iter().copied().find_map(holds)
    }
}

/// Little-endian bytes.
fn words<T: bytemuck::Pod>(values: &[T]) -> Vec<u8> {
    let words: &[u32] = bytemuck::cast_slice(values);
    words.iter().copied().flat_map(u32::to_le_bytes).collect()
}

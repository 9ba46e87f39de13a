//! EXT_meshopt_compression and KHR_meshopt_compression: buffer views decoded by meshoptimizer.

use serde_json::Value;

use crate::check::count;
use crate::error::{Code, Issue};

/// Decodes a compressed buffer view whose `codec` object has passed [`crate::check::layout`].
///
/// Returns `count * byteStride` bytes.
pub(crate) fn decode(codec: &Value, encoded: &[u8], pointer: &str) -> Result<Vec<u8>, Issue> {
    let size = |key| count(codec, key).and_then(|size| usize::try_from(size).ok()).unwrap_or_default();
    let (elements, stride) = (size("count"), size("byteStride"));
    let text = |key| codec.get(key).and_then(Value::as_str).unwrap_or_default();
    let decoded = match (text("mode"), stride) {
        ("ATTRIBUTES", _) => {
            decode_vertices(encoded, elements, stride).map(|words| filter(words, stride, text("filter")))
        }
        ("TRIANGLES", 2) => {
            meshopt::decode_index_buffer::<u16>(encoded, elements).ok().map(|indices| le_bytes_16(&indices))
        }
        ("TRIANGLES", _) => {
            meshopt::decode_index_buffer::<u32>(encoded, elements).ok().map(|indices| le_bytes_32(&indices))
        }
        (_, 2) => {
            meshopt::decode_index_sequence::<u16>(encoded, elements).ok().map(|indices| le_bytes_16(&indices))
        }
        _ => {
            meshopt::decode_index_sequence::<u32>(encoded, elements).ok().map(|indices| le_bytes_32(&indices))
        }
    };
    decoded.ok_or_else(|| Issue::error(Code::Compression, pointer, "meshoptimizer cannot decode the data"))
}

/// Encodes little-endian words as [`decode`] reads them, by the `mode` and `byteStride` of `codec`: vertices, or a sequence of indices.
///
/// `None` if the codec cannot hold them, or the stride is none of those that this library writes.
pub(crate) fn encode(codec: &Value, bytes: &[u8]) -> Option<Vec<u8>> {
    let words: Vec<u32> = bytes.as_chunks().0.iter().map(|&word| u32::from_le_bytes(word)).collect();
    let largest = words.iter().max().copied()?;
    if codec.get("mode").is_some_and(|mode| mode == "INDICES") {
        let bound = (largest as usize).saturating_add(1);
        return meshopt::encode_index_sequence(&words, bound).ok().filter(|encoded| !encoded.is_empty());
    }
    match count(codec, "byteStride")? {
        4 => encode_vertices::<1>(&words),
        8 => encode_vertices::<2>(&words),
        12 => encode_vertices::<3>(&words),
        64 => encode_vertices::<16>(&words),
        _ => None,
    }
}

fn encode_vertices<const N: usize>(words: &[u32]) -> Option<Vec<u8>> {
    // Level and version are given, so that nothing that a program sets for the whole process changes the bytes.
    let encoded = meshopt::encode_vertex_buffer_level(words.as_chunks::<N>().0, 3, Some(1));
    encoded.ok().filter(|encoded| !encoded.is_empty())
}

/// A vertex of N words. `[u32; N]` has a `Default` only up to 32 of them.
#[derive(Clone)]
struct Words<const N: usize>([u32; N]);

impl<const N: usize> Default for Words<N> {
    fn default() -> Self {
        Self([0; N])
    }
}

/// The words of all vertices, one after the other. meshopt takes the stride as a type, so each has its own branch.
fn decode_vertices(encoded: &[u8], count: usize, stride: usize) -> Option<Vec<u32>> {
    fn decode<const N: usize>(encoded: &[u8], count: usize) -> Option<Vec<u32>> {
        let vertices = meshopt::decode_vertex_buffer::<Words<N>>(encoded, count).ok()?;
        Some(vertices.iter().flat_map(|vertex| vertex.0).collect())
    }
    macro_rules! by_words {
        ($($n:literal)*) => {
            match stride / 4 {
                $($n => decode::<$n>(encoded, count),)*
                _ => None,
            }
        };
    }
    by_words!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32
        33 34 35 36 37 38 39 40 41 42 43 44 45 46 47 48 49 50 51 52 53 54 55 56 57 58 59 60 61 62 63 64)
}

/// Undoes the filter that was applied before encoding, and returns the bytes as the GPU would read them.
fn filter(mut words: Vec<u32>, stride: usize, filter: &str) -> Vec<u8> {
    match (filter, stride) {
        ("EXPONENTIAL", _) => meshopt::decode_filter_exp::<1>(bytemuck::cast_slice_mut(&mut words)),
        ("OCTAHEDRAL", 4) => meshopt::decode_filter_oct::<i8>(bytemuck::cast_slice_mut(&mut words)),
        ("OCTAHEDRAL", 8) => meshopt::decode_filter_oct::<i16>(bytemuck::cast_slice_mut(&mut words)),
        ("QUATERNION", 8) => meshopt::decode_filter_quat(bytemuck::cast_slice_mut(&mut words)),
        ("COLOR", 4) => meshopt::decode_filter_color::<u8>(bytemuck::cast_slice_mut(&mut words)),
        ("COLOR", 8) => meshopt::decode_filter_color::<u16>(bytemuck::cast_slice_mut(&mut words)),
        _ => {}
    }
    le_bytes_32(&words)
}

fn le_bytes_16(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn le_bytes_32(values: &[u32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn codec(mode: &str, filter: &str, count: usize, stride: usize) -> Value {
        json!({ "mode": mode, "filter": filter, "count": count, "byteStride": stride })
    }

    #[test]
    fn vertices_survive_at_every_kind_of_stride() {
        fn check<const N: usize>() {
            let vertices: Vec<[u32; N]> = (0..300).map(|i| [i * i; N]).collect();
            let encoded = meshopt::encode_vertex_buffer(&vertices).unwrap();
            let decoded = decode(&codec("ATTRIBUTES", "NONE", 300, 4 * N), &encoded, "").unwrap();
            let words: Vec<u32> = vertices.into_iter().flatten().collect();
            assert_eq!(decoded, le_bytes_32(&words), "stride {}", 4 * N);
        }
        check::<1>();
        check::<3>();
        check::<32>();
        check::<33>();
        check::<64>();
    }

    #[test]
    fn indices_survive_in_both_widths() {
        let indices: Vec<u32> = vec![0, 1, 2, 2, 1, 3, 4, 5, 6];
        let narrow: Vec<u16> = indices.iter().map(|&index| index as u16).collect();
        let triangles = meshopt::encode_index_buffer(&indices, 7).unwrap();
        let sequence = meshopt::encode_index_sequence(&indices, 7).unwrap();
        for (mode, encoded) in [("TRIANGLES", triangles), ("INDICES", sequence)] {
            assert_eq!(decode(&codec(mode, "NONE", 9, 4), &encoded, "").unwrap(), le_bytes_32(&indices));
            assert_eq!(decode(&codec(mode, "NONE", 9, 2), &encoded, "").unwrap(), le_bytes_16(&narrow));
        }
    }

    #[test]
    fn the_exponential_filter_is_undone() {
        let floats = [[1.5_f32, -0.25, 1024.0], [0.0, 3.0, -7.0]];
        let encoded = meshopt::encode_filter_exp::<3>(&floats, 24, meshopt::EncodeExpMode::Separate);
        let encoded = meshopt::encode_vertex_buffer(&encoded).unwrap();
        let decoded = decode(&codec("ATTRIBUTES", "EXPONENTIAL", 2, 12), &encoded, "").unwrap();
        let bits: Vec<u32> = floats.as_flattened().iter().map(|float| float.to_bits()).collect();
        assert_eq!(decoded, le_bytes_32(&bits));
    }

    #[test]
    fn garbage_is_refused() {
        for mode in ["ATTRIBUTES", "TRIANGLES", "INDICES"] {
            let refused = decode(&codec(mode, "NONE", 3, 4), &[1, 2, 3], "/p").unwrap_err();
            assert_eq!((refused.code, refused.pointer.as_str()), (Code::Compression, "/p"));
        }
    }
}

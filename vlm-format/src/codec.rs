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

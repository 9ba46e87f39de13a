//! Compression of the extension's own arrays by the codecs of meshoptimizer, without loss.
//!
//! It is a property of our arrays and not `EXT_meshopt_compression` of a buffer view: that would have to be required, and a file must
//! open in viewers that know neither.

use serde_json::{Value, json};

use crate::check::layout::element_bytes;
use crate::check::{array, count, index};
use crate::codec;
use crate::container::GltfFile;
use crate::error::{Code, Issue};
use crate::strip::EXTENSION;

/// The property of an array that says how it is compressed.
pub(crate) const PROPERTY: &str = "compression";

/// How many bytes one stored byte may decode to.
///
/// Arrays of equal values reach 1024, as [`crate::check::layout::MAX_MESHOPT_RATIO`] says. Higher values let a small file claim more
/// memory; lower ones leave arrays of nearly equal values (tags) as they are.
const MAX_RATIO: u64 = 256;

/// Vertices: for each byte of a stride, differences from one to the next.
const ATTRIBUTES: &str = "ATTRIBUTES";

/// Whole numbers as differences of any length.
const INDICES: &str = "INDICES";

/// Mode and stride of each array. They were chosen by size over three scenes. The codec for triangles is not among them: it turns the
/// corners of a triangle around.
const CODECS: [(&str, &str, u64); 22] = [
    ("lights/positions", ATTRIBUTES, 12),
    ("lights/indices", ATTRIBUTES, 12),
    ("lights/albedo", ATTRIBUTES, 12),
    ("lights/emission", ATTRIBUTES, 12),
    ("lights/tags", ATTRIBUTES, 4),
    ("samples/starts", ATTRIBUTES, 4),
    ("samples/positions", ATTRIBUTES, 12),
    ("samples/normals", ATTRIBUTES, 12),
    ("samples/reflectance", ATTRIBUTES, 12),
    ("grid/cells", INDICES, 4),
    ("grid/leaves", ATTRIBUTES, 8),
    ("grid/leafProbes", ATTRIBUTES, 4),
    ("grid/nearStarts", ATTRIBUTES, 4),
    ("grid/near", ATTRIBUTES, 4),
    ("grid/nearFormFactors", ATTRIBUTES, 4),
    ("grid/probes", ATTRIBUTES, 64),
    ("grid/sampleShares", ATTRIBUTES, 4),
    ("grid/surfaceGains", ATTRIBUTES, 4),
    ("grid/uncovered", ATTRIBUTES, 64),
    ("grid/rowStarts", ATTRIBUTES, 4),
    ("grid/rows", ATTRIBUTES, 4),
    ("triangleTags", ATTRIBUTES, 4),
];

/// How an array is compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Codec {
    mode: &'static str,
    /// Elements of `stride` bytes each.
    count: u64,
    stride: u64,
    /// Bytes once encoded.
    pub(crate) byte_length: u64,
}

impl Codec {
    /// Encodes the array of this name; `None` where that would not make the file smaller, or an array that the reader would refuse.
    pub(crate) fn encode(name: &str, bytes: &[u8]) -> Option<(Self, Vec<u8>)> {
        let &(_, mode, stride) = CODECS.iter().find(|(known, ..)| *known == name)?;
        let decoded = bytes.len() as u64;
        let count = decoded.checked_div(stride).filter(|count| count * stride == decoded)?;
        let mut codec = Self { mode, count, stride, byte_length: 0 };
        let encoded = codec::encode(&codec.json(), bytes)?;
        codec.byte_length = encoded.len() as u64;
        let with_json = encoded.len() + PROPERTY.len() + codec.json().to_string().len();
        let fits = with_json < bytes.len() && decoded <= MAX_RATIO.saturating_mul(codec.byte_length);
        // The codec of indices loses the uppermost bits of large differences.
        let survives = || codec.decode(&encoded, "").is_ok_and(|found| found == bytes);
        (fits && survives()).then_some((codec, encoded))
    }

    /// The `compression` property of an array.
    pub(crate) fn json(&self) -> Value {
        let Self { mode, count, stride, byte_length } = self;
        json!({ "mode": mode, "count": count, "byteStride": stride, "byteLength": byte_length })
    }

    /// Checks a `compression` property, whose pointer is given, of an array with elements of so many bytes. What passes may be decoded:
    /// it claims no more memory than the stored bytes justify.
    pub(crate) fn read(json: &Value, element: u64, pointer: &str) -> Result<Self, Issue> {
        let number = |key| number(json, key, pointer);
        let codec = Self {
            mode: mode(json, pointer)?,
            count: number("count")?,
            stride: number("byteStride")?,
            byte_length: number("byteLength")?,
        };
        let Self { mode, count, stride, byte_length } = codec;
        let suits = match mode {
            INDICES => stride == 4 && element == 4,
            _ => stride.is_multiple_of(element) && stride.is_multiple_of(4) && stride <= 256,
        };
        if !suits {
            let message = format!("a stride of {stride} does not suit {mode} of {element} bytes");
            return Err(Issue::error(Code::Compression, format!("{pointer}/byteStride"), message));
        }
        let limit = byte_length.saturating_mul(MAX_RATIO);
        if count.checked_mul(stride).is_none_or(|decoded| decoded > limit) {
            let message = format!(
                "{count} elements of {stride} bytes are more than {MAX_RATIO} times {byte_length} bytes"
            );
            return Err(Issue::error(Code::AccessorTooLarge, format!("{pointer}/count"), message));
        }
        Ok(codec)
    }

    /// Decodes stored bytes.
    pub(crate) fn decode(&self, stored: &[u8], pointer: &str) -> Result<Vec<u8>, Issue> {
        codec::decode(&self.json(), stored, pointer)
    }
}

fn mode(json: &Value, pointer: &str) -> Result<&'static str, Issue> {
    let known = |mode: &Value| [ATTRIBUTES, INDICES].into_iter().find(|known| mode == known);
    json.get("mode").and_then(known).ok_or_else(|| {
        let message = format!("must be `{ATTRIBUTES}` or `{INDICES}`");
        Issue::error(Code::WrongValue, format!("{pointer}/mode"), message)
    })
}

fn number(json: &Value, key: &str, pointer: &str) -> Result<u64, Issue> {
    count(json, key).filter(|&number| number > 0).ok_or_else(|| {
        Issue::error(Code::WrongType, format!("{pointer}/{key}"), "must be a whole number above 0")
    })
}

impl GltfFile {
    /// Bytes that an array of the Virtual Light Meshes takes in the file, by its group and name there, such as `grid/rows`: fewer than it
    /// has in memory where it is compressed. 0 for an array that is absent.
    #[must_use]
    pub fn stored_vlm_bytes(&self, array_name: &str) -> u64 {
        let place = self.json().pointer(&format!("/extensions/{EXTENSION}/{array_name}"));
        let accessor = place.and_then(|place| index(place, "accessor"));
        let accessor = accessor.and_then(|accessor| array(self.json(), "/accessors").get(accessor));
        accessor.map_or(0, |json| count(json, "count").unwrap_or(0).saturating_mul(element_bytes(json)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(words: impl IntoIterator<Item = u32>) -> Vec<u8> {
        words.into_iter().flat_map(u32::to_le_bytes).collect()
    }

    #[test]
    fn every_codec_gives_back_what_went_in() {
        let words = bytes((0..4800).map(|i| i * i / 7));
        for (name, mode, stride) in CODECS {
            let (codec, encoded) =
                Codec::encode(name, &words).unwrap_or_else(|| panic!("{name} stays as it is"));
            assert_eq!((codec.mode, codec.stride, codec.byte_length), (mode, stride, encoded.len() as u64));
            assert_eq!(Codec::read(&codec.json(), 4, ""), Ok(codec), "{name}");
            assert_eq!(codec.decode(&encoded, "").unwrap(), words, "{name}");
            assert_eq!(Codec::encode(name, &words).unwrap().1, encoded, "{name} differs the second time");
        }
    }

    #[test]
    fn what_does_not_gain_or_survive_stays_as_it_is() {
        let noise = |i: u32| i.wrapping_mul(0x9E37_79B9).rotate_left(i % 32).wrapping_mul(0x85EB_CA6B);
        let rows = |words: Vec<u8>| Codec::encode("grid/rows", &words).is_some();
        assert!(rows(bytes((0..1000).map(|i| i / 2))));
        assert!(!rows(bytes((0..1000).map(noise))), "noise does not shrink");
        assert!(!rows(bytes(0..12)), "the property is longer than what it saves");
        assert!(!rows(bytes([0; 100_000])), "the reader refuses the ratio");
        assert!(!rows(Vec::new()) && !rows(vec![0; 1001]));
        assert_eq!(Codec::encode("grid/unknown", &bytes(0..1000)), None);
        let cells = |large: u32| {
            let words = (0..1000).map(|i| if i == 500 { large } else { i });
            Codec::encode("grid/cells", &bytes(words)).is_some()
        };
        assert!(cells(1 << 28));
        assert!(!cells(1 << 31), "the difference has too many bits");
    }

    #[test]
    fn wrong_properties_are_refused_by_code_and_place() {
        let valid = json!({ "mode": ATTRIBUTES, "count": 1000, "byteStride": 12, "byteLength": 500 });
        assert!(Codec::read(&valid, 12, "/p").is_ok());
        for (key, value, code) in [
            ("mode", json!("TRIANGLES"), Code::WrongValue),
            ("mode", json!(1), Code::WrongValue),
            ("mode", json!(INDICES), Code::Compression),
            ("count", json!(0), Code::WrongType),
            ("count", json!(-1), Code::WrongType),
            ("count", json!(10_667), Code::AccessorTooLarge),
            ("count", json!(u64::MAX), Code::AccessorTooLarge),
            ("byteStride", json!(0), Code::WrongType),
            ("byteStride", json!(4), Code::Compression),
            ("byteStride", json!(264), Code::Compression),
            ("byteLength", json!(null), Code::WrongType),
            ("byteLength", json!(46), Code::AccessorTooLarge),
        ] {
            let mut broken = valid.clone();
            broken[key] = value;
            let issue = Codec::read(&broken, 12, "/p").unwrap_err();
            assert_eq!(issue.code, code, "{broken}: {issue}");
            assert!(issue.pointer.starts_with("/p/"), "{issue}");
        }
        assert!(Codec::read(&json!(7), 12, "/p").is_err());
    }
}

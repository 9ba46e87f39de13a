//! A glTF file as its mutator sees it: JSON, binary data, and how they were packed.

use serde_json::Value;

use crate::glb;

/// The two parts of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    /// The document.
    pub json: Value,
    /// The BIN chunk; `None` for a file of JSON alone.
    pub bin: Option<Vec<u8>>,
}

impl Parts {
    /// Takes a file apart; `None` for what is not even JSON. Chunks beyond the second are dropped.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Option<Self> {
        if !bytes.starts_with(b"glTF") {
            return Some(Self { json: serde_json::from_slice(bytes).ok()?, bin: None });
        }
        let (json, rest) = chunk(bytes.get(12..)?)?;
        let bin = chunk(rest).map_or(&[][..], |(bin, _)| bin);
        Some(Self { json: serde_json::from_slice(json).ok()?, bin: Some(bin.to_vec()) })
    }

    /// Puts them together again.
    #[must_use]
    pub fn pack(&self) -> Vec<u8> {
        match &self.bin {
            Some(bin) => glb::container(&self.json, bin),
            None => self.json.to_string().into_bytes(),
        }
    }
}

/// The data of the first chunk, and what follows it.
fn chunk(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let length = u32::from_le_bytes(bytes.get(..4)?.try_into().ok()?) as usize;
    Some((bytes.get(8..)?.get(..length)?, bytes.get(8 + length..)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cornell;

    #[test]
    fn a_file_taken_apart_and_packed_is_the_same() {
        let room = cornell::all()[0].1.clone();
        let parts = Parts::of(&room).unwrap();
        assert_eq!(parts.pack(), room);
        assert_eq!(Parts::of(&room[..room.len() / 3]), None, "the negative control");
        let plain = Parts { bin: None, ..parts };
        assert_eq!(Parts::of(&plain.pack()), Some(plain));
    }
}

//! The GLB container: a 12-byte header and chunks (glTF 2.0 specification, section 4.4).

use crate::error::{Code, Issue};

const MAGIC: &[u8; 4] = b"glTF";
const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BIN: u32 = 0x004E_4942;
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;

/// The chunks of a GLB file, borrowed from it.
#[derive(Debug, PartialEq)]
pub(crate) struct Glb<'a> {
    /// The JSON chunk, with its padding.
    pub json: &'a [u8],
    /// The BIN chunk, with its padding.
    pub bin: Option<&'a [u8]>,
    /// Chunks of other types, in order: readers must ignore them, and writers keep them.
    pub others: Vec<(u32, &'a [u8])>,
}

/// True if the bytes claim to be GLB (of any version).
pub(crate) fn is_glb(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Splits a GLB file into its chunks.
pub(crate) fn parse(bytes: &[u8]) -> Result<Glb<'_>, Issue> {
    let damaged = |message: String| Issue::error(Code::GlbDamaged, "", message);
    let word = |at: usize| {
        read_u32(bytes, at)
            .ok_or_else(|| damaged(format!("the GLB ends at byte {}, inside a header", bytes.len())))
    };

    let version = word(4)?;
    if version != 2 {
        return Err(Issue::error(
            Code::Version,
            "",
            format!("the GLB container has version {version}, not 2"),
        ));
    }
    let length = word(8)? as usize;
    if length > bytes.len() {
        return Err(damaged(format!("the GLB header promises {length} bytes, the file has {}", bytes.len())));
    }

    let mut chunks = Vec::new();
    let mut at = HEADER_BYTES;
    while at + CHUNK_HEADER_BYTES <= length {
        let (size, kind) = (word(at)? as usize, word(at + 4)?);
        let start = at + CHUNK_HEADER_BYTES;
        let data = start.checked_add(size).filter(|&end| end <= length).and_then(|end| bytes.get(start..end));
        let Some(data) = data else {
            return Err(damaged(format!(
                "the chunk at byte {at} claims {size} bytes, {} remain",
                length - start
            )));
        };
        chunks.push((kind, data));
        at = start + size;
    }

    let mut chunks = chunks.into_iter().peekable();
    if chunks.peek().is_none() {
        return Err(damaged(format!("the GLB header promises {length} bytes, too few for a chunk")));
    }
    let Some((_, json)) = chunks.next_if(|chunk| chunk.0 == CHUNK_JSON) else {
        return Err(damaged(String::from("the first chunk of the GLB is not JSON")));
    };
    let bin = chunks.next_if(|chunk| chunk.0 == CHUNK_BIN).map(|chunk| chunk.1);
    Ok(Glb { json, bin, others: chunks.collect() })
}

fn read_u32(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(word.try_into().ok()?))
}

/// Joins chunks to a GLB file, padded as the specification asks: JSON with spaces, BIN with zeros.
///
/// Returns `None` if the file would exceed the format's 4 GiB.
pub(crate) fn build(json: &[u8], bin: Option<&[u8]>, others: &[(u32, Vec<u8>)]) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(
        HEADER_BYTES
            + json.len()
            + bin.map_or(0, <[u8]>::len)
            + (2 + others.len()) * (CHUNK_HEADER_BYTES + 4),
    );
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&2_u32.to_le_bytes());
    bytes.extend_from_slice(&[0; 4]);
    push_chunk(&mut bytes, CHUNK_JSON, json, b' ')?;
    if let Some(bin) = bin {
        push_chunk(&mut bytes, CHUNK_BIN, bin, 0)?;
    }
    for (kind, data) in others {
        push_chunk(&mut bytes, *kind, data, 0)?;
    }
    let length = u32::try_from(bytes.len()).ok()?;
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    Some(bytes)
}

fn push_chunk(bytes: &mut Vec<u8>, kind: u32, data: &[u8], padding: u8) -> Option<()> {
    let padded = data.len().next_multiple_of(4);
    bytes.extend_from_slice(&u32::try_from(padded).ok()?.to_le_bytes());
    bytes.extend_from_slice(&kind.to_le_bytes());
    bytes.extend_from_slice(data);
    bytes.extend(std::iter::repeat_n(padding, padded - data.len()));
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_survive_and_every_truncation_is_refused() {
        let bytes = build(b"{}", Some(&[1, 2, 3]), &[(7, vec![9])]).unwrap();
        let glb = parse(&bytes).unwrap();
        assert_eq!((glb.json, glb.bin), (&b"{}  "[..], Some(&[1, 2, 3, 0][..])));
        assert_eq!(glb.others, vec![(7, &[9, 0, 0, 0][..])]);
        for length in 0..bytes.len() {
            assert!(parse(&bytes[..length]).is_err(), "accepted a GLB cut at byte {length}");
        }
    }
}

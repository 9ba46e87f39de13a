//! Takes the extension out of a file again.

use std::collections::BTreeSet;

use serde::Deserialize;
use serde_json::Value;

use crate::check::{self, array, count, index, layout};
use crate::container::GltfFile;
use crate::digest;
use crate::error::Error;
use crate::package::{OutputFile, Parts, Target};

/// The name of the extension.
pub const EXTENSION: &str = "VLM_virtual_light_mesh";

/// A file without its Virtual Light Meshes.
#[derive(Clone, Debug)]
pub struct Stripped {
    /// The files of the output, the main one first.
    pub files: Vec<OutputFile>,
    /// Why the main file's bytes are not those that were baked; `None` if they are, or if the file had no Virtual Light Mesh.
    pub difference: Option<Difference>,
}

/// Why a stripped file is not, byte by byte, what was baked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Difference {
    /// The output is a .gltf and the input a .glb, or the other way round.
    #[error("it is in another container than the input; name the output as the input")]
    Container,
    /// Another tool renumbered or appended.
    #[error(
        "another tool changed the file after the bake, so the accessors and bytes of the lights stay in it, unused"
    )]
    DataStays,
    /// The bytes are not those that the file's digest is of.
    #[error("it was baked from a file in another container, or another tool changed it after the bake")]
    Rewritten,
    /// The file has no digest of its source.
    #[error(
        "the file does not say what it was baked from: by another tool, or from a GLB with bytes that belong to no chunk"
    )]
    Unknown,
}

/// Takes the Virtual Light Meshes out of a file, which is then as it was before [`write_vlm`](crate::write_vlm): byte by byte, where it is written into the
/// container that it was in, and no other tool changed it since.
///
/// # Errors
/// [`Error::Invalid`] if the output would be too large.
pub fn strip_vlm(file: &GltfFile, target: &Target) -> Result<Vec<OutputFile>, Error> {
    Ok(strip_vlm_compared(file, target)?.files)
}

/// Takes the Virtual Light Meshes out of a file as [`strip_vlm`] does, and tells whether its bytes are those that were baked.
///
/// # Errors
/// As [`strip_vlm`].
pub fn strip_vlm_compared(file: &GltfFile, target: &Target) -> Result<Stripped, Error> {
    let mut parts = Parts::of(file);
    let removed = strip(&mut parts);
    let converted = *file.kind() != target.kind();
    parts.convert(file, target);
    let files = parts.pack(target)?;
    let difference = removed.and_then(|removed| {
        let known = removed.root.pointer("/data/sourceDigest").and_then(Value::as_str);
        let found = files.first().map(|main| digest::of_array(FILE, &main.bytes));
        match known {
            Some(known) if found.as_deref() == Some(known) => None,
            _ if converted => Some(Difference::Container),
            _ if !removed.with_data => Some(Difference::DataStays),
            Some(_) => Some(Difference::Rewritten),
            None => Some(Difference::Unknown),
        }
    });
    Ok(Stripped { files, difference })
}

/// What the digest of a whole file is marked with.
const FILE: &str = "file";

/// The digest of the main file without Virtual Light Meshes; `None` if stripping could not give back its bytes.
pub(crate) fn source_digest(file: &GltfFile, stripped: &Parts, had_vlms: bool) -> Option<String> {
    let bytes = stripped.main_bytes()?;
    (had_vlms || bytes.len() == file.main_bytes()).then(|| digest::of_array(FILE, &bytes))
}

/// Removes all that writing added: extension objects, and the accessors, buffer view and data behind them. Returns the root object.
///
/// What is left equals the file before writing, with one exception: where another tool appended to the file after us, or uses what we
/// appended, the accessors and data stay.
pub(crate) fn strip(parts: &mut Parts) -> Option<Removed> {
    let empty = parts.json.pointer(&format!("/extensions/{EXTENSION}/data/{EMPTY}"));
    let empty: BTreeSet<String> = empty.and_then(|list| BTreeSet::deserialize(list).ok()).unwrap_or_default();
    let root = remove_extension(&mut parts.json, "", &empty);
    each(&mut parts.json, "/nodes", "", |item, place| drop(remove_extension(item, place, &empty)));
    each(&mut parts.json, "/meshes", "", |mesh, place| {
        each(mesh, "/primitives", place, |item, place| drop(remove_extension(item, place, &empty)));
    });
    if let Some(Value::Array(used)) = parts.json.get_mut("extensionsUsed")
        && used.iter().any(|name| name == EXTENSION)
    {
        used.retain(|name| name != EXTENSION);
        remove_if_empty(&mut parts.json, "", "extensionsUsed", &empty);
    }
    let removed = root.map(|root| Removed { with_data: remove_data(&root, parts, &empty).is_some(), root });
    parts.settle();
    removed
}

/// The property of `data` with the pointers of what was there before writing, and empty: else stripping would remove it.
pub(crate) const EMPTY: &str = "emptyBefore";

/// Pointers of the empty lists and objects that writing may add to.
pub(crate) fn empty_places(root: &mut Value) -> Vec<String> {
    let mut places = Vec::new();
    let mut note = |item: &Value, place: &str, keys: &[&str]| {
        let empty = |key: &&&str| item.get(key).is_some_and(is_empty);
        places.extend(keys.iter().filter(empty).map(|key| format!("{place}/{key}")));
    };
    note(root, "", &["extensions", "extensionsUsed", "accessors", "bufferViews", "buffers"]);
    each(root, "/nodes", "", |item, place| note(item, place, &["extensions"]));
    each(root, "/meshes", "", |mesh, place| {
        each(mesh, "/primitives", place, |item, place| note(item, place, &["extensions"]));
    });
    places
}

/// What was taken out.
pub(crate) struct Removed {
    /// The extension's object in the root.
    pub root: Value,
    /// False if accessors or data stayed, because they are no longer where writing put them.
    pub with_data: bool,
}

/// Removes the extension's object, and `extensions` if nothing else is in it.
fn remove_extension(item: &mut Value, place: &str, empty: &BTreeSet<String>) -> Option<Value> {
    let extensions = item.get_mut("extensions")?.as_object_mut()?;
    let extension = extensions.shift_remove(EXTENSION)?;
    remove_if_empty(item, place, "extensions", empty);
    Some(extension)
}

/// Removes accessors, buffer view and bytes, if they are still where writing put them.
///
/// Another tool may have renumbered what the extension names, so nothing is removed that could be anyone else's.
fn remove_data(extension: &Value, parts: &mut Parts, empty: &BTreeSet<String>) -> Option<()> {
    let data = extension.get("data")?;
    let (view, before) = (index(data, "bufferView")?, count(data, "bufferByteLength")?);
    let (json, others) = array(&parts.json, "/bufferViews").split_last()?;
    let is_ours = others.len() == view && json.get("name").is_some_and(|name| name == EXTENSION);
    let accessors = array(&parts.json, "/accessors");
    let uses = |accessor: &&Value| index(accessor, "bufferView") == Some(view);
    let ours = accessors.iter().rev().take_while(uses).count();
    if !is_ours || accessors.iter().filter(uses).count() != ours {
        return None;
    }
    let (buffer, offset) = (index(json, "buffer")?, count(json, "byteOffset").unwrap_or(0));
    let needed = others.iter().map(|other| end_in(other, buffer)).max().unwrap_or(0);
    // A length that does not suit the rest is no length from before writing.
    let is_tail = needed <= before && before <= offset;
    let kept = accessors.len() - ours;
    let mut without = parts.json.clone();
    truncate(&mut without, "accessors", kept, empty);
    truncate(&mut without, "bufferViews", view, empty);
    // Whatever else uses them, an attribute, say, would have nothing left.
    if check::check_json(&without).has_errors() {
        return None;
    }
    parts.json = without;
    let offset = usize::try_from(offset).ok()?;
    if is_tail { shrink_buffer(buffer, offset, before, parts, empty) } else { None }
}

/// Where the last byte that a buffer view needs of a buffer ends.
fn end_in(view: &Value, buffer: usize) -> u64 {
    let codec = layout::meshopt(view).map(|(_, codec)| codec);
    let ranges = std::iter::once(view).chain(codec).filter(|range| index(range, "buffer") == Some(buffer));
    let ends = ranges.map(|range| {
        count(range, "byteOffset").unwrap_or(0).saturating_add(count(range, "byteLength").unwrap_or(0))
    });
    ends.max().unwrap_or(0)
}

/// Gives the BIN chunk its former length, or removes a buffer that was made for the extension.
fn shrink_buffer(
    buffer: usize,
    offset: usize,
    before: u64,
    parts: &mut Parts,
    empty: &BTreeSet<String>,
) -> Option<()> {
    let buffers = array(&parts.json, "/buffers").len();
    let json = parts.json.pointer_mut(&format!("/buffers/{buffer}"))?;
    let uri = json.get("uri").and_then(Value::as_str).map(str::to_owned);
    match uri {
        Some(uri) if before == 0 && buffer + 1 == buffers => {
            parts.drop_file(&uri);
            truncate(&mut parts.json, "buffers", buffer, empty);
        }
        None if buffer == 0 => {
            if before == 0 {
                truncate(&mut parts.json, "buffers", 0, empty);
            } else {
                json["byteLength"] = before.into();
            }
            parts.bin.as_mut()?.truncate(offset);
            parts.bin.take_if(|bin| bin.is_empty());
        }
        _ => {}
    }
    Some(())
}

fn truncate(json: &mut Value, key: &str, length: usize, empty: &BTreeSet<String>) {
    if let Some(Value::Array(list)) = json.get_mut(key) {
        list.truncate(length);
    }
    remove_if_empty(json, "", key, empty);
}

/// Removes what is empty now and was not there before.
fn remove_if_empty(json: &mut Value, place: &str, key: &str, empty: &BTreeSet<String>) {
    let Value::Object(object) = json else { return };
    if object.get(key).is_some_and(is_empty) && !empty.contains(&format!("{place}/{key}")) {
        object.shift_remove(key);
    }
}

fn is_empty(value: &Value) -> bool {
    match value {
        Value::Array(list) => list.is_empty(),
        Value::Object(map) => map.is_empty(),
        _ => false,
    }
}

/// Visits the items of a list, with the pointer of each.
fn each(json: &mut Value, list: &str, place: &str, mut visit: impl FnMut(&mut Value, &str)) {
    let items = json.pointer_mut(list).and_then(Value::as_array_mut);
    for (i, item) in items.into_iter().flatten().enumerate() {
        visit(item, &format!("{place}{list}/{i}"));
    }
}

//! Takes the extension out of a file again.

use serde_json::{Map, Value};

use crate::check::{array, count, index, layout};
use crate::package::Parts;

/// The name of the extension.
pub const EXTENSION: &str = "VLM_virtual_light_mesh";

/// Removes all that writing added: extension objects, and the accessors, buffer view and data behind them.
///
/// What is left equals the file before writing, with two exceptions: lists and `extensions` objects that were empty, which
/// glTF does not allow, are gone, and where another tool appended to the file after us, the accessors and data stay, unused.
pub(crate) fn strip(parts: &mut Parts) {
    let Some(extension) = remove_extension(&mut parts.json) else { return };
    for pointer in ["/nodes", "/meshes"] {
        each(&mut parts.json, pointer, |item| {
            remove_extension(item);
            each(item, "/primitives", |primitive| drop(remove_extension(primitive)));
        });
    }
    if let Some(Value::Array(used)) = parts.json.get_mut("extensionsUsed") {
        used.retain(|name| name != EXTENSION);
    }
    remove_if_empty(&mut parts.json, "extensionsUsed");
    remove_data(&extension, parts);
}

/// Removes the extension's object, and `extensions` if nothing else is in it.
fn remove_extension(item: &mut Value) -> Option<Value> {
    let extensions = item.get_mut("extensions")?.as_object_mut()?;
    let extension = extensions.shift_remove(EXTENSION)?;
    remove_if_empty(item, "extensions");
    Some(extension)
}

/// Removes accessors, buffer view and bytes, if they are still where writing put them.
///
/// Another tool may have renumbered what the extension names, so nothing is removed that could be anyone else's.
fn remove_data(extension: &Value, parts: &mut Parts) -> Option<()> {
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
    let is_tail = others.iter().all(|other| end_in(other, buffer) <= offset);
    let kept = accessors.len() - ours;
    truncate(&mut parts.json, "accessors", kept);
    truncate(&mut parts.json, "bufferViews", view);
    if is_tail { shrink_buffer(buffer, usize::try_from(offset).ok()?, before, parts) } else { None }
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
fn shrink_buffer(buffer: usize, offset: usize, before: u64, parts: &mut Parts) -> Option<()> {
    let buffers = array(&parts.json, "/buffers").len();
    let json = parts.json.pointer_mut(&format!("/buffers/{buffer}"))?;
    let uri = json.get("uri").and_then(Value::as_str).map(str::to_owned);
    match uri {
        Some(uri) if before == 0 && buffer + 1 == buffers => {
            parts.drop_file(&uri);
            truncate(&mut parts.json, "buffers", buffer);
        }
        None if buffer == 0 => {
            if before == 0 {
                truncate(&mut parts.json, "buffers", 0);
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

fn truncate(json: &mut Value, key: &str, length: usize) {
    if let Some(Value::Array(list)) = json.get_mut(key) {
        list.truncate(length);
    }
    remove_if_empty(json, key);
}

fn remove_if_empty(json: &mut Value, key: &str) {
    let Value::Object(object) = json else { return };
    let empty = match object.get(key) {
        Some(Value::Array(list)) => list.is_empty(),
        Some(Value::Object(map)) => Map::is_empty(map),
        _ => false,
    };
    if empty {
        object.shift_remove(key);
    }
}

fn each(json: &mut Value, pointer: &str, mut change: impl FnMut(&mut Value)) {
    let items = json.pointer_mut(pointer).and_then(Value::as_array_mut);
    items.into_iter().flatten().for_each(&mut change);
}

//! The typed view of a checked file: a `gltf::Document` that can be walked without panics.
//!
//! `gltf` 1.4.1 unwraps where it finds what its own validation would have refused, and its validation refuses
//! extensions that we read. So a copy of the JSON that has passed our checks is freed of what is left of such places.

use serde_json::{Map, Value, json};

use crate::check::rules::is_semantic;
use crate::error::{Code, Issue};

/// Builds the typed view of JSON that has passed [`crate::check::check_json`].
pub(crate) fn document(root: &Value) -> Result<gltf::Document, Issue> {
    let mut view = root.clone();
    if let Value::Object(view) = &mut view {
        prepare(view);
    }
    let root: gltf::json::Root = serde_json::from_value(view).map_err(|error| {
        Issue::error(Code::WrongType, "", format!("the JSON is not shaped like glTF 2.0: {error}"))
    })?;
    Ok(gltf::Document::from_json_without_validation(root))
}

fn prepare(root: &mut Map<String, Value>) {
    // gltf demands a target node, which the specification and KHR_animation_pointer do not; nothing here animates.
    root.remove("animations");
    for scene in objects(root, "scenes") {
        scene.entry("nodes").or_insert_with(|| json!([]));
    }
    for texture in objects(root, "textures") {
        let webp =
            texture.get("extensions").and_then(|all| all.get("EXT_texture_webp")?.get("source")).cloned();
        if let (Some(source), false) = (webp, texture.contains_key("source")) {
            texture.insert(String::from("source"), source);
        }
    }
    for image in objects(root, "images") {
        if !image.contains_key("bufferView") {
            image.entry("uri").or_insert_with(|| json!(""));
        } else {
            image.entry("mimeType").or_insert_with(|| json!("application/octet-stream"));
        }
    }
    for mesh in objects(root, "meshes") {
        for primitive in objects(mesh, "primitives") {
            if let Some(Value::Object(attributes)) = primitive.get_mut("attributes") {
                attributes.retain(|name, _| is_semantic(name));
            }
        }
    }
}

fn objects<'a>(
    parent: &'a mut Map<String, Value>,
    key: &str,
) -> impl Iterator<Item = &'a mut Map<String, Value>> {
    parent.get_mut(key).and_then(Value::as_array_mut).into_iter().flatten().filter_map(Value::as_object_mut)
}

//! A small .glb that holds Virtual Light Meshes and the tree of nodes that they were baked for, and no scene: for pipelines whose tools drop
//! what they do not know.
//!
//! It is an ordinary file with the extension. What the nodes showed stands in `extras.vlmSidecar`, by digest.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::asset::VlmAsset;
use crate::check::array;
use crate::code::Code;
use crate::container::GltfFile;
use crate::error::{Error, Issue};
use crate::package::{Container, Target};
use crate::relink::{Donor, MeshTags, Origin};
use crate::write::{WriteOptions, write_vlm_with};

/// The property of the root's extras.
const PROPERTY: &str = "vlmSidecar";

/// What of a node stays: its place, not what it shows.
const NODE: [&str; 6] = ["name", "children", "matrix", "translation", "rotation", "scale"];

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Extras {
    nodes: Vec<Origin>,
    #[serde(default)]
    meshes: Vec<MeshTags>,
}

/// The bytes of a sidecar of an asset in `file`, from which it was baked. [`Donor::of`] reads it.
///
/// # Errors
/// As [`write_vlm_with`].
pub fn write_sidecar(file: &GltfFile, asset: &VlmAsset) -> Result<Vec<u8>, Error> {
    let Donor { asset, nodes, meshes } = Donor::new(file, asset.clone())?;
    let skeleton = skeleton(file, &Extras { nodes, meshes })?;
    let target = Target { container: Container::Glb, file_name: String::from("sidecar.glb") };
    let files = write_vlm_with(&skeleton, &asset, &target, &WriteOptions { compress: true })?;
    Ok(files.into_iter().next().map(|main| main.bytes).unwrap_or_default())
}

/// The tree of a file's nodes.
fn skeleton(file: &GltfFile, extras: &Extras) -> Result<GltfFile, Error> {
    let some = |json: &Value, keys: &[&str]| -> Value {
        let kept = keys.iter().filter_map(|&key| Some((key.to_owned(), json.get(key)?.clone())));
        Value::Object(kept.collect::<Map<String, Value>>())
    };
    let nodes: Vec<Value> = array(file.json(), "/nodes").iter().map(|node| some(node, &NODE)).collect();
    let scenes: Vec<Value> =
        array(file.json(), "/scenes").iter().map(|scene| some(scene, &["name", "nodes"])).collect();
    let mut json = json!({ "asset": { "version": "2.0" } });
    for (key, list) in [("scenes", scenes), ("nodes", nodes)] {
        if !list.is_empty() {
            json[key] = Value::Array(list);
        }
    }
    if let Some(scene) = file.json().get("scene") {
        json["scene"] = scene.clone();
    }
    json["extras"] = json!({ PROPERTY: extras });
    GltfFile::from_slice(json.to_string().as_bytes(), file.name(), None)
}

/// What a sidecar holds beside its asset; `None` for other files.
///
/// # Errors
/// [`Code::WrongType`] if the extras are not as they were written.
pub(crate) fn read(file: &GltfFile, asset: &VlmAsset) -> Result<Option<Donor>, Error> {
    let pointer = format!("/extras/{PROPERTY}");
    let Some(json) = file.json().pointer(&pointer) else { return Ok(None) };
    let Ok(Extras { nodes, meshes }) = Extras::deserialize(json) else {
        let issue = Issue::error(Code::WrongType, pointer, "the sidecar's list of nodes and tags is damaged");
        return Err(issue.in_file(file.name()));
    };
    Ok(Some(Donor { asset: asset.clone(), nodes, meshes }))
}

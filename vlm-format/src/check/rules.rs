//! Rules that tables cannot say: version, extensions, the node hierarchy, properties that depend on each other.

use serde_json::Value;

use super::{Report, array, index};
use crate::error::Code;

/// Extensions that a file may require: those that are read, and those that change neither geometry nor diffuse colour.
const READABLE: &[&str] = &[
    "KHR_mesh_quantization",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "KHR_texture_transform",
    "KHR_lights_punctual",
    "EXT_texture_webp",
    "EXT_mesh_gpu_instancing",
    "EXT_lights_image_based",
    "KHR_animation_pointer",
    "KHR_node_visibility",
    "KHR_xmp_json_ld",
    "KHR_xmp",
    "MSFT_lod",
    "VLM_virtual_light_mesh",
];

const DRACO: &str = "KHR_draco_mesh_compression";

/// Textures in KTX2; a file that requires it has no others.
const KTX2: &str = "KHR_texture_basisu";

/// The file must be an object and glTF 2.x.
pub(super) fn version(root: &Value, report: &mut Report) {
    if !root.is_object() {
        return report.error(Code::NotGltf, "", "the JSON is not an object");
    }
    let Some(asset) = root.get("asset") else {
        return report.error(Code::NotGltf, "", "the JSON has no `asset`, so it is not glTF 2.0");
    };
    // A minVersion above 2.0 says that a reader of 2.0 must not try.
    for key in ["version", "minVersion"] {
        let Some(version) = asset.get(key).and_then(Value::as_str) else { continue };
        let (known, message) = match key {
            "version" => (version.starts_with("2."), format!("the file is glTF `{version}`, not 2.0")),
            _ => (
                version == "2.0",
                format!("the file needs a reader of glTF `{version}`, and this one reads 2.0"),
            ),
        };
        if !known {
            report.error(Code::Version, format!("/asset/{key}"), message);
        }
    }
}

/// Extensions without which the file cannot be read as its author meant it.
pub(super) fn extensions(root: &Value, report: &mut Report) {
    for (i, required) in array(root, "/extensionsRequired").iter().enumerate() {
        let Some(name) = required.as_str() else { continue };
        let pointer = format!("/extensionsRequired/{i}");
        if name == DRACO {
            report.error(Code::Draco, pointer, "the geometry is compressed with Draco, which is not read");
        } else if name == KTX2 {
            report.error(
                Code::Ktx2,
                pointer,
                format!("the textures are KTX2 files (`{KTX2}`), which are not read"),
            );
        } else if !READABLE.contains(&name) && !name.starts_with("KHR_materials_") {
            report.error(
                Code::ExtensionUnknown,
                pointer,
                format!("the file requires the extension `{name}`, which is not read"),
            );
        }
    }
    if !report.has_errors()
        && let Some(pointer) = draco_without_fallback(root)
    {
        report.error(Code::Draco, pointer, "the geometry is compressed with Draco, which is not read");
    }
}

/// Pointer of the first primitive whose geometry exists in Draco's form only.
fn draco_without_fallback(root: &Value) -> Option<String> {
    let accessors = array(root, "/accessors");
    for (m, mesh) in array(root, "/meshes").iter().enumerate() {
        for (p, primitive) in array(mesh, "/primitives").iter().enumerate() {
            let position =
                primitive.pointer("/attributes").and_then(|attributes| index(attributes, "POSITION"));
            let plain = position
                .and_then(|i| accessors.get(i))
                .is_some_and(|accessor| accessor.get("bufferView").is_some());
            if !plain
                && primitive.pointer("/extensions").is_some_and(|extensions| extensions.get(DRACO).is_some())
            {
                return Some(format!("/meshes/{m}/primitives/{p}/extensions/{DRACO}"));
            }
        }
    }
    None
}

/// All rules of this file that rely on the right shape.
pub(super) fn structure(root: &Value, report: &mut Report) {
    hierarchy(root, report);
    cameras_and_lights(root, report);
    attributes(root, report);
    instances(root, report);
    images(root, report);
}

/// Every node has at most one parent and is no ancestor of itself. Iterative: chains may be a million nodes long.
fn hierarchy(root: &Value, report: &mut Report) {
    let nodes = array(root, "/nodes");
    let children = |node: usize| {
        let list = nodes.get(node).map_or(&[][..], |node| array(node, "/children"));
        list.iter().filter_map(Value::as_u64).map(|child| child as usize)
    };
    let mut parent: Vec<Option<usize>> = vec![None; nodes.len()];
    for node in 0..nodes.len() {
        for child in children(node) {
            match parent.get_mut(child) {
                Some(slot @ None) => *slot = Some(node),
                Some(Some(first)) => {
                    let message = format!("node {child} is a child of node {first} and of node {node}");
                    report.error(Code::NodeCycle, format!("/nodes/{node}/children"), message);
                }
                None => {}
            }
        }
    }

    // With one parent each, the nodes that no root reaches are exactly those on cycles and below them.
    let mut reached = vec![false; nodes.len()];
    let mut stack: Vec<usize> = (0..nodes.len()).filter(|&node| parent[node].is_none()).collect();
    while let Some(node) = stack.pop() {
        if !std::mem::replace(&mut reached[node], true) {
            stack.extend(children(node));
        }
    }
    if let Some(node) = reached.iter().position(|&reached| !reached) {
        report.error(
            Code::NodeCycle,
            format!("/nodes/{node}"),
            format!("node {node} is among its own descendants, or below such a node"),
        );
    }

    for (s, scene) in array(root, "/scenes").iter().enumerate() {
        for (i, node) in array(scene, "/nodes").iter().enumerate() {
            let node = node.as_u64().map_or(usize::MAX, |node| node as usize);
            if parent.get(node).is_some_and(Option::is_some) {
                let message = format!("node {node} is a root of the scene, but has a parent");
                report.warning(Code::NodeCycle, format!("/scenes/{s}/nodes/{i}"), message);
            }
        }
    }
}

/// A camera or spot light has the object that its type names.
fn cameras_and_lights(root: &Value, report: &mut Report) {
    for (pointer, kinds) in [
        ("/cameras", &["perspective", "orthographic"][..]),
        ("/extensions/KHR_lights_punctual/lights", &["spot"][..]),
    ] {
        for (i, item) in array(root, pointer).iter().enumerate() {
            let kind = item.get("type").and_then(Value::as_str).unwrap_or_default();
            if kinds.contains(&kind) && item.get(kind).is_none() {
                report.error(
                    Code::Missing,
                    format!("{pointer}/{i}"),
                    format!("`{kind}` is missing, which the type asks for"),
                );
            }
        }
    }
}

/// All attributes of a primitive describe the same number of vertices, and semantics have names that exist.
fn attributes(root: &Value, report: &mut Report) {
    let accessors = array(root, "/accessors");
    for (m, mesh) in array(root, "/meshes").iter().enumerate() {
        for (p, primitive) in array(mesh, "/primitives").iter().enumerate() {
            let pointer = format!("/meshes/{m}/primitives/{p}/attributes");
            let Some(attributes) = primitive.get("attributes") else { continue };
            same_counts(attributes, accessors, &pointer, report);
            for name in attributes.as_object().into_iter().flat_map(|map| map.keys()) {
                if !is_semantic(name) {
                    report.warning(
                        Code::WrongValue,
                        format!("{pointer}/{name}"),
                        format!("`{name}` is no attribute of glTF: ignored"),
                    );
                }
            }
        }
    }
}

/// Instances have one value of each attribute.
fn instances(root: &Value, report: &mut Report) {
    for (n, node) in array(root, "/nodes").iter().enumerate() {
        const ATTRIBUTES: &str = "/extensions/EXT_mesh_gpu_instancing/attributes";
        if let Some(attributes) = node.pointer(ATTRIBUTES) {
            same_counts(attributes, array(root, "/accessors"), &format!("/nodes/{n}{ATTRIBUTES}"), report);
        }
    }
}

fn same_counts(attributes: &Value, accessors: &[Value], pointer: &str, report: &mut Report) {
    let mut first: Option<(&str, u64)> = None;
    for name in attributes.as_object().into_iter().flat_map(|map| map.keys()) {
        let accessor = index(attributes, name).and_then(|i| accessors.get(i));
        let Some(count) = accessor.and_then(|accessor| super::count(accessor, "count")) else { continue };
        match first {
            None => first = Some((name, count)),
            Some((other, expected)) if expected != count => {
                let message = format!("{name} has {count} elements, {other} has {expected}");
                report.error(Code::AttributeCount, pointer, message);
            }
            Some(_) => {}
        }
    }
}

/// True for the names that glTF 2.0 defines and for application-specific ones, which begin with `_`.
pub(crate) fn is_semantic(name: &str) -> bool {
    let numbered = |prefix: &str| {
        name.strip_prefix(prefix).is_some_and(|set| set.parse::<u32>().is_ok() && !set.starts_with('+'))
    };
    matches!(name, "POSITION" | "NORMAL" | "TANGENT")
        || name.starts_with('_')
        || ["TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"].into_iter().any(numbered)
}

/// An image has data. Nothing may need it, so its absence is no error yet.
fn images(root: &Value, report: &mut Report) {
    for (i, image) in array(root, "/images").iter().enumerate() {
        if image.get("uri").is_none() && image.get("bufferView").is_none() {
            report.warning(
                Code::ImageMissing,
                format!("/images/{i}"),
                "the image has neither uri nor bufferView",
            );
        }
    }
}

//! The node tree: which nodes are drawn, where they stand in the world, and what they are called.

use glam::DMat4;
use vlm_format::GltfFile;

/// A node of the drawn scene.
#[derive(Clone)]
pub(super) struct PlacedNode<'a> {
    pub node: gltf::Node<'a>,
    pub world_from_node: DMat4,
    /// Position of the parent in the same list.
    parent: Option<usize>,
}

/// The nodes of the default scene, else of the first, else (a file without scenes) of the whole file; parents before
/// children, siblings in the file's order. What KHR_node_visibility hides is left out, with all below it. A node that
/// is reached twice counts once, so this always ends.
pub(super) fn drawn_nodes(file: &GltfFile) -> Vec<PlacedNode<'_>> {
    let (document, world_from_nodes) = (file.document(), file.world_from_nodes());
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let mut pending: Vec<_> = match scene {
        Some(scene) => scene.nodes().map(|node| (node, None)).collect(),
        None => root_nodes(document).into_iter().map(|node| (node, None)).collect(),
    };
    pending.reverse();

    let mut placed: Vec<PlacedNode> = Vec::new();
    let mut seen = vec![false; document.nodes().len()];
    while let Some((node, parent)) = pending.pop() {
        match seen.get_mut(node.index()) {
            Some(seen) if !*seen && is_visible(&node) => *seen = true,
            _ => continue,
        }
        let world_from_node = world_from_nodes.get(node.index()).copied().unwrap_or_default();
        let first_child = pending.len();
        pending.extend(node.children().map(|child| (child, Some(placed.len()))));
        pending[first_child..].reverse();
        placed.push(PlacedNode { node, world_from_node, parent });
    }
    placed
}

/// Names from the root down to `nodes[index]`, such as `Room/Table/Leg`; unnamed nodes read `node 7`.
pub(super) fn path(nodes: &[PlacedNode], index: usize) -> String {
    let parent = |&i: &usize| nodes.get(i).and_then(|placed| placed.parent);
    let mut names: Vec<_> = std::iter::successors(Some(index), parent)
        .filter_map(|i| nodes.get(i))
        .map(|placed| node_name(&placed.node))
        .collect();
    names.reverse();
    names.join("/")
}

/// The node's name, or `node 7`.
pub(super) fn node_name(node: &gltf::Node) -> String {
    node.name().map_or_else(|| format!("node {}", node.index()), str::to_owned)
}

fn is_visible(node: &gltf::Node) -> bool {
    let visible = node.extension_value("KHR_node_visibility").and_then(|extension| extension.get("visible"));
    visible != Some(&serde_json::Value::Bool(false))
}

fn root_nodes(document: &gltf::Document) -> Vec<gltf::Node<'_>> {
    let mut is_child = vec![false; document.nodes().len()];
    for child in document.nodes().flat_map(|node| node.children()) {
        if let Some(is_child) = is_child.get_mut(child.index()) {
            *is_child = true;
        }
    }
    document.nodes().filter(|node| !is_child.get(node.index()).copied().unwrap_or(true)).collect()
}

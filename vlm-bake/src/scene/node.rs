//! The node tree: which nodes are drawn, where they stand in the world, and what they are called.

use glam::{DMat4, DQuat, DVec3};
use gltf::scene::Transform;

/// A node of the drawn scene.
#[derive(Clone)]
pub(super) struct PlacedNode<'a> {
    pub node: gltf::Node<'a>,
    pub world_from_node: DMat4,
    /// Position of the parent in the same list.
    parent: Option<usize>,
}

/// The nodes of the default scene, else of the first, else (a file without scenes) of the whole file; parents before
/// children, siblings in the file's order. A node that is reached twice counts once, so this always ends.
pub(super) fn drawn_nodes(document: &gltf::Document) -> Vec<PlacedNode<'_>> {
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
            Some(seen) if !*seen => *seen = true,
            _ => continue,
        }
        let world_from_parent =
            parent.and_then(|p: usize| placed.get(p)).map_or(DMat4::IDENTITY, |p| p.world_from_node);
        let world_from_node = world_from_parent * parent_from_node(&node);
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

fn root_nodes(document: &gltf::Document) -> Vec<gltf::Node<'_>> {
    let mut is_child = vec![false; document.nodes().len()];
    for child in document.nodes().flat_map(|node| node.children()) {
        if let Some(is_child) = is_child.get_mut(child.index()) {
            *is_child = true;
        }
    }
    document.nodes().filter(|node| !is_child.get(node.index()).copied().unwrap_or(true)).collect()
}

fn parent_from_node(node: &gltf::Node) -> DMat4 {
    match node.transform() {
        Transform::Matrix { matrix } => glam::Mat4::from_cols_array_2d(&matrix).as_dmat4(),
        Transform::Decomposed { translation, rotation, scale } => DMat4::from_scale_rotation_translation(
            DVec3::from_array(scale.map(f64::from)),
            unit_quaternion(rotation),
            DVec3::from_array(translation.map(f64::from)),
        ),
    }
}

/// The rotation (x, y, z, w), of unit length in spite of the file's rounding; no rotation for 0.
pub(super) fn unit_quaternion(rotation: [f32; 4]) -> DQuat {
    let rotation = DQuat::from_array(rotation.map(f64::from));
    if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY }
}

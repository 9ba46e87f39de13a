//! Where nodes are: paths for messages, and global transforms in double precision.

use glam::{DMat4, DQuat, DVec3};
use serde_json::Value;

use crate::check::array;
use crate::container::GltfFile;

/// The parent of every node.
pub(crate) fn parents(file: &GltfFile) -> Vec<Option<usize>> {
    let nodes = array(file.json(), "/nodes");
    let mut parents = vec![None; nodes.len()];
    for (parent, node) in nodes.iter().enumerate() {
        for child in array(node, "/children").iter().filter_map(Value::as_u64) {
            if let Some(slot) = parents.get_mut(child as usize) {
                *slot = Some(parent);
            }
        }
    }
    parents
}

/// Names from the root down, such as `Room/Table/Leg`; unnamed nodes read `node 7`.
pub(crate) fn path(file: &GltfFile, parents: &[Option<usize>], node: usize) -> String {
    let nodes = array(file.json(), "/nodes");
    let mut names = Vec::new();
    let mut at = Some(node);
    while let Some(node) = at {
        let name = nodes.get(node).and_then(|json| json.get("name")?.as_str());
        names.push(name.map_or_else(|| format!("node {node}"), str::to_owned));
        at = parents.get(node).copied().flatten();
    }
    names.reverse();
    names.join("/")
}

/// `world_from_node` of every node. Iterative: chains may be a million nodes long.
pub(crate) fn world_from_nodes(file: &GltfFile, parents: &[Option<usize>]) -> Vec<DMat4> {
    let nodes = array(file.json(), "/nodes");
    let mut world: Vec<Option<DMat4>> = vec![None; nodes.len()];
    let mut chain = Vec::new();
    for start in 0..nodes.len() {
        let mut at = Some(start);
        while let Some(node) = at.filter(|&node| world[node].is_none()) {
            chain.push(node);
            at = parents[node];
        }
        while let Some(node) = chain.pop() {
            let world_from_parent = parents[node].and_then(|parent| world[parent]).unwrap_or(DMat4::IDENTITY);
            world[node] = Some(world_from_parent * parent_from_node(&nodes[node]));
        }
    }
    world.into_iter().map(Option::unwrap_or_default).collect()
}

/// The node's own transform, in the precision of the JSON.
fn parent_from_node(node: &Value) -> DMat4 {
    if let Some(matrix) = numbers::<16>(node, "matrix") {
        return DMat4::from_cols_array(&matrix);
    }
    let translation = numbers(node, "translation").map_or(DVec3::ZERO, DVec3::from_array);
    let rotation = numbers(node, "rotation").map_or(DQuat::IDENTITY, DQuat::from_array);
    let scale = numbers(node, "scale").map_or(DVec3::ONE, DVec3::from_array);
    DMat4::from_scale_rotation_translation(scale, rotation, translation)
}

/// A list of exactly `N` numbers.
pub(crate) fn numbers<const N: usize>(value: &Value, key: &str) -> Option<[f64; N]> {
    let list = value.get(key)?.as_array()?;
    let numbers: Vec<f64> = list.iter().map_while(Value::as_f64).collect();
    numbers.try_into().ok()
}

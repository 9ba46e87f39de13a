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

impl GltfFile {
    /// Names of a node and its ancestors from the root down, such as `Room/Table/Leg`; unnamed ones read `node 7`.
    #[must_use]
    pub fn node_path(&self, node: u32) -> String {
        path(self, &parents(self), node as usize)
    }

    /// The global transform of every node at rest, metres, in the precision of the JSON. Rotations count as unit quaternions in spite of the
    /// file's rounding.
    ///
    /// Iterative: chains may be a million nodes long.
    #[must_use]
    pub fn world_from_nodes(&self) -> Vec<DMat4> {
        let (nodes, parents) = (array(self.json(), "/nodes"), parents(self));
        let mut world: Vec<Option<DMat4>> = vec![None; nodes.len()];
        let mut chain = Vec::new();
        for start in 0..nodes.len() {
            let mut at = Some(start);
            while let Some(node) = at.filter(|&node| world[node].is_none()) {
                chain.push(node);
                at = parents[node];
            }
            while let Some(node) = chain.pop() {
                let world_from_parent =
                    parents[node].and_then(|parent| world[parent]).unwrap_or(DMat4::IDENTITY);
                world[node] = Some(world_from_parent * parent_from_node(&nodes[node]));
            }
        }
        world.into_iter().map(Option::unwrap_or_default).collect()
    }
}

/// The node's own transform.
fn parent_from_node(node: &Value) -> DMat4 {
    if let Some(matrix) = numbers::<16>(node, "matrix") {
        return affine(DMat4::from_cols_array(&matrix));
    }
    let translation = numbers(node, "translation").map_or(DVec3::ZERO, DVec3::from_array);
    let rotation = numbers(node, "rotation").map_or(DQuat::IDENTITY, DQuat::from_array);
    let scale = numbers(node, "scale").map_or(DVec3::ONE, DVec3::from_array);
    DMat4::from_scale_rotation_translation(scale, unit_quaternion(rotation), translation)
}

/// Without what would project: the last row of a node's matrix is 0, 0, 0, 1 (glTF 2.0 specification, section 3.5.3), and points are
/// placed by the rest, so its inverse has to be that of the rest, too.
fn affine(mut matrix: DMat4) -> DMat4 {
    for (column, w) in [
        (&mut matrix.x_axis, 0.0),
        (&mut matrix.y_axis, 0.0),
        (&mut matrix.z_axis, 0.0),
        (&mut matrix.w_axis, 1.0),
    ] {
        column.w = w;
    }
    matrix
}

/// The rotation, of unit length; no rotation for 0.
fn unit_quaternion(rotation: DQuat) -> DQuat {
    if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY }
}

/// A list of exactly `N` numbers.
pub(crate) fn numbers<const N: usize>(value: &Value, key: &str) -> Option<[f64; N]> {
    let list = value.get(key)?.as_array()?;
    let numbers: Vec<f64> = list.iter().map_while(Value::as_f64).collect();
    numbers.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transforms_follow_the_tree_with_unit_rotations() {
        // A quarter turn about z, by a quaternion that is a little too long: the child's +x is up.
        let json = r#"{"asset":{"version":"2.0"},"nodes":[
            {"translation":[0,2,0],"rotation":[0,0,0.709,0.709],"children":[1]},{"translation":[1,0,0]}]}"#;
        let file = GltfFile::from_slice(json.as_bytes(), "tree.gltf", None).unwrap();
        let world = file.world_from_nodes();
        assert!((world[1].w_axis.truncate() - DVec3::new(0.0, 3.0, 0.0)).length() < 1e-12, "{world:?}");
        let long = DMat4::from_quat(DQuat::from_xyzw(0.0, 0.0, 0.709, 0.709));
        assert!((long.transform_vector3(DVec3::X) - DVec3::Y).length() > 1e-3, "as the file has it");
    }

    /// Found by fuzzing: lights were placed by the inverse of a matrix that projects, and so elsewhere than their surface.
    #[test]
    fn matrices_that_project_count_without_that() {
        let json =
            r#"{"asset":{"version":"2.0"},"nodes":[{"matrix":[2,0,0,0.5, 0,1,0,-3, 0,0,1,7, 4,5,6,0.1]}]}"#;
        let file = GltfFile::from_slice(json.as_bytes(), "a.gltf", None).unwrap();
        let world_from_node = file.world_from_nodes()[0];
        let place = DVec3::new(1.0, 2.0, 3.0);
        let placed = world_from_node.transform_point3(place);
        assert_eq!(placed, DVec3::new(6.0, 7.0, 9.0));
        assert!((world_from_node.inverse().transform_point3(placed) - place).length() < 1e-12);
        let as_it_stands =
            DMat4::from_cols_array(&numbers::<16>(&file.json()["nodes"][0], "matrix").unwrap());
        assert!(
            (as_it_stands.inverse().transform_point3(placed) - place).length() > 0.1,
            "the negative control"
        );
    }
}

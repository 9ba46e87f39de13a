//! The file's cameras in world space.

use super::node::PlacedNode;
use super::{Camera, Projection};
use glam::{DMat4, DVec3};

/// The cameras of the drawn nodes, in their order.
pub(super) fn cameras(nodes: &[PlacedNode]) -> Vec<Camera> {
    nodes.iter().filter_map(camera).collect()
}

fn camera(placed: &PlacedNode) -> Option<Camera> {
    let camera = placed.node.camera()?;
    let projection = match camera.projection() {
        gltf::camera::Projection::Perspective(perspective) => Projection::Perspective(perspective.yfov()),
        gltf::camera::Projection::Orthographic(orthographic) => {
            Projection::Orthographic(orthographic.ymag().abs())
        }
    };
    let name = placed.node.name().or(camera.name());
    Some(Camera {
        name: name.map_or_else(|| format!("camera {}", camera.index()), str::to_owned),
        world_from_view: rigid(placed.world_from_node),
        projection,
    })
}

/// The transform's position, and its axes without scale, shear and mirroring: -z, then y, are kept.
fn rigid(world_from_node: DMat4) -> DMat4 {
    let backward = world_from_node.z_axis.truncate().try_normalize().unwrap_or(DVec3::Z);
    let up = world_from_node.y_axis.truncate().reject_from_normalized(backward);
    let up = up.try_normalize().unwrap_or_else(|| backward.any_orthonormal_vector());
    let position = world_from_node.w_axis.truncate();
    DMat4::from_cols(
        up.cross(backward).extend(0.0),
        up.extend(0.0),
        backward.extend(0.0),
        position.extend(1.0),
    )
}

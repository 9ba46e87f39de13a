//! KHR_lights_punctual in world space.

use super::node::PlacedNode;
use super::{PunctualKind, PunctualLight};
use glam::{DVec3, Vec3};
use gltf::khr_lights_punctual::Kind;

/// The most that a light shines, cd or lx; the sun's light is 1e5 lx. A light of this strength a micrometre away is still a number in single
/// precision.
const MOST_INTENSITY: f32 = 1e15;

/// The lights of the drawn nodes, in their order. Black ones are left out.
pub(super) fn punctual_lights(nodes: &[PlacedNode]) -> Vec<PunctualLight> {
    nodes.iter().filter_map(punctual_light).filter(|light| light.intensity != Vec3::ZERO).collect()
}

/// A light shines along its node's -z. The node's scale changes neither its intensity nor its range.
fn punctual_light(placed: &PlacedNode) -> Option<PunctualLight> {
    let light = placed.node.light()?;
    let kind = match light.kind() {
        Kind::Directional => PunctualKind::Directional,
        Kind::Point => PunctualKind::Point,
        Kind::Spot { inner_cone_angle, outer_cone_angle } => {
            PunctualKind::Spot { cos_inner: inner_cone_angle.cos(), cos_outer: outer_cone_angle.cos() }
        }
    };
    let position = placed.world_from_node.w_axis.truncate().as_vec3();
    if !position.is_finite() {
        return None;
    }
    let direction = placed.world_from_node.transform_vector3(DVec3::NEG_Z);
    Some(PunctualLight {
        kind,
        position,
        direction: direction.try_normalize().unwrap_or(DVec3::NEG_Z).as_vec3(),
        intensity: (Vec3::from_array(light.color()) * light.intensity())
            .clamp(Vec3::ZERO, Vec3::splat(MOST_INTENSITY)),
        range: light.range().filter(|&range| range > 0.0).unwrap_or(f32::INFINITY),
    })
}

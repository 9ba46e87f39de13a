//! Morph targets at their default weights, and skins in the pose that the file's nodes hold.

use super::geometry::{LocalMesh, normal_matrix};
use super::node::PlacedNode;
use glam::{DMat4, DQuat, DVec3, DVec4, UVec4, Vec3, Vec4};
use gltf::Semantic;
use vlm_format::{Error, GltfFile};

/// Adds the primitive's morph targets, weighed as the node, else its mesh, says.
///
/// # Errors
/// What the targets' accessors are refused for.
pub(super) fn morph(
    file: &GltfFile,
    node: &gltf::Node,
    primitive: &gltf::Primitive,
    local: &mut LocalMesh,
) -> Result<(), Error> {
    let mesh = node.mesh();
    let weights = node.weights().or(mesh.as_ref().and_then(gltf::Mesh::weights)).unwrap_or_default();
    for (target, &weight) in primitive.morph_targets().zip(weights).filter(|&(_, &weight)| weight != 0.0) {
        if let Some(accessor) = target.positions() {
            add(&mut local.positions, &file.read_vec3(accessor.index())?, weight);
        }
        if let (Some(accessor), Some(normals)) = (target.normals(), &mut local.normals) {
            add(normals, &file.read_vec3(accessor.index())?, weight);
        }
    }
    Ok(())
}

fn add(values: &mut [Vec3], offsets: &[Vec3], weight: f32) {
    for (value, &offset) in values.iter_mut().zip(offsets) {
        *value += offset * weight;
    }
}

/// Moves the primitive into world space by its node's skin and returns true; false if the node has none, or if one of
/// its joints is not drawn.
///
/// A vertex moves by the weighted mean of `world_from_joint * joint_from_bind`; the node's own transform plays no part.
///
/// # Errors
/// What the accessors of joints, weights and matrices are refused for.
pub(super) fn skin(
    file: &GltfFile,
    nodes: &[PlacedNode],
    node: &gltf::Node,
    primitive: &gltf::Primitive,
    local: &mut LocalMesh,
) -> Result<bool, Error> {
    let Some(skin) = node.skin() else { return Ok(false) };
    let Some(world_from_bind) = world_from_bind(file, nodes, &skin)? else { return Ok(false) };
    let matrices = vertex_matrices(file, primitive, &world_from_bind, local.positions.len())?;
    for (position, matrix) in local.positions.iter_mut().zip(&matrices) {
        *position = matrix.transform_point3(position.as_dvec3()).as_vec3();
    }
    for (normal, &matrix) in local.normals.iter_mut().flatten().zip(&matrices) {
        *normal = (normal_matrix(matrix) * normal.as_dvec3()).normalize_or_zero().as_vec3();
    }
    Ok(true)
}

/// One matrix per joint; `None` if a joint is not among the drawn nodes.
fn world_from_bind(
    file: &GltfFile,
    nodes: &[PlacedNode],
    skin: &gltf::Skin,
) -> Result<Option<Vec<DMat4>>, Error> {
    let joint_from_bind = match skin.inverse_bind_matrices() {
        Some(accessor) => file.read_mat4(accessor.index())?,
        None => Vec::new(),
    };
    let world_from_joint = |joint: gltf::Node| {
        let drawn = nodes.iter().find(|placed| placed.node.index() == joint.index())?;
        Some(drawn.world_from_node)
    };
    let matrix = |(i, joint)| {
        let joint_from_bind = joint_from_bind.get(i).map_or(DMat4::IDENTITY, glam::Mat4::as_dmat4);
        Some(world_from_joint(joint)? * joint_from_bind)
    };
    Ok(skin.joints().enumerate().map(matrix).collect())
}

/// The mean matrix of each vertex; that of the first joint where the weights sum to nothing.
fn vertex_matrices(
    file: &GltfFile,
    primitive: &gltf::Primitive,
    world_from_bind: &[DMat4],
    count: usize,
) -> Result<Vec<DMat4>, Error> {
    let mut sums = vec![(DMat4::ZERO, 0.0); count];
    for set in 0.. {
        let (Some(joints), Some(weights)) =
            (primitive.get(&Semantic::Joints(set)), primitive.get(&Semantic::Weights(set)))
        else {
            break;
        };
        let joints = file.read_vec4(joints.index())?;
        let weights = file.read_vec4(weights.index())?;
        for ((sum, joints), weights) in sums.iter_mut().zip(joints).zip(weights) {
            add_influences(sum, joints.as_uvec4(), weights, world_from_bind);
        }
    }
    let fallback = world_from_bind.first().copied().unwrap_or(DMat4::IDENTITY);
    Ok(sums
        .into_iter()
        .map(|(sum, weight)| if weight > 0.0 { sum * (1.0 / weight) } else { fallback })
        .collect())
}

fn add_influences(sum: &mut (DMat4, f64), joints: UVec4, weights: Vec4, world_from_bind: &[DMat4]) {
    for (joint, weight) in joints.to_array().into_iter().zip(weights.to_array()) {
        if let Some(&matrix) = world_from_bind.get(joint as usize).filter(|_| weight > 0.0) {
            sum.0 += matrix * f64::from(weight);
            sum.1 += f64::from(weight);
        }
    }
}

/// Where EXT_mesh_gpu_instancing repeats a node's mesh; once and unmoved without it.
///
/// # Errors
/// What the instances' accessors are refused for.
pub(super) fn instances(file: &GltfFile, node: &gltf::Node) -> Result<Vec<DMat4>, Error> {
    let pointer = format!("/nodes/{}/extensions/EXT_mesh_gpu_instancing/attributes", node.index());
    let Some(attributes) = file.json().pointer(&pointer) else { return Ok(vec![DMat4::IDENTITY]) };
    let accessor = |name: &str| {
        let index = attributes.get(name).and_then(serde_json::Value::as_u64);
        index.and_then(|index| usize::try_from(index).ok())
    };
    let translations = accessor("TRANSLATION").map(|a| file.read_vec3(a)).transpose()?;
    let rotations = accessor("ROTATION").map(|a| file.read_vec4(a)).transpose()?;
    let scales = accessor("SCALE").map(|a| file.read_vec3(a)).transpose()?;

    let lengths = [
        translations.as_ref().map(Vec::len),
        rotations.as_ref().map(Vec::len),
        scales.as_ref().map(Vec::len),
    ];
    let count = lengths.into_iter().flatten().max().unwrap_or(0);
    let vector = |values: &Option<Vec<Vec3>>, i: usize, default: DVec3| {
        values.as_ref().and_then(|values| values.get(i)).map_or(default, |v| v.as_dvec3())
    };
    let matrix = |i| {
        let rotation = rotations.as_ref().and_then(|rotations| rotations.get(i)).copied().unwrap_or(Vec4::W);
        DMat4::from_scale_rotation_translation(
            vector(&scales, i, DVec3::ONE),
            unit_quaternion(rotation.as_dvec4()),
            vector(&translations, i, DVec3::ZERO),
        )
    };
    Ok((0..count).map(matrix).collect())
}

/// The rotation (x, y, z, w), of unit length in spite of the file's rounding; no rotation for 0.
fn unit_quaternion(rotation: DVec4) -> DQuat {
    let rotation = DQuat::from_vec4(rotation);
    if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY }
}

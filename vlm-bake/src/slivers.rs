//! Gets rid of faces too thin to be lights.
//!
//! Above an aspect ratio of [`MAX_ASPECT`] single precision cannot hold a light's form factor. Cutting such a face does not help: the
//! tip of a needle stays a needle. So an obtuse sliver gives its longest edge to its neighbour (an edge flip), and whatever is
//! still too thin goes; the faces around it then stand for its surface, and the area ratio of `samples` keeps its flux.

use crate::decimate::{Face, LightMesh};
use crate::topology::{EdgeUse, aspect_ratio, cross_of, edge_uses, edges};

/// The greatest aspect ratio of a light (longest edge over height).
pub const MAX_ASPECT: f64 = vlm_format::MAX_ASPECT_RATIO;

/// Faces are thinned out at a lower ratio than a light may have, since the offset changes their shapes a little afterwards.
const TARGET_ASPECT: f64 = 0.7 * MAX_ASPECT;

/// An edge is flipped only if the normals of both new faces stay within this cosine of the old ones.
const FLIP_COSINE: f64 = 0.95;

/// Flips what can be flipped, drops what is still too thin.
pub fn remove_slivers(mesh: &mut LightMesh) {
    flip_caps(mesh);
    let keep: Vec<bool> =
        (0..mesh.faces.len()).map(|f| aspect_ratio(mesh.corners(f)) <= TARGET_ASPECT).collect();
    let mut kept = keep.iter();
    mesh.faces.retain(|_| kept.next().copied().unwrap_or(true));
}

/// Flips the longest edge of thin faces where that makes the worse of the two shapes better. Each face takes part in one flip
/// at most, so the pairs do not depend on each other.
fn flip_caps(mesh: &mut LightMesh) {
    let triangles: Vec<[u32; 3]> = mesh.faces.iter().map(|f| f.vertices).collect();
    let mut taken = vec![false; triangles.len()];
    for edge in edges(&edge_uses(&triangles)) {
        let [a, b] = edge else { continue };
        let pair = [a.triangle as usize, b.triangle as usize];
        let thin = pair.iter().any(|&f| aspect_ratio(mesh.corners(f)) > TARGET_ASPECT);
        if !thin || pair.iter().any(|&f| taken[f]) {
            continue;
        }
        if let Some(flipped) = flip(mesh, a, b) {
            for (f, face) in pair.into_iter().zip(flipped) {
                mesh.faces[f] = face;
                taken[f] = true;
            }
        }
    }
}

/// The two faces across an edge with the edge flipped, if they may be and that improves the worse shape.
fn flip(mesh: &LightMesh, a: &EdgeUse, b: &EdgeUse) -> Option<[Face; 2]> {
    let (face_a, face_b) = (mesh.faces[a.triangle as usize], mesh.faces[b.triangle as usize]);
    let corner = |face: &Face, side: u8, i: usize| face.vertices[(usize::from(side) + i) % 3];
    let (from, to, apex_a) =
        (corner(&face_a, a.side, 0), corner(&face_a, a.side, 1), corner(&face_a, a.side, 2));
    let apex_b = corner(&face_b, b.side, 2);
    let opposed = corner(&face_b, b.side, 0) == to;
    if !opposed || apex_a == apex_b || face_a.region != face_b.region || face_a.back != face_b.back {
        return None;
    }
    let flipped = [
        Face { vertices: [apex_a, from, apex_b], ..face_a },
        Face { vertices: [apex_b, to, apex_a], ..face_a },
    ];
    let corners = |face: &Face| face.vertices.map(|v| mesh.positions[v as usize]);
    let worst = |faces: &[Face; 2]| faces.iter().map(|f| aspect_ratio(corners(f))).fold(0.0, f64::max);
    let normal = |face: &Face| cross_of(corners(face)).normalize_or_zero();
    let whole = (cross_of(corners(&face_a)) + cross_of(corners(&face_b))).normalize_or_zero();
    let upright = flipped.iter().all(|face| normal(face).dot(whole) > FLIP_COSINE);
    (upright && worst(&flipped) < worst(&[face_a, face_b])).then_some(flipped)
}

//! Stage 4: moves each vertex inward, by the least displacement that hides its faces behind the surface they stand for.
//!
//! A face hides from a point `x` with normal `n` when all of it lies below the horizon of `x`. Pushed along its own normal `N`
//! by `d`, a corner's height above that horizon changes from `n . (v - x)` to `n . (v - x) - d n . N`, so the face needs
//! ```text
//! d >= (max_v n . (v - x) + clearance) / (n . N)      for each of its points x
//! ```
//! Its depth is the greatest of these. A vertex belongs to several faces; it moves by the shortest `delta` with
//! `N_f . delta <= -depth_f` for each: a quadratic program in three unknowns, solved by Hildreth's row action (1957).
//! At the corner of a room that is the mitre of its three walls; lights stay joined and cover the corner.

use glam::DVec3;
use rayon::prelude::*;

use crate::clearance::{rise, self_lighting};
use crate::decimate::LightMesh;
use crate::patches::Patches;
use crate::signed_distance::IslandDistance;
use crate::surface::{Standing, SurfacePoint};

/// Lights are moved this much farther than the clearance that `verify` asks for, so that rounding on the way does not fail it.
const MARGIN: f64 = 1.25;

/// A vertex moves by at most this many times the greatest depth of its faces. Higher values keep blades of faces that meet at acute
/// angles joined, and push their lights out of thin objects; lower values leave such edges to be mended one face at a time.
const MITRE_LIMIT: f64 = 4.0;

/// Rounds of moving and looking; each deepens the faces that still light their own surface.
const ROUNDS: usize = 6;

/// What `offset` did.
#[derive(Clone, Debug, Default)]
pub struct Offset {
    /// How far each vertex moved, metres.
    pub vertex_moved: Vec<f64>,
}

/// Moves the vertices of `mesh` inward. Faces of two-sided surfaces stay where they are: no place behind hides them, so they are
/// tagged later.
pub fn offset(
    mesh: &mut LightMesh,
    patches: &Patches,
    points: &[SurfacePoint],
    standing: &Standing,
    distance: &IslandDistance,
    clearance: f64,
) -> Offset {
    let target = MARGIN * clearance;
    let rest = mesh.positions.clone();
    let normals: Vec<DVec3> = (0..mesh.faces.len()).map(|f| mesh.normal(f)).collect();
    let incident = incident_faces(mesh, patches);
    let needed = |mesh: &LightMesh, f: usize| {
        needed_depth(
            &mesh.corners(f),
            normals[f],
            standing.of(f).iter().map(|&p| &points[p as usize]),
            target,
        )
    };
    let mut depth: Vec<f64> =
        (0..mesh.faces.len()).into_par_iter().map(|f| needed(mesh, f).max(target)).collect();
    for _ in 0..ROUNDS {
        displace(mesh, &rest, &normals, &depth, &incident);
        pull_inside(mesh, patches, &incident, distance, target);
        let failing: Vec<usize> = (0..mesh.faces.len())
            .into_par_iter()
            .filter(|&f| !patches.regions[mesh.faces[f].region as usize].two_sided)
            .filter(|&f| {
                let light = mesh.corners(f);
                let own = standing.of(f).iter().map(|&p| &points[p as usize]);
                own.into_iter().any(|p| self_lighting(&light, mesh.normal(f), p, clearance) > 0.0)
            })
            .collect();
        if failing.is_empty() {
            break;
        }
        for f in failing {
            depth[f] += needed(mesh, f).max(0.25 * target);
        }
    }
    let vertex_moved = mesh.positions.iter().zip(&rest).map(|(moved, at)| moved.distance(*at)).collect();
    Offset { vertex_moved }
}

/// How much deeper a face must sink to hide from its points, 0 if it need not. Points that look away from it by more than 80
/// degrees would need a boundless depth; `verify` judges them.
fn needed_depth<'a>(
    light: &[DVec3; 3],
    normal: DVec3,
    points: impl Iterator<Item = &'a SurfacePoint>,
    clearance: f64,
) -> f64 {
    const LEAST_COSINE: f64 = 0.17;
    points
        .filter(|p| p.normal.dot(normal) > LEAST_COSINE)
        .map(|p| (rise(light, p) + clearance) / p.normal.dot(normal))
        .fold(0.0, f64::max)
}

/// The faces that constrain each vertex: those of one-sided surfaces.
fn incident_faces(mesh: &LightMesh, patches: &Patches) -> Vec<Vec<u32>> {
    let mut incident = vec![Vec::new(); mesh.positions.len()];
    for (f, face) in mesh.faces.iter().enumerate() {
        if !patches.regions[face.region as usize].two_sided {
            for v in face.vertices {
                incident[v as usize].push(f as u32);
            }
        }
    }
    incident
}

/// Moves every vertex from its place of rest to satisfy the depths of its faces.
fn displace(mesh: &mut LightMesh, rest: &[DVec3], normals: &[DVec3], depth: &[f64], incident: &[Vec<u32>]) {
    mesh.positions.par_iter_mut().zip(rest).zip(incident).for_each(|((position, at), faces)| {
        *position =
            *at + shortest_displacement(faces.iter().map(|&f| (normals[f as usize], depth[f as usize])));
    });
}

/// The shortest `delta` with `n . delta <= -d` for each `(n, d)`, within the mitre limit.
fn shortest_displacement(constraints: impl Iterator<Item = (DVec3, f64)>) -> DVec3 {
    let constraints: Vec<(DVec3, f64)> = constraints.filter(|(n, _)| *n != DVec3::ZERO).collect();
    let mut multiplier = vec![0.0; constraints.len()];
    let mut delta = DVec3::ZERO;
    for _ in 0..100 {
        let mut worst: f64 = 0.0;
        for ((n, d), lambda) in constraints.iter().zip(&mut multiplier) {
            let excess = n.dot(delta) + d;
            let step = excess.max(-*lambda);
            *lambda += step;
            delta -= *n * step;
            worst = worst.max(excess / d.max(f64::MIN_POSITIVE));
        }
        if worst < 1e-3 {
            break;
        }
    }
    delta.clamp_length_max(MITRE_LIMIT * constraints.iter().map(|c| c.1).fold(0.0, f64::max))
}

/// Pulls back the vertices that came out on another side of their island.
fn pull_inside(
    mesh: &mut LightMesh,
    patches: &Patches,
    incident: &[Vec<u32>],
    distance: &IslandDistance,
    clearance: f64,
) {
    let faces = &mesh.faces;
    mesh.positions.par_iter_mut().zip(incident).for_each(|(position, incident)| {
        let Some(&face) = incident.first() else { return };
        let island = patches.regions[faces[face as usize].region as usize].island;
        if let Some(near) = distance.at(*position, island)
            && near.signed > -0.8 * clearance
        {
            *position -= near.normal * (near.signed + clearance);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn a_corner_of_three_walls_moves_by_its_mitre() {
        let walls = [(DVec3::X, 0.1), (DVec3::Y, 0.1), (DVec3::Z, 0.1)];
        let moved = shortest_displacement(walls.into_iter());
        assert!(moved.distance(DVec3::splat(-0.1)) < 1e-6, "{moved}");
    }

    #[test]
    fn a_face_needs_no_more_than_its_depth() {
        let moved = shortest_displacement([(DVec3::Z, 0.2), (DVec3::Z, 0.1)].into_iter());
        assert!(moved.distance(dvec3(0.0, 0.0, -0.2)) < 1e-9);
    }

    #[test]
    fn opposite_walls_stop_at_the_limit() {
        let moved = shortest_displacement(
            [(DVec3::Z, 0.1), (dvec3(0.1, 0.0, -1.0).normalize_or_zero(), 0.1)].into_iter(),
        );
        assert!(moved.length() <= 0.4 + 1e-9);
    }
}

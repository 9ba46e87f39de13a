//! Stage 5: moves each vertex inward, by the least displacement that hides its lights from the surface for which they stand.
//!
//! A light with corners `v` does not light a surface point `x` with normal `n` if all corners lie below the horizon of `x`:
//! ```text
//! n . (v - x) <= -clearance      for every corner v and every point x for which the light stands
//! ```
//! That is linear in the displacement `delta` of a vertex, and the same for all points of one triangle of the surface: the
//! vertex must lie below the planes of the triangles for which its lights stand. The least such displacement,
//! ```text
//! min |delta|^2   with   n_i . delta <= -(clearance + n_i . (v - x_i))   for each plane i,
//! ```
//! is a quadratic program in three unknowns, held by at most three of the planes; they come in one by one, the one that lies deepest below
//! the vertex first, and each lengthens the displacement (an LP-type problem: Sharir and Welzl 1992). On a convex surface the vertices of a
//! decimated mesh lie below all planes but their own, and move by the clearance; at the corner of a room that is the mitre of its
//! walls; in a hollow they move until no chord stands out. Vertices are shared, so lights stay joined.
//!
//! A point may also lie behind its light, in a recess that decimation bridged: no plane is needed for it. So planes are
//! added only where a light in its present place lights a point, and the programs are solved anew, until no light does.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::clearance::self_lighting;
use crate::correspondence::Light;
use crate::decimate::LightMesh;
use crate::ground::Ground;
use crate::progress::Progress;
use crate::standing::Standing;
use crate::surface::SurfacePoint;
use crate::topology::Lists;

/// Lights are moved this much farther than the clearance that `verify` asks for, so that rounding on the way does not fail it.
const MARGIN: f64 = 1.02;

/// Rounds of moving and looking, of which every other one looks anew which light stands for which point. Planes come in as lights
/// move, so a few are needed; what is not hidden by then is refined or tagged.
const ROUNDS: usize = 6;

/// A vertex moves by at most this share of its shortest edge. Higher values hide more lights behind rough surface instead of tagging
/// them; their mesh then shrinks and turns away from the surface, and covers less of it.
const EDGE_SHARE: f64 = 0.4;

/// A vertex counts as below a plane where it misses it by less than this share of the clearance; the margin makes up for it.
const TOLERANCE: f64 = 0.005;

/// What the offset looks at.
pub struct Surroundings<'a> {
    /// The visible surface.
    pub ground: &'a Ground<'a>,
    /// No vertex moves farther than this, metres; less where its edges are short.
    pub deepest: f64,
    /// Rounds end early where it is cancelled; what they leave is of no use then.
    pub progress: &'a dyn Progress,
}

/// One plane below which a vertex must lie.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Plane {
    /// Unit normal, out of the surface.
    normal: DVec3,
    /// How far the vertex, at rest, must sink along the normal; metres.
    depth: f64,
    /// The triangle of the patches that lies in it; `u32::MAX` for the plane of a face.
    triangle: u32,
}

/// What keeps each vertex from moving on.
struct Limits {
    /// Metres.
    deepest: Vec<f64>,
    /// The object that it must not leave.
    objects: Vec<u32>,
}

/// A mesh in place, and what holds its vertices there. It is kept while the mesh is refined, so that only what was cut is placed anew.
#[derive(Default)]
pub struct Offset {
    /// The mesh in place.
    pub mesh: LightMesh,
    emits: Vec<bool>,
    planes: Vec<Vec<Plane>>,
}

impl Offset {
    /// Moves the vertices of a mesh from their places of `rest`. `emits` is false for faces that make no lights. Faces of two-sided
    /// surfaces stay where they are: no place behind hides them, so they are tagged later. `standing` follows.
    pub fn place(
        &mut self,
        rest: &LightMesh,
        emits: &[bool],
        around: &Surroundings,
        standing: &mut Standing,
    ) {
        let mut dirty = self.take(rest, emits, around);
        let rest = &rest.positions;
        let limits =
            Limits { deepest: deepest(&self.mesh, rest, around), objects: objects_of(&self.mesh, around) };
        let mut lists = Lists::default();
        for round in 0..ROUNDS {
            if around.progress.is_cancelled() {
                break;
            }
            settle(&mut self.mesh, rest, &self.planes, &dirty, &limits, around);
            let lights = self.mesh.lights();
            if round % 2 == 0 {
                standing.update(around.ground, &lights, emits);
                lists = standing.lists();
            }
            let found = crossed_planes(&self.mesh, &lights, rest, &lists, standing.points, around);
            dirty.clear();
            for (vertex, plane) in found {
                let known = &mut self.planes[vertex as usize];
                if !known.iter().any(|k| k.triangle == plane.triangle) {
                    known.push(plane);
                    dirty.push(vertex);
                }
            }
            dirty.dedup();
            if dirty.is_empty() && round % 2 == 0 {
                break;
            }
        }
    }

    /// Takes a mesh over from rest. Vertices of faces that are new start there, below the planes of these faces; the others stay. Returns
    /// the former, ascending.
    fn take(&mut self, rest: &LightMesh, emits: &[bool], around: &Surroundings) -> Vec<u32> {
        let mut fresh = vec![false; rest.positions.len()];
        for (f, face) in rest.faces.iter().enumerate() {
            if self.mesh.faces.get(f) != Some(face) || self.emits.get(f) != emits.get(f) {
                face.vertices.into_iter().for_each(|v| fresh[v as usize] = true);
            }
        }
        self.mesh.faces.clone_from(&rest.faces);
        self.emits = emits.to_vec();
        self.planes.resize(rest.positions.len(), Vec::new());
        self.mesh.positions.extend_from_slice(&rest.positions[self.mesh.positions.len()..]);
        let fresh: Vec<u32> = (0..fresh.len() as u32).filter(|&v| fresh[v as usize]).collect();
        for &v in &fresh {
            self.planes[v as usize].clear();
        }
        self.add_face_planes(rest, &fresh, around);
        fresh
    }

    /// To begin with, vertices lie below the planes of their faces.
    fn add_face_planes(&mut self, rest: &LightMesh, vertices: &[u32], around: &Surroundings) {
        for (f, face) in rest.faces.iter().enumerate() {
            if !self.emits[f] || around.ground.patches.regions[face.region as usize].two_sided {
                continue;
            }
            let plane =
                Plane { normal: rest.normal(f), depth: MARGIN * around.ground.clearance, triangle: u32::MAX };
            for v in face.vertices.into_iter().filter(|v| vertices.binary_search(v).is_ok()) {
                self.planes[v as usize].push(plane);
            }
        }
    }
}

/// The planes above which corners of lights lie that light points of these planes, by vertex.
fn crossed_planes(
    mesh: &LightMesh,
    lights: &[Light],
    rest: &[DVec3],
    standing: &Lists,
    points: &[SurfacePoint],
    around: &Surroundings,
) -> Vec<(u32, Plane)> {
    let crossed = |l: usize| {
        let face = mesh.faces[l];
        let two_sided = around.ground.patches.regions[face.region as usize].two_sided;
        let own = if two_sided { &[] } else { standing.of(l) };
        let own = own.iter().map(|&p| &points[p as usize]);
        planes_of_light(&lights[l], face.vertices, own, rest, around)
    };
    let mut found: Vec<(u32, Plane)> = (0..lights.len()).into_par_iter().flat_map_iter(crossed).collect();
    found.par_sort_by_key(|(vertex, plane)| (*vertex, plane.triangle));
    found.dedup_by_key(|(vertex, plane)| (*vertex, plane.triangle));
    found
}

fn planes_of_light<'a>(
    light: &Light,
    vertices: [u32; 3],
    own: impl Iterator<Item = &'a SurfacePoint>,
    rest: &[DVec3],
    around: &Surroundings,
) -> Vec<(u32, Plane)> {
    let normal = light.normal();
    let target = MARGIN * around.ground.clearance;
    let mut found = Vec::new();
    for point in own {
        if self_lighting(&light.corners, normal, point.position, point.normal, around.ground.clearance) <= 0.0
        {
            continue;
        }
        for (corner, v) in light.corners.into_iter().zip(vertices) {
            if (corner - point.position).dot(point.normal) > -target {
                let depth = target + (rest[v as usize] - point.position).dot(point.normal);
                found.push((v, Plane { normal: point.normal, depth, triangle: point.triangle }));
            }
        }
    }
    found
}

/// How far each vertex may move, metres: a vertex that moves by much of its edges' lengths turns its lights away from their surface.
fn deepest(mesh: &LightMesh, rest: &[DVec3], around: &Surroundings) -> Vec<f64> {
    let mut shortest = vec![f64::INFINITY; rest.len()];
    for face in &mesh.faces {
        for i in 0..3 {
            let (a, b) = (face.vertices[i] as usize, face.vertices[(i + 1) % 3] as usize);
            let length = rest[a].distance(rest[b]);
            shortest[a] = shortest[a].min(length);
            shortest[b] = shortest[b].min(length);
        }
    }
    let limit = |edge: f64| around.deepest.min(EDGE_SHARE * edge).max(2.0 * around.ground.clearance);
    shortest.into_iter().map(limit).collect()
}

/// The object of each vertex.
fn objects_of(mesh: &LightMesh, around: &Surroundings) -> Vec<u32> {
    let mut objects = vec![0; mesh.positions.len()];
    for face in &mesh.faces {
        for v in face.vertices {
            objects[v as usize] = around.ground.objects[face.region as usize];
        }
    }
    objects
}

/// Moves some vertices from rest to where their planes want them.
fn settle(
    mesh: &mut LightMesh,
    rest: &[DVec3],
    planes: &[Vec<Plane>],
    dirty: &[u32],
    limits: &Limits,
    around: &Surroundings,
) {
    let place = |&v: &u32| {
        let (at, deepest) = (rest[v as usize], limits.deepest[v as usize]);
        let planes: Vec<Plane> = planes[v as usize].iter().filter(|p| p.depth <= deepest).copied().collect();
        let object = limits.objects[v as usize];
        (v, at + displacement(at, planes, deepest, object, around))
    };
    let moved: Vec<(u32, DVec3)> = dirty.par_iter().map(place).collect();
    for (v, p) in moved {
        mesh.positions[v as usize] = p;
    }
}

/// The least displacement below as many of the planes as the depth allowed and the object's thickness permit: where it would be too
/// long, or come out on another side, the plane that asks for most is given up.
fn displacement(
    at: DVec3,
    mut planes: Vec<Plane>,
    longest: f64,
    object: u32,
    around: &Surroundings,
) -> DVec3 {
    let tolerance = TOLERANCE * around.ground.clearance;
    let mut delta = DVec3::ZERO;
    let mut binding: Vec<Plane> = Vec::new();
    // Each step takes one plane in or gives one up.
    for _ in 0..4 * planes.len() + 4 {
        let above = |plane: &Plane| plane.normal.dot(delta) + plane.depth;
        let worst = (0..planes.len()).max_by(|&a, &b| above(&planes[a]).total_cmp(&above(&planes[b])));
        let mut candidates = binding.clone();
        match worst {
            Some(worst) if above(&planes[worst]) > tolerance => candidates.push(planes.swap_remove(worst)),
            _ if stays_inside(at, delta, object, around) => return delta,
            _ => give_up_deepest(&mut candidates),
        }
        let solution = loop {
            match below(&candidates, tolerance) {
                Some(solution) if solution.0.length() <= longest => break solution,
                _ => give_up_deepest(&mut candidates),
            }
        };
        let kept;
        (delta, kept) = solution;
        binding.clear();
        for (plane, kept) in candidates.into_iter().zip(kept) {
            if kept { binding.push(plane) } else { planes.push(plane) }
        }
    }
    DVec3::ZERO
}

fn give_up_deepest(planes: &mut Vec<Plane>) {
    let deepest = (0..planes.len()).max_by(|&a, &b| planes[a].depth.total_cmp(&planes[b].depth));
    if let Some(deepest) = deepest {
        planes.swap_remove(deepest);
    }
}

/// True if a vertex that moves so does not come out on another side, with room for the clearance.
fn stays_inside(at: DVec3, delta: DVec3, object: u32, around: &Surroundings) -> bool {
    let Some(direction) = delta.try_normalize() else { return true };
    let start = at + direction * around.ground.way_out.least_length();
    !around.ground.way_out.leads_out(
        start,
        at + delta + direction * (0.5 * around.ground.clearance),
        object,
        |_| false,
    )
}

/// The shortest `delta` with `normal . delta <= -depth` for each of at most four planes, and which of them hold it there; `None` if
/// there is none.
///
/// In three dimensions at most three planes do. So some subset's solution with equality, `delta = -sum_i lambda_i n_i`,
/// satisfies the conditions of Karush, Kuhn and Tucker: no `lambda` below 0, and no plane missed.
fn below(planes: &[Plane], tolerance: f64) -> Option<(DVec3, [bool; 4])> {
    (0..1u32 << planes.len()).filter(|subset| subset.count_ones() <= 3).find_map(|subset| {
        let kept = [0, 1, 2, 3].map(|i| subset >> i & 1 == 1);
        let of: Vec<&Plane> = planes.iter().zip(kept).filter(|(_, kept)| *kept).map(|(p, _)| p).collect();
        let delta = touching(&of)?;
        let missed = planes.iter().any(|p| p.normal.dot(delta) + p.depth > tolerance);
        (!missed).then_some((delta, kept))
    })
}

/// The shortest `delta` with `normal . delta = -depth` for each plane, if each of them pushes it inward.
fn touching(planes: &[&Plane]) -> Option<DVec3> {
    let inward = |pushes: &[f64]| pushes.iter().all(|&push| push >= 0.0 && push.is_finite());
    match *planes {
        [] => Some(DVec3::ZERO),
        [a] => inward(&[a.depth]).then(|| -a.normal * a.depth),
        [a, b] => {
            let cosine = a.normal.dot(b.normal);
            let squared_sine = 1.0 - cosine * cosine;
            let pushes = [a.depth - cosine * b.depth, b.depth - cosine * a.depth].map(|p| p / squared_sine);
            inward(&pushes).then(|| -a.normal * pushes[0] - b.normal * pushes[1])
        }
        [a, b, c] => {
            let normals = DMat3::from_cols(a.normal, b.normal, c.normal);
            let delta = normals.transpose().inverse() * -DVec3::new(a.depth, b.depth, c.depth);
            let pushes = normals.inverse() * -delta;
            (delta.is_finite() && inward(&pushes.to_array())).then_some(delta)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    fn planes(of: &[(DVec3, f64)]) -> Vec<Plane> {
        of.iter().map(|&(normal, depth)| Plane { normal, depth, triangle: 0 }).collect()
    }

    #[test]
    fn a_corner_of_three_walls_moves_by_its_mitre() {
        let walls = planes(&[(DVec3::X, 0.1), (DVec3::Y, 0.1), (DVec3::Z, 0.1)]);
        let (moved, kept) = below(&walls, 0.0).unwrap();
        assert!(moved.distance(DVec3::splat(-0.1)) < 1e-12, "{moved}");
        assert_eq!(kept, [true, true, true, false]);
    }

    #[test]
    fn a_face_needs_no_more_than_its_depth() {
        let (moved, kept) = below(&planes(&[(DVec3::Z, 0.2), (DVec3::Z, 0.1)]), 0.0).unwrap();
        assert!(moved.distance(dvec3(0.0, 0.0, -0.2)) < 1e-12);
        assert_eq!(kept, [true, false, false, false]);
    }

    #[test]
    fn a_plane_that_is_satisfied_moves_nothing() {
        let (moved, _) = below(&planes(&[(DVec3::Z, 0.2), (DVec3::X, -0.3)]), 0.0).unwrap();
        assert!(moved.distance(dvec3(0.0, 0.0, -0.2)) < 1e-12);
    }

    #[test]
    fn nothing_lies_below_opposite_planes() {
        assert!(below(&planes(&[(DVec3::Z, 0.2), (-DVec3::Z, 0.2)]), 1e-6).is_none());
    }
}

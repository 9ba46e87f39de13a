//! Stage 4: divides faces, and puts the new vertices onto the surface.
//!
//! A light has one radiosity, so a large one blurs the light and shadow that falls on its surface; and the farther the surface
//! bends away from a light, the deeper that must lie. So the longest edge is cut in half, together with every face on it,
//! until the budget is spent. Cutting at the longest edge never makes the least angle smaller than half of what it was
//! (Rosenberg and Stenger, "A lower bound on the angles of triangles constructed by bisecting the longest side", 1975). To cut one
//! face alone, its longest edge's neighbours are cut first where they have a longer one (Rivara, "Mesh refinement processes based on
//! the generalized bisection of simplices", 1984), so that no vertex ever lies inside another face's edge.
//!
//! New vertices move to the nearest place of the visible surface: a coarse face is a chord, its parts follow the arc.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec3;
use rustc_hash::FxHashMap;

use crate::decimate::{Face, LightMesh};
use crate::grouped_bvh::GroupedBvh;
use crate::patches::Patches;
use crate::slivers::MAX_ASPECT;
use crate::topology::{aspect_ratio, cross_of};

/// A new vertex moves onto the surface by at most this share of its edge. Higher values follow tighter bends, and catch more often
/// the far side of a thin part.
const SNAP_SHARE: f64 = 0.35;

/// Faces around a new vertex must keep to this cosine from what they were cut from, or it stays on the edge.
const SNAP_COSINE: f64 = 0.7;

/// The faces around a new vertex may be this slender at most: less than a light may, as offset changes shapes a little.
const SNAP_ASPECT: f64 = 0.5 * MAX_ASPECT;

/// Edges whose squared lengths differ by less than about this part of an octave count as equally long.
const TIES: f64 = 1e3;

/// An edge is walked to longer ones at most this often: ties and rounding must not make that endless.
const LONGEST_WALK: usize = 64;

/// The visible surface as new vertices look for it.
pub struct Snap<'a> {
    patches: &'a Patches,
    regions: GroupedBvh,
}

impl<'a> Snap<'a> {
    /// Prepares the search.
    #[must_use]
    pub fn new(patches: &'a Patches) -> Self {
        let region = |t: usize| patches.triangle_region[t];
        let regions = GroupedBvh::new(&patches.positions, &patches.triangles, region, patches.regions.len());
        Self { patches, regions }
    }

    /// The nearest place to `p` on a region's surface that looks like `normal` (unsigned where both sides reflect).
    fn nearest(&self, p: DVec3, region: u32, normal: DVec3, reach: f64) -> Option<DVec3> {
        let two_sided = self.patches.regions[region as usize].two_sided;
        let alike = |t: u32| {
            let cosine = cross_of(self.patches.corners(t as usize)).normalize_or_zero().dot(normal);
            (if two_sided { cosine.abs() } else { cosine }) > SNAP_COSINE
        };
        let near = self.regions.closest(region, p, reach, alike)?;
        Some(near.point.as_dvec3() + self.regions.origin())
    }
}

/// An edge that may be cut.
struct Candidate {
    priority: f64,
    edge: [u32; 2],
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.priority.total_cmp(&other.priority).then(other.edge.cmp(&self.edge))
    }
}
impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Candidate {}

/// Cuts the edges of a mesh.
pub struct Refiner<'a> {
    /// The mesh so far; faces only ever shrink, and new ones follow the old.
    pub mesh: LightMesh,
    /// Per face, the factor on the number of lights per area; 0 for a face that makes none.
    pub density: Vec<f64>,
    snap: &'a Snap<'a>,
    faces_of_edge: FxHashMap<[u32; 2], Vec<u32>>,
}

impl<'a> Refiner<'a> {
    /// Takes a mesh to be refined.
    #[must_use]
    pub fn new(mut mesh: LightMesh, density: Vec<f64>, snap: &'a Snap<'a>) -> Self {
        let mut faces_of_edge: FxHashMap<[u32; 2], Vec<u32>> = FxHashMap::default();
        for (f, face) in mesh.faces.iter_mut().enumerate() {
            face.coarse = f as u32;
            for edge in edges_of(face.vertices) {
                faces_of_edge.entry(edge).or_default().push(f as u32);
            }
        }
        Self { mesh, density, snap, faces_of_edge }
    }

    /// The number of faces that make lights.
    #[must_use]
    pub fn lights(&self) -> usize {
        self.density.iter().filter(|&&density| density > 0.0).count()
    }

    /// Cuts the longest edges of faces that make lights until there are `budget` of these.
    pub fn to_budget(&mut self, budget: usize) {
        let mut edges: Vec<[u32; 2]> = self.faces_of_edge.keys().copied().collect();
        edges.sort_unstable();
        let mut queue: BinaryHeap<Candidate> =
            edges.into_iter().filter_map(|edge| self.candidate(edge)).collect();
        let mut lights = self.lights();
        while lights < budget {
            let Some(Candidate { edge, .. }) = queue.pop() else { break };
            if !self.faces_of_edge.contains_key(&edge) {
                continue;
            }
            let first_new = self.mesh.faces.len();
            let middle = self.cut(edge);
            lights += (first_new..self.mesh.faces.len()).filter(|&f| self.density[f] > 0.0).count();
            let mut fresh = vec![ordered(edge[0], middle), ordered(middle, edge[1])];
            fresh.extend((first_new..self.mesh.faces.len()).flat_map(|f| {
                edges_of(self.mesh.faces[f].vertices).into_iter().filter(|e| e.contains(&middle))
            }));
            fresh.sort_unstable();
            fresh.dedup();
            queue.extend(fresh.into_iter().filter_map(|edge| self.candidate(edge)));
        }
    }

    /// Cuts a face at its longest edge, and before it whatever must be cut so that no vertex lies inside an edge.
    pub fn cut_face(&mut self, face: u32) {
        for _ in 0..LONGEST_WALK {
            let edge = self.longest_path_end(face);
            let last = edges_of(self.mesh.faces[face as usize].vertices).contains(&edge);
            self.cut(edge);
            if last {
                break;
            }
        }
    }

    fn candidate(&self, edge: [u32; 2]) -> Option<Candidate> {
        let faces = self.faces_of_edge.get(&edge)?;
        let density = faces.iter().map(|&f| self.density[f as usize]).fold(0.0, f64::max);
        let priority = self.squared_length(edge) * density;
        // Equal but for rounding is equal, so that a scene of another scale is cut alike.
        (density > 0.0).then(|| Candidate { priority: (priority.log2() * TIES).round(), edge })
    }

    fn squared_length(&self, [a, b]: [u32; 2]) -> f64 {
        self.mesh.positions[a as usize].distance_squared(self.mesh.positions[b as usize])
    }

    fn longest_edge(&self, face: u32) -> [u32; 2] {
        let edges = edges_of(self.mesh.faces[face as usize].vertices);
        let longer = |a: [u32; 2], b: [u32; 2]| {
            let order = self.squared_length(a).total_cmp(&self.squared_length(b));
            if order.then(b.cmp(&a)) == Ordering::Less { b } else { a }
        };
        longer(longer(edges[0], edges[1]), edges[2])
    }

    /// The edge at which the walk from a face over ever longer edges ends.
    fn longest_path_end(&self, face: u32) -> [u32; 2] {
        let mut edge = self.longest_edge(face);
        for _ in 0..LONGEST_WALK {
            let around = self.faces_of_edge.get(&edge).into_iter().flatten();
            let longer = around.map(|&f| self.longest_edge(f)).find(|&other| {
                self.squared_length(other).total_cmp(&self.squared_length(edge)).then(edge.cmp(&other))
                    == Ordering::Greater
            });
            match longer {
                Some(longer) => edge = longer,
                None => break,
            }
        }
        edge
    }

    /// Cuts an edge and all faces on it in half; returns the new vertex.
    fn cut(&mut self, edge: [u32; 2]) -> u32 {
        let faces = self.faces_of_edge.remove(&edge).unwrap_or_default();
        let middle = self.mesh.positions.len() as u32;
        self.mesh.positions.push(self.place(edge, &faces));
        for f in faces {
            self.halve(f, edge, middle);
        }
        middle
    }

    /// Where the new vertex of an edge goes.
    fn place(&self, [a, b]: [u32; 2], faces: &[u32]) -> DVec3 {
        let at = |v: u32| self.mesh.positions[v as usize];
        let middle = (at(a) + at(b)) / 2.0;
        let Some(&first) = faces.first() else { return middle };
        let normal = faces.iter().map(|&f| self.mesh.normal(f as usize)).sum::<DVec3>().normalize_or_zero();
        let reach = SNAP_SHARE * at(a).distance(at(b));
        let region = self.mesh.faces[first as usize].region;
        let Some(snapped) = self.snap.nearest(middle, region, normal, reach) else { return middle };
        let fits = |&f: &u32| {
            let old = self.mesh.normal(f as usize);
            halves(self.mesh.faces[f as usize].vertices, [a, b]).into_iter().all(|half| {
                let corners = half.map(|v| v.map_or(snapped, at));
                cross_of(corners).normalize_or_zero().dot(old) > SNAP_COSINE
                    && aspect_ratio(corners) < SNAP_ASPECT
            })
        };
        if faces.iter().all(fits) { snapped } else { middle }
    }

    /// Replaces a face by its halves.
    fn halve(&mut self, f: u32, edge: [u32; 2], middle: u32) {
        let face = self.mesh.faces[f as usize];
        let [first, second] = halves(face.vertices, edge).map(|half| half.map(|v| v.unwrap_or(middle)));
        let new = self.mesh.faces.len() as u32;
        self.mesh.faces[f as usize].vertices = first;
        self.mesh.faces.push(Face { vertices: second, ..face });
        self.density.push(self.density[f as usize]);
        for e in edges_of(first).into_iter().filter(|e| e.contains(&middle)) {
            self.faces_of_edge.entry(e).or_default().push(f);
        }
        for e in edges_of(second) {
            let users = self.faces_of_edge.entry(e).or_default();
            if !e.contains(&middle) {
                users.retain(|&user| user != f);
            }
            users.push(new);
        }
    }
}

/// The two halves of a face cut at an edge, turned as it is; `None` stands for the new vertex.
fn halves(vertices: [u32; 3], edge: [u32; 2]) -> [[Option<u32>; 3]; 2] {
    let side = (0..3).find(|&i| ordered(vertices[i], vertices[(i + 1) % 3]) == edge).unwrap_or(0);
    let [a, b, c] = [0, 1, 2].map(|i| Some(vertices[(side + i) % 3]));
    [[a, None, c], [None, b, c]]
}

fn ordered(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn edges_of([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [ordered(a, b), ordered(b, c), ordered(c, a)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patches::Region;
    use crate::surface::spread_over;
    use crate::topology::{edge_uses, edges};
    use glam::dvec3;

    /// A surface of these triangles, all of one region.
    fn surface(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Patches {
        Patches {
            triangle_region: vec![0; triangles.len()],
            regions: vec![Region { primitive: 0, island: 0, two_sided: false }],
            islands: 1,
            positions,
            triangles,
            ..Patches::default()
        }
    }

    fn mesh(positions: Vec<DVec3>, triangles: &[[u32; 3]]) -> LightMesh {
        let face = |&vertices: &[u32; 3]| Face { vertices, region: 0, back: false, coarse: 0 };
        LightMesh { positions, faces: triangles.iter().map(face).collect() }
    }

    /// A quarter of a cylinder of radius 1 in `n` steps, seen from outside.
    fn quarter_cylinder(n: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let at = |i: u32, y: f64| {
            let angle = std::f64::consts::FRAC_PI_2 * f64::from(i) / f64::from(n);
            dvec3(angle.sin(), y, angle.cos())
        };
        let positions = (0..=n).flat_map(|i| [at(i, 0.0), at(i, 1.0)]).collect();
        let quads = (0..n).flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]]);
        (positions, quads.collect())
    }

    fn is_conforming(mesh: &LightMesh) -> bool {
        let triangles: Vec<[u32; 3]> = mesh.faces.iter().map(|f| f.vertices).collect();
        let uses = edge_uses(&triangles);
        let boundary = edges(&uses).filter(|uses| uses.len() == 1);
        // On a cylinder's boundary, every edge lies on one of its four sides.
        let side = |p: DVec3| [p.x < 1e-9, p.z < 1e-9, p.y < 1e-9, p.y > 1.0 - 1e-9];
        boundary.into_iter().all(|uses| {
            let [a, b] = [uses[0].low, uses[0].high].map(|v| side(mesh.positions[v as usize]));
            (0..4).any(|i| a[i] && b[i])
        })
    }

    #[test]
    fn the_budget_is_met_and_flat_area_kept() {
        let corners = vec![dvec3(0.0, 0.0, 0.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 1.0, 0.0)];
        let patches = surface(corners.clone(), vec![[0, 1, 2]]);
        let snap = Snap::new(&patches);
        let mut refiner = Refiner::new(mesh(corners, &[[0, 1, 2]]), vec![1.0], &snap);
        refiner.to_budget(100);
        assert!((100..=101).contains(&refiner.lights()), "{}", refiner.lights());
        let faces = 0..refiner.mesh.faces.len();
        let area: f64 = faces.clone().map(|f| refiner.mesh.area(f)).sum();
        assert!((area - 1.0).abs() < 1e-12);
        let worst = faces.map(|f| aspect_ratio(refiner.mesh.corners(f))).fold(0.0, f64::max);
        assert!(worst < 6.0, "bisection keeps the shape, but made an aspect ratio of {worst}");
    }

    #[test]
    fn parts_of_a_chord_follow_the_arc() {
        let (positions, triangles) = quarter_cylinder(64);
        let patches = surface(positions, triangles);
        let (corners, coarse) = quarter_cylinder(2);
        let far = |mesh: &LightMesh| {
            let inside = (0..mesh.faces.len()).flat_map(|f| spread_over(mesh.corners(f), 20));
            inside.map(|p| 1.0 - dvec3(p.x, 0.0, p.z).length()).fold(0.0, f64::max)
        };
        let before = mesh(corners, &coarse);
        let chord = far(&before);
        let snap = Snap::new(&patches);
        let mut refiner = Refiner::new(before, vec![1.0; coarse.len()], &snap);
        refiner.to_budget(200);
        assert!(is_conforming(&refiner.mesh));
        assert!(far(&refiner.mesh) < 0.1 * chord, "{} against {chord}", far(&refiner.mesh));
    }

    #[test]
    fn one_face_is_cut_without_a_gap() {
        let (positions, triangles) = quarter_cylinder(5);
        let patches = surface(positions.clone(), triangles.clone());
        let snap = Snap::new(&patches);
        let mut refiner = Refiner::new(mesh(positions, &triangles), vec![1.0; triangles.len()], &snap);
        for face in [3, 3, 3, 0, 7, 3] {
            let before = refiner.mesh.area(face as usize);
            refiner.cut_face(face);
            assert!(refiner.mesh.area(face as usize) < 0.9 * before);
            assert!(is_conforming(&refiner.mesh));
        }
    }

    #[test]
    fn faces_without_light_are_cut_along_and_not_counted() {
        let (positions, triangles) = quarter_cylinder(3);
        let patches = surface(positions.clone(), triangles.clone());
        let snap = Snap::new(&patches);
        let mut density = vec![1.0; triangles.len()];
        density[2] = 0.0;
        let mut refiner = Refiner::new(mesh(positions, &triangles), density, &snap);
        refiner.to_budget(60);
        assert!(refiner.lights() >= 60 && refiner.mesh.faces.len() > refiner.lights());
        assert!(is_conforming(&refiner.mesh));
    }
}

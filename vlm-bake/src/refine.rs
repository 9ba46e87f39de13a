//! Stage 5: divides large and thin faces until the budget of lights is spent.
//!
//! A light has one radiosity, so a large one blurs the light and shadow that falls on its surface; and one whose aspect ratio
//! exceeds [`MAX_ASPECT`] has no accurate form factor in single precision. Both are cured by cutting the longest edge in
//! half, which never makes the least angle smaller than half of what it was (Rosenberg and Stenger, "A lower bound on the angles of
//! triangles constructed by bisecting the longest side", 1975). The parts lie in the plane of their face, so whatever
//! `verify` proved for the face holds for them.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};

use glam::DVec3;

use crate::decimate::LightMesh;
use crate::topology::{aspect_ratio, cross_of};

/// The greatest aspect ratio of a light (longest edge over height).
pub const MAX_ASPECT: f64 = 100.0;

/// A thin face that would need more cuts than this is dropped instead; its area is below a part in a thousand of a square on its
/// longest edge.
const MOST_CUTS: usize = 64;

/// The final lights, in world space.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// Vertices in metres.
    pub positions: Vec<DVec3>,
    /// The lights, in the order of their faces.
    pub lights: Vec<Light>,
}

/// One virtual light before it has a radiosity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Light {
    /// Indices into the positions, counter-clockwise seen from the emitting side.
    pub vertices: [u32; 3],
    /// The face that it is a part of.
    pub face: u32,
}

impl Lights {
    /// The corners of a light.
    #[must_use]
    pub fn corners(&self, light: usize) -> [DVec3; 3] {
        self.lights[light].vertices.map(|v| self.positions[v as usize])
    }

    /// Area of a light in square metres.
    #[must_use]
    pub fn area(&self, light: usize) -> f64 {
        0.5 * cross_of(self.corners(light)).length()
    }
}

/// What the search for the next cut knows of a light.
struct Candidate {
    priority: f64,
    light: u32,
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.priority.total_cmp(&other.priority).then(other.light.cmp(&self.light))
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

/// Cuts faces until there are `budget` lights. `density` is, per face, the factor on the number of lights per area; a face of density
/// 0 makes no lights.
#[must_use]
pub fn refine(mesh: &LightMesh, density: &[f64], budget: usize) -> Lights {
    let mut cutter =
        Cutter { positions: mesh.positions.clone(), lights: Vec::new(), midpoints: HashMap::new() };
    for (f, face) in mesh.faces.iter().enumerate() {
        if density[f] > 0.0 {
            cutter.add_shapely(Light { vertices: face.vertices, face: f as u32 });
        }
    }
    let mut queue: BinaryHeap<Candidate> =
        (0..cutter.lights.len() as u32).map(|light| cutter.candidate(light, density)).collect();
    while cutter.lights.len() < budget {
        let Some(next) = queue.pop() else { break };
        let added = cutter.cut(next.light);
        queue.push(cutter.candidate(next.light, density));
        queue.push(cutter.candidate(added, density));
    }
    cutter.lights.sort_by_key(|light| light.face);
    Lights { positions: cutter.positions, lights: cutter.lights }
}

struct Cutter {
    positions: Vec<DVec3>,
    lights: Vec<Light>,
    midpoints: HashMap<[u32; 2], u32>,
}

impl Cutter {
    fn corners(&self, light: &Light) -> [DVec3; 3] {
        light.vertices.map(|v| self.positions[v as usize])
    }

    /// Adds a light, in parts if its aspect ratio is too large, or not at all where it has next to no area.
    fn add_shapely(&mut self, light: Light) {
        let aspect = aspect_ratio(self.corners(&light));
        if aspect > MAX_ASPECT * MOST_CUTS as f64 {
            return;
        }
        let mut waiting = vec![light];
        while let Some(light) = waiting.pop() {
            if aspect_ratio(self.corners(&light)) > MAX_ASPECT {
                waiting.extend(self.halves(&light));
            } else {
                self.lights.push(light);
            }
        }
    }

    /// Longest edge squared, weighed by the density.
    fn candidate(&self, light: u32, density: &[f64]) -> Candidate {
        let corners = self.corners(&self.lights[light as usize]);
        let longest = (0..3).map(|i| corners[i].distance_squared(corners[(i + 1) % 3])).fold(0.0, f64::max);
        Candidate { priority: longest * density[self.lights[light as usize].face as usize], light }
    }

    /// Cuts a light in two; returns the number of the new one.
    fn cut(&mut self, light: u32) -> u32 {
        let [first, second] = self.halves(&self.lights[light as usize].clone());
        self.lights[light as usize] = first;
        self.lights.push(second);
        self.lights.len() as u32 - 1
    }

    fn halves(&mut self, light: &Light) -> [Light; 2] {
        let p = self.corners(light);
        let length = |i: usize| p[i].distance_squared(p[(i + 1) % 3]);
        let i = (0..3).fold(0, |best, i| if length(i) > length(best) { i } else { best });
        let [a, b, c] = [i, (i + 1) % 3, (i + 2) % 3].map(|i| light.vertices[i]);
        let middle = self.midpoint(a, b);
        [Light { vertices: [a, middle, c], ..*light }, Light { vertices: [middle, b, c], ..*light }]
    }

    fn midpoint(&mut self, a: u32, b: u32) -> u32 {
        let middle = (self.positions[a as usize] + self.positions[b as usize]) / 2.0;
        *self.midpoints.entry([a.min(b), a.max(b)]).or_insert_with(|| {
            self.positions.push(middle);
            self.positions.len() as u32 - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decimate::Face;
    use glam::dvec3;

    fn one_face(corners: [DVec3; 3]) -> LightMesh {
        LightMesh {
            positions: corners.to_vec(),
            faces: vec![Face { vertices: [0, 1, 2], region: 0, back: false }],
        }
    }

    #[test]
    fn the_budget_is_met_and_area_kept() {
        let mesh = one_face([dvec3(0.0, 0.0, 0.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 1.0, 0.0)]);
        let lights = refine(&mesh, &[1.0], 100);
        assert_eq!(lights.lights.len(), 100);
        let area: f64 = (0..100).map(|l| lights.area(l)).sum();
        assert!((area - 1.0).abs() < 1e-12);
        let worst = (0..100).map(|l| aspect_ratio(lights.corners(l))).fold(0.0, f64::max);
        assert!(worst < 6.0, "bisection keeps the shape, but made an aspect ratio of {worst}");
    }

    #[test]
    fn a_needle_is_cut_into_shapely_parts() {
        let mesh = one_face([dvec3(0.0, 0.0, 0.0), dvec3(10.0, 0.0, 0.0), dvec3(5.0, 0.02, 0.0)]);
        assert!(aspect_ratio(mesh.corners(0)) > MAX_ASPECT);
        let lights = refine(&mesh, &[1.0], 1);
        assert!(lights.lights.len() > 1);
        assert!((0..lights.lights.len()).all(|l| aspect_ratio(lights.corners(l)) <= MAX_ASPECT));
    }
}

//! Stage 5: divides large faces until the budget of lights is spent.
//!
//! A light has one radiosity, so a large one blurs the light and shadow that falls on its surface. It is cut in half across its
//! longest edge, which never makes the least angle smaller than half of what it was (Rosenberg and Stenger, "A lower bound on the angles of
//! triangles constructed by bisecting the longest side", 1975). The parts lie in the plane of their face, so whatever
//! `verify` proved for the face holds for them.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec3;

use crate::decimate::LightMesh;
use crate::topology::cross_of;

/// One virtual light before it has a radiosity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// World space, metres, counter-clockwise seen from the emitting side.
    pub corners: [DVec3; 3],
    /// The face that it is a part of.
    pub face: u32,
}

impl Light {
    /// Area in square metres.
    #[must_use]
    pub fn area(&self) -> f64 {
        0.5 * cross_of(self.corners).length()
    }

    /// Unit normal on the emitting side; zero without area.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        cross_of(self.corners).normalize_or_zero()
    }

    fn halves(&self) -> [Self; 2] {
        let p = self.corners;
        let length = |i: usize| p[i].distance_squared(p[(i + 1) % 3]);
        let i = (0..3).fold(0, |best, i| if length(i) > length(best) { i } else { best });
        let [a, b, c] = [p[i], p[(i + 1) % 3], p[(i + 2) % 3]];
        let middle = (a + b) / 2.0;
        [Self { corners: [a, middle, c], ..*self }, Self { corners: [middle, b, c], ..*self }]
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

/// Cuts faces until there are `budget` lights, in the order of their faces. `density` is, per face, the factor on the number of
/// lights per area; a face of density 0 makes no lights.
#[must_use]
pub fn refine(mesh: &LightMesh, density: &[f64], budget: usize) -> Vec<Light> {
    let whole = |f: usize| Light { corners: mesh.corners(f), face: f as u32 };
    let mut lights: Vec<Light> = (0..mesh.faces.len()).filter(|&f| density[f] > 0.0).map(whole).collect();
    let candidate = |lights: &[Light], light: u32| {
        let Light { corners, face } = &lights[light as usize];
        let longest = (0..3).map(|i| corners[i].distance_squared(corners[(i + 1) % 3])).fold(0.0, f64::max);
        Candidate { priority: longest * density[*face as usize], light }
    };
    let mut queue: BinaryHeap<Candidate> = (0..lights.len() as u32).map(|l| candidate(&lights, l)).collect();
    while lights.len() < budget {
        let Some(next) = queue.pop() else { break };
        let [first, second] = lights[next.light as usize].halves();
        lights[next.light as usize] = first;
        lights.push(second);
        queue.push(candidate(&lights, next.light));
        queue.push(candidate(&lights, lights.len() as u32 - 1));
    }
    lights.sort_by_key(|light| light.face);
    lights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decimate::Face;
    use crate::topology::aspect_ratio;
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
        assert_eq!(lights.len(), 100);
        let area: f64 = lights.iter().map(Light::area).sum();
        assert!((area - 1.0).abs() < 1e-12);
        let worst = lights.iter().map(|l| aspect_ratio(l.corners)).fold(0.0, f64::max);
        assert!(worst < 6.0, "bisection keeps the shape, but made an aspect ratio of {worst}");
    }
}

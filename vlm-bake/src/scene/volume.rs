//! Meshes that mark the space in which moving objects need light: nothing but their boxes counts.

use glam::{DVec3, Vec3};

/// The boxes around one node's mesh, one for each instance.
#[derive(Default)]
pub(super) struct Boxes(Vec<[Vec3; 2]>);

impl Boxes {
    /// Grows the box of an instance around the vertices (world space, metres) of one more primitive.
    pub fn add(&mut self, instance: usize, vertices: &[Vec3]) {
        if self.0.len() <= instance {
            self.0.resize(instance + 1, [Vec3::INFINITY, Vec3::NEG_INFINITY]);
        }
        if let Some([low, high]) = self.0.get_mut(instance) {
            *low = vertices.iter().fold(*low, |least, &p| least.min(p));
            *high = vertices.iter().fold(*high, |most, &p| most.max(p));
        }
    }

    /// Those that hold anything.
    pub fn finish(self) -> impl Iterator<Item = [DVec3; 2]> {
        let filled = self.0.into_iter().filter(|[low, _]| low.is_finite());
        filled.map(|corners| corners.map(Vec3::as_dvec3))
    }
}

//! Whether a straight way from one place to another leads out of the back of a surface, into the open on its other side.

use std::cell::{Cell, RefCell};

use glam::{DVec3, Vec3};

use crate::bvh::{Bvh, Hit};
use crate::patches::Patches;
use crate::scene::Scene;

/// What a triangle is to someone who walks through it.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// Rays and light pass.
    Air,
    /// In through the front, out through the back.
    OneSided,
    /// Both sides lie in the open.
    TwoSided,
}

/// All visible triangles of a scene.
pub struct WayOut {
    bvh: Bvh,
    kinds: Vec<Kind>,
    /// The object of each triangle.
    objects: Vec<u32>,
    /// The tree is relative to the middle of the scene, so that single precision keeps its digits far from the world's origin.
    origin: DVec3,
}

impl WayOut {
    /// Prepares the search. A surface is two-sided where its material says so or `patches` found it modelled twice.
    #[must_use]
    pub fn new(scene: &Scene, patches: &Patches) -> Self {
        let [low, high] = scene.bounds().unwrap_or_default();
        let origin = (low + high) / 2.0;
        let local: Vec<Vec3> = scene.positions.iter().map(|p| (p.as_dvec3() - origin).as_vec3()).collect();
        let kind = |t: usize| match scene.material_of(t) {
            Some(material) if !material.reflects => Kind::Air,
            Some(material) if material.two_sided => Kind::TwoSided,
            _ => Kind::OneSided,
        };
        let mut kinds: Vec<Kind> = (0..scene.triangles.len()).map(kind).collect();
        for (&source, &two_sided) in patches.triangle_source.iter().zip(&patches.triangle_two_sided) {
            if two_sided {
                kinds[source as usize] = Kind::TwoSided;
            }
        }
        let object = |&p: &u32| scene.primitives[p as usize].object;
        let objects = scene.triangle_primitive.iter().map(object).collect();
        Self { bvh: Bvh::new(&local, &scene.triangles), kinds, objects, origin }
    }

    /// Length below which ways are not judged: rounding hides on which side of a surface they start. Metres.
    #[must_use]
    pub fn least_length(&self) -> f64 {
        f64::from(self.bvh.leave_distance())
    }

    /// True if a surface point that looks along `normal` (unit) lies inside something solid: its ray, and two oblique ones, all
    /// meet a back first.
    #[must_use]
    pub fn is_buried(&self, point: DVec3, normal: DVec3) -> bool {
        let start = (point - self.origin).as_vec3();
        let start = self.bvh.leave(start, normal.as_vec3());
        let tangent = normal.any_orthonormal_vector();
        [normal, normal + tangent, normal - tangent].into_iter().all(|direction| {
            let opaque = |hit: &Hit| self.kinds[hit.triangle as usize] != Kind::Air;
            let first = self.bvh.hit_where(start, direction.as_vec3(), f32::INFINITY, opaque);
            first.is_some_and(|hit| !hit.front && self.kinds[hit.triangle as usize] == Kind::OneSided)
        })
    }

    /// The opaque triangles that a way crosses.
    #[must_use]
    pub fn crossed(&self, from: DVec3, to: DVec3, object: u32) -> Vec<u32> {
        let crossed = RefCell::new(Vec::new());
        let _ = self.bvh.occluded_where((from - self.origin).as_vec3(), (to - from).as_vec3(), 1.0, |hit| {
            if self.objects[hit.triangle as usize] == object && self.kinds[hit.triangle as usize] != Kind::Air {
                crossed.borrow_mut().push(hit.triangle);
            }
            false
        });
        crossed.into_inner()
    }

    /// True if the way from `from` to `to`, which starts inside an object or behind a sheet, ends in the open: it leaves
    /// through more backs than it enters fronts, or passes a two-sided surface. Scene triangles that `skip` names do not count.
    #[must_use]
    pub fn leads_out(&self, from: DVec3, to: DVec3, object: u32, skip: impl Fn(u32) -> bool) -> bool {
        let way = to - from;
        let start = (from - self.origin).as_vec3();
        let (balance, out) = (Cell::new(0i32), Cell::new(false));
        let _ = self.bvh.occluded_where(start, way.as_vec3(), 1.0, |hit| {
            if self.objects[hit.triangle as usize] == object && !skip(hit.triangle) {
                match self.kinds[hit.triangle as usize] {
                    Kind::Air => {}
                    Kind::OneSided => balance.set(balance.get() + if hit.front { -1 } else { 1 }),
                    Kind::TwoSided => out.set(true),
                }
            }
            out.get()
        });
        out.get() || balance.get() > 0
    }
}

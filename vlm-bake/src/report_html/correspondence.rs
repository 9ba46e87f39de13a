//! Which light stands for a visible point that the check did not sample, such as that of a pixel: by the check's own rule.

use glam::Vec3;
use rustc_hash::FxHashMap;

use super::lights::WorldLights;
use crate::correspondence::{Correspondence, Light};
use crate::ground::Ground;
use crate::patches::Patches;
use crate::scene::Scene;
use crate::shade::SurfacePoint;
use crate::surface::SurfacePoint as PatchPoint;
use crate::topology::{barycentric, cross_of};
use crate::verify::Verification;

/// What stands for a visible point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The surface neither reflects nor emits, or makes no lights by the artist's wish.
    MakesNone,
    /// No light stands for it.
    Uncovered,
    /// This light stands for it.
    Light(u32),
}

/// Answers [`Places::light_at`].
pub struct Places<'a> {
    patches: &'a Patches,
    lights: Correspondence<'a>,
    /// The triangle of the patches for each of the scene; duplicates share one.
    patch_of: Vec<Option<u32>>,
}

impl<'a> Places<'a> {
    /// Prepares the queries.
    pub fn new(
        scene: &Scene,
        ground: &Ground<'a>,
        verification: &Verification,
        lights: &WorldLights,
    ) -> Self {
        let standing = standing_lights(ground.patches, verification, lights);
        let all: Vec<Light> = standing.iter().map(|(light, _)| *light).collect();
        Self {
            patches: ground.patches,
            lights: Correspondence::new(ground, &all, |l| standing[l].1),
            patch_of: patch_of(scene, ground.patches),
        }
    }

    /// What stands for a visible point.
    pub fn light_at(&self, point: &SurfacePoint) -> Place {
        let Some(&Some(triangle)) = self.patch_of.get(point.triangle as usize) else {
            return Place::MakesNone;
        };
        let corners = self.patches.corners(triangle as usize);
        let Some(front) = cross_of(corners).try_normalize() else { return Place::MakesNone };
        let back = front.dot(point.geometric_normal.as_dvec3()) < 0.0;
        if back && !self.patches.region(triangle as usize).two_sided {
            return Place::MakesNone;
        }
        let position = point.position.as_dvec3();
        let point = PatchPoint {
            position,
            inner: position,
            normal: if back { -front } else { front },
            triangle,
            barycentric: barycentric(corners, position).as_vec3(),
            area: 0.0,
            back,
        };
        self.lights.light_of(&point).map_or(Place::Uncovered, Place::Light)
    }
}

/// The lights with the region and side of the first point for which each stands, and whether they stand for any: an artist's lights
/// stand for none but where their samples lie.
fn standing_lights(
    patches: &Patches,
    verification: &Verification,
    lights: &WorldLights,
) -> Vec<(Light, bool)> {
    let bare = |corners: &[_; 3]| (Light { corners: *corners, region: 0, back: false }, false);
    let mut standing: Vec<(Light, bool)> = lights.corners.iter().map(bare).collect();
    for (point, light) in verification.points.iter().zip(&verification.light_of_point) {
        let Some(light) = *light else { continue };
        let (known, emits) = &mut standing[light as usize];
        if !*emits && !lights.authored[light as usize] {
            (known.region, known.back) = (patches.triangle_region[point.triangle as usize], point.back);
            *emits = true;
        }
    }
    standing
}

/// The patches hold a triangle that the file has twice only once: found by its corners.
fn patch_of(scene: &Scene, patches: &Patches) -> Vec<Option<u32>> {
    let object = |t: usize| scene.primitives[scene.triangle_primitive[t] as usize].object;
    let key = |t: usize| {
        let bits = |v: u32| (scene.positions[v as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
        let mut corners = scene.triangles[t].map(bits);
        corners.sort_unstable();
        (object(t), corners)
    };
    let mut patch_of = vec![None; scene.triangles.len()];
    let mut by_corners = FxHashMap::default();
    for (patch, &source) in patches.triangle_source.iter().enumerate() {
        patch_of[source as usize] = Some(patch as u32);
        by_corners.insert(key(source as usize), patch as u32);
    }
    for (t, patch) in patch_of.iter_mut().enumerate() {
        let reflects = scene.material_of(t).is_some_and(|material| material.reflects);
        if patch.is_none() && reflects {
            *patch = by_corners.get(&key(t)).copied();
        }
    }
    patch_of
}

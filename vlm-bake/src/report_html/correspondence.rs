//! Which light stands for a visible point that the check did not sample, such as that of a pixel.
//!
//! The check assigns a light to each of its points. A pixel takes the nearest, among the lights that stand for points of its own
//! region and side, that looks its way; it is uncovered where the nearest sampled point of its region is.

use glam::{DVec3, Vec3};
use rustc_hash::{FxHashMap, FxHashSet};

use super::lights::WorldLights;
use super::stand_in::Verification;
use crate::grouped_bvh::GroupedBvh;
use crate::scene::Scene;
use crate::shade::SurfacePoint;
use crate::topology::cross_of;

/// A light looks a point's way if their normals meet at most at this cosine: 37 degrees, as in the check.
const LEAST_COSINE: f64 = 0.8;

/// What stands for a visible point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The surface neither reflects nor emits, or makes no lights by the artist's wish.
    MakesNone,
    /// Its light was lost.
    Uncovered,
    /// This light stands for it.
    Light(u32),
}

/// Answers [`Correspondence::light_at`].
pub struct Correspondence<'a> {
    verification: &'a Verification,
    lights: &'a WorldLights,
    /// The triangle of the patches for each of the scene; duplicates share one.
    patch_of: Vec<Option<u32>>,
    /// Lights by region: one element per light and region for which it stands.
    candidates: Vec<(u32, bool)>,
    lights_of_region: GroupedBvh,
    /// Numbers of the sampled points in regions that are not covered everywhere.
    doubtful: Vec<u32>,
    points_of_region: GroupedBvh,
}

impl<'a> Correspondence<'a> {
    /// Prepares the queries.
    pub fn new(scene: &Scene, verification: &'a Verification, lights: &'a WorldLights) -> Self {
        let patches = &verification.patches;
        let region = |p: usize| patches.triangle_region[verification.points[p].triangle as usize];
        let mut seen: FxHashSet<(u32, u32, bool)> = FxHashSet::default();
        let (mut candidates, mut regions, mut positions) = (Vec::new(), Vec::new(), Vec::new());
        let mut gaps = vec![false; patches.regions.len()];
        for (p, light) in verification.light_of_point.iter().enumerate() {
            let back = verification.points[p].back;
            match *light {
                None => gaps[region(p) as usize] = true,
                Some(light) if seen.insert((region(p), light, back)) => {
                    candidates.push((light, back));
                    regions.push(region(p));
                    positions.extend(lights.corners[light as usize]);
                }
                Some(_) => {}
            }
        }
        let triangles: Vec<[u32; 3]> =
            (0..candidates.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let lights_of_region = GroupedBvh::new(&positions, &triangles, |i| regions[i], patches.regions.len());
        let doubtful: Vec<u32> =
            (0..verification.points.len()).filter(|&p| gaps[region(p) as usize]).map(|p| p as u32).collect();
        let places: Vec<DVec3> = doubtful.iter().map(|&p| verification.points[p as usize].position).collect();
        let dots: Vec<[u32; 3]> = (0..places.len() as u32).map(|i| [i; 3]).collect();
        let points_of_region =
            GroupedBvh::new(&places, &dots, |i| region(doubtful[i] as usize), patches.regions.len());
        let patch_of = patch_of(scene, verification);
        Self { verification, lights, patch_of, candidates, lights_of_region, doubtful, points_of_region }
    }

    /// What stands for a visible point.
    pub fn light_at(&self, point: &SurfacePoint) -> Place {
        let patches = &self.verification.patches;
        let Some(&Some(triangle)) = self.patch_of.get(point.triangle as usize) else {
            return Place::MakesNone;
        };
        let region = patches.triangle_region[triangle as usize];
        let normal = point.geometric_normal.as_dvec3();
        let back = cross_of(patches.corners(triangle as usize)).dot(normal) < 0.0;
        if back && !patches.regions[region as usize].two_sided {
            return Place::MakesNone;
        }
        let position = point.position.as_dvec3();
        if self.is_gap(region, position, back) {
            return Place::Uncovered;
        }
        let alike = |i: u32| {
            let (light, side) = self.candidates[i as usize];
            side == back && self.lights.normals[light as usize].dot(normal) > LEAST_COSINE
        };
        let near = self.lights_of_region.closest(region, position, f64::INFINITY, alike);
        near.map_or(Place::Uncovered, |near| Place::Light(self.candidates[near.triangle as usize].0))
    }

    /// True if the nearest sampled point of the region and side has no light.
    fn is_gap(&self, region: u32, position: DVec3, back: bool) -> bool {
        let same_side = |i: u32| self.verification.points[self.doubtful[i as usize] as usize].back == back;
        let near = self.points_of_region.closest(region, position, f64::INFINITY, same_side);
        near.is_some_and(|near| {
            self.verification.light_of_point[self.doubtful[near.triangle as usize] as usize].is_none()
        })
    }
}

/// The patches hold a triangle that the file has twice only once: found by its corners.
fn patch_of(scene: &Scene, verification: &Verification) -> Vec<Option<u32>> {
    let patches = &verification.patches;
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

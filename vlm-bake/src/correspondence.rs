//! Which light stands for which point of the visible surface.
//!
//! Decimation keeps, for each face, the *region* that it came from (connected, of one primitive and one albedo), and so do the
//! lights. A point belongs to the light of its own region and side that looks its way and lies straight behind it, before it
//! where it bridges a recess, or else nearest. A light stands for no point farther away than its own longest edge. A point that finds
//! none is not covered: no light stands for it.

use glam::DVec3;
use rayon::prelude::*;

use crate::ground::Ground;
use crate::grouped_bvh::GroupedBvh;
use crate::patches::Patches;
use crate::surface::SurfacePoint;
use crate::topology::{Lists, area, cross_of, longest_edge};

/// A light stands only for points whose normal is at most this far (cosine) from its own. Lower values let a light stand
/// for the side walls of what was decimated away, which it can never clear; higher values leave more of the surface without
/// a light.
pub const LEAST_COSINE: f64 = 0.9;

/// The light straight behind a point counts where it is at most this many times as far away as the nearest. Higher values find
/// the far side of a hollow; lower values give the surface beside a sharp edge to the light across it.
const STRAIGHT_SHARE: f64 = 3.0;

/// A triangle that emits, and what it came from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// World space, metres, counter-clockwise seen from the emitting side.
    pub corners: [DVec3; 3],
    /// Index into [`Patches::regions`].
    pub region: u32,
    /// It stands for the back of a two-sided surface.
    pub back: bool,
}

impl Light {
    /// Area in square metres.
    #[must_use]
    pub fn area(&self) -> f64 {
        area(self.corners)
    }

    /// Length of the longest edge, metres.
    #[must_use]
    pub fn longest_edge(&self) -> f64 {
        longest_edge(self.corners)
    }

    /// Unit normal on the emitting side; zero without area.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        cross_of(self.corners).normalize_or_zero()
    }
}

/// Finds the light of a point.
pub struct Correspondence<'a> {
    patches: &'a Patches,
    sides: Vec<bool>,
    normals: Vec<DVec3>,
    /// Longest edges.
    sizes: Vec<f64>,
    regions: GroupedBvh,
    reach: f64,
}

impl<'a> Correspondence<'a> {
    /// Prepares the search among `lights`. Those for which `emits` is false stand for nothing.
    #[must_use]
    pub fn new(ground: &Ground<'a>, lights: &[Light], emits: impl Fn(usize) -> bool) -> Self {
        let patches = ground.patches;
        let positions: Vec<DVec3> = lights.iter().flat_map(|light| light.corners).collect();
        let triangles: Vec<[u32; 3]> =
            (0..lights.len() as u32).map(|l| [3 * l, 3 * l + 1, 3 * l + 2]).collect();
        let region = |l: usize| if emits(l) { lights[l].region } else { patches.regions.len() as u32 };
        Self {
            patches,
            sides: lights.iter().map(|light| light.back).collect(),
            normals: lights.iter().map(Light::normal).collect(),
            sizes: lights.iter().map(Light::longest_edge).collect(),
            regions: GroupedBvh::new(&positions, &triangles, region, patches.regions.len() + 1),
            reach: ground.reach,
        }
    }

    /// The light that stands for a point, if one does.
    #[must_use]
    pub fn light_of(&self, point: &SurfacePoint) -> Option<u32> {
        let own = self.patches.triangle_region[point.triangle as usize];
        let alike = |l: u32| {
            self.sides[l as usize] == point.back && self.normals[l as usize].dot(point.normal) > LEAST_COSINE
        };
        let near = self.regions.closest(own, point.inner, self.reach, alike)?;
        if f64::from(near.distance) > self.sizes[near.triangle as usize] {
            return None;
        }
        let far = STRAIGHT_SHARE * f64::from(near.distance);
        let along = |direction: DVec3| {
            self.regions.hit(own, point.inner, direction, far, alike).map(|(light, _)| light)
        };
        along(-point.normal).or_else(|| along(point.normal)).or(Some(near.triangle))
    }

    /// The nearest light of a point's region and side, whichever way it looks: for surface that no light stands for.
    #[must_use]
    pub fn nearest_in_region(&self, point: &SurfacePoint) -> Option<u32> {
        let own = self.patches.triangle_region[point.triangle as usize];
        let alike = |l: u32| self.sides[l as usize] == point.back;
        self.regions.closest(own, point.inner, self.reach, alike).map(|near| near.triangle)
    }

    /// The light of each point.
    #[must_use]
    pub fn of(&self, points: &[SurfacePoint]) -> Vec<Option<u32>> {
        points.par_iter().map(|point| self.light_of(point)).collect()
    }
}

/// The numbers of the points for which each of so many lights stands, ascending: [`Correspondence::of`] inverted.
#[must_use]
pub fn points_of_lights(light_of_point: &[Option<u32>], lights: usize) -> Lists {
    let pairs = light_of_point.iter().enumerate();
    Lists::new(lights, pairs.filter_map(|(point, light)| Some(((*light)?, point as u32))))
}

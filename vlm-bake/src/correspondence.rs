//! Which light stands for which point of the visible surface.
//!
//! Decimation keeps, for each face, the *region* that it came from (connected, of one primitive and one albedo), and so do the
//! lights. A point belongs to the nearest light of its own region and side that looks its way. Where decimation left none of the
//! region, the next of the same primitive and connected surface takes over. A point that finds neither within reach is not
//! covered: no light stands for it.

use glam::DVec3;
use rayon::prelude::*;

use crate::grouped_bvh::GroupedBvh;
use crate::patches::Patches;
use crate::surface::SurfacePoint;
use crate::topology::cross_of;

/// A light stands only for points whose normal is at most this far (cosine) from its own. Lower values let a light stand
/// for the side walls of what was decimated away, which it can never clear; higher values leave more of the surface without
/// a light.
const LEAST_COSINE: f64 = 0.8;

/// The search for the light of a vertex or edge starts this share of the way to the middle of the triangle. Higher values
/// leave the last bit of the surface to its neighbour; lower values find a neighbour's light across the edge.
const INNER_SHARE: f64 = 0.1;

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
        0.5 * cross_of(self.corners).length()
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
    primitives: Vec<u32>,
    regions: GroupedBvh,
    islands: GroupedBvh,
    reach: f64,
}

impl<'a> Correspondence<'a> {
    /// Prepares the search among `lights`, each standing for surface at most `reach` metres away. Those for which `emits` is
    /// false stand for nothing.
    #[must_use]
    pub fn new(patches: &'a Patches, lights: &[Light], reach: f64, emits: impl Fn(usize) -> bool) -> Self {
        let positions: Vec<DVec3> = lights.iter().flat_map(|light| light.corners).collect();
        let triangles: Vec<[u32; 3]> =
            (0..lights.len() as u32).map(|l| [3 * l, 3 * l + 1, 3 * l + 2]).collect();
        let region = |l: usize| if emits(l) { lights[l].region } else { patches.regions.len() as u32 };
        let island = |l: usize| patches.regions.get(region(l) as usize).map_or(patches.islands, |r| r.island);
        Self {
            patches,
            sides: lights.iter().map(|light| light.back).collect(),
            normals: lights.iter().map(Light::normal).collect(),
            primitives: lights.iter().map(|l| patches.regions[l.region as usize].primitive).collect(),
            regions: GroupedBvh::new(&positions, &triangles, region, patches.regions.len() + 1),
            islands: GroupedBvh::new(&positions, &triangles, island, patches.islands as usize + 1),
            reach,
        }
    }

    /// The light that stands for a point, if one does.
    #[must_use]
    pub fn light_of(&self, point: &SurfacePoint) -> Option<u32> {
        let own = self.patches.triangle_region[point.triangle as usize];
        let position = self.inner(point);
        let place = &self.patches.regions[own as usize];
        let alike = |l: u32| {
            self.sides[l as usize] == point.back && self.normals[l as usize].dot(point.normal) > LEAST_COSINE
        };
        let kin = |l: u32| self.primitives[l as usize] == place.primitive && alike(l);
        let along = |direction: DVec3| {
            self.regions.hit(own, position, direction, self.reach, alike).map(|(light, _)| light)
        };
        along(-point.normal)
            .or_else(|| along(point.normal))
            .or_else(|| {
                self.regions.closest(own, position, self.reach, alike).map(|near| near.triangle)
            })
            .or_else(|| {
                self.islands
                    .closest(place.island, position, self.reach, kin)
                    .map(|near| near.triangle)
            })
    }

    /// Where the search for a point starts: a little inside its triangle, since at a vertex or edge surfaces meet that
    /// have lights of their own.
    fn inner(&self, point: &SurfacePoint) -> DVec3 {
        let centre = self.patches.corners(point.triangle as usize).iter().sum::<DVec3>() / 3.0;
        if point.area > 0.0 { point.position } else { point.position.lerp(centre, INNER_SHARE) }
    }

    /// The light of each point.
    #[must_use]
    pub fn of(&self, points: &[SurfacePoint]) -> Vec<Option<u32>> {
        points.par_iter().map(|point| self.light_of(point)).collect()
    }
}

/// The numbers of the points for which each light stands, as offsets and a list.
#[derive(Clone, Debug, Default)]
pub struct Standing {
    starts: Vec<u32>,
    points: Vec<u32>,
}

impl Standing {
    /// Inverts [`Correspondence::of`] for that many lights.
    #[must_use]
    pub fn new(light_of_point: &[Option<u32>], lights: usize) -> Self {
        let mut starts = vec![0u32; lights + 1];
        for light in light_of_point.iter().flatten() {
            starts[*light as usize + 1] += 1;
        }
        for l in 0..lights {
            starts[l + 1] += starts[l];
        }
        let mut next = starts.clone();
        let mut points = vec![0; starts[lights] as usize];
        for (point, light) in light_of_point.iter().enumerate() {
            if let Some(light) = light {
                let slot = &mut next[*light as usize];
                points[*slot as usize] = point as u32;
                *slot += 1;
            }
        }
        Self { starts, points }
    }

    /// The points of a light, ascending.
    #[must_use]
    pub fn of(&self, light: usize) -> &[u32] {
        &self.points[self.starts[light] as usize..self.starts[light + 1] as usize]
    }
}

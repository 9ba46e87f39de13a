//! The visible surface, prepared for hiding lights behind it and for checking that they are hidden.

use rayon::prelude::*;

use crate::clearance::required_clearance;
use crate::patches::Patches;
use crate::scene::Scene;
use crate::signed_distance::IslandDistance;
use crate::surface::{SurfacePoint, centre_points, feature_points, spread_points};
use crate::topology::Lists;
use crate::way_out::WayOut;

/// A light stands for surface at most this share of the scene's extent away. Higher values cover more of what coarse
/// decimation left out, by lights farther from it.
const REACH_SHARE: f64 = 0.15;

/// The least number of area-uniform points of the check, unless the options of a bake ask for another.
pub const LEAST_POINTS: u32 = 200_000;

/// The inner place of a point on an edge is at most so many clearances inside its triangle. Higher values leave the last bit of a
/// surface to its neighbour; lower values find a light across the edge, whose vertices moved along it.
const INNER_CLEARANCES: f64 = 16.0;

/// Area-uniform points per light.
const POINTS_PER_LIGHT: usize = 20;

/// What offset and check look at.
pub struct Ground<'a> {
    /// The surface that reflects or emits.
    pub patches: &'a Patches,
    /// Sides of its islands.
    pub distance: IslandDistance<'a>,
    /// Ways out of objects, through all that is visible.
    pub way_out: WayOut,
    /// The triangles around each vertex of the patches.
    pub around: Lists,
    /// The object of each region.
    pub objects: Vec<u32>,
    /// Required distance of a light behind its surface, metres.
    pub clearance: f64,
    /// A light stands for surface at most this far away, metres.
    pub reach: f64,
}

impl<'a> Ground<'a> {
    /// Prepares a scene.
    #[must_use]
    pub fn new(scene: &Scene, patches: &'a Patches) -> Self {
        let bounds = scene.bounds().unwrap_or_default();
        Self {
            patches,
            distance: IslandDistance::new(patches),
            way_out: WayOut::new(scene, patches),
            around: triangles_around(patches),
            objects: patches.regions.iter().map(|r| scene.primitives[r.primitive as usize].object).collect(),
            clearance: required_clearance(bounds),
            reach: REACH_SHARE * (bounds[1] - bounds[0]).max_element(),
        }
    }

    /// The points by which a number of lights is placed and checked: area-uniform ones, then every vertex and edge midpoint. The
    /// areas of a triangle's points sum to its own.
    #[must_use]
    pub fn points(&self, lights: usize) -> Vec<SurfacePoint> {
        self.points_of(lights, LEAST_POINTS)
    }

    /// [`Ground::points`] with another number of area-uniform points at least.
    #[must_use]
    pub fn points_of(&self, lights: usize, least: u32) -> Vec<SurfacePoint> {
        let count = (lights * POINTS_PER_LIGHT).max(least as usize);
        let mut points = spread_points(self.patches, count);
        points.extend(feature_points(self.patches));
        share_area(self.patches, &mut points);
        let most = INNER_CLEARANCES * self.clearance;
        points.par_iter_mut().for_each(|point| point.move_inside(self.patches, most));
        points
    }
}

fn triangles_around(patches: &Patches) -> Lists {
    let corners = patches.triangles.iter().zip(0..);
    Lists::new(patches.positions.len(), corners.flat_map(|(&vertices, t)| vertices.map(|v| (v, t))))
}

/// Gives each triangle's area to its points in equal shares, and a triangle without any a point in its middle.
fn share_area(patches: &Patches, points: &mut Vec<SurfacePoint>) {
    let mut counts = vec![0u32; patches.triangles.len()];
    for point in points.iter().filter(|p| !p.back) {
        counts[point.triangle as usize] += 1;
    }
    let bare = (0..patches.triangles.len()).filter(|&t| counts[t] == 0);
    points.extend(bare.flat_map(|t| centre_points(patches, t)).collect::<Vec<_>>());
    for point in points {
        let t = point.triangle as usize;
        point.area = patches.area(t) / f64::from(counts[t].max(1));
    }
}

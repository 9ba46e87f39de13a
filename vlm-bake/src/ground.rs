//! The visible surface, prepared for hiding lights behind it and for checking that they are hidden.

use rayon::prelude::*;

use crate::clearance::required_clearance;
use crate::patches::Patches;
use crate::scene::Scene;
use crate::signed_distance::IslandDistance;
use crate::surface::{SurfacePoint, centre_points, feature_points, spread_points};
use crate::way_out::WayOut;

/// A light stands for surface at most this share of the scene's extent away. Higher values cover more of what coarse
/// decimation left out, by lights farther from it.
const REACH_SHARE: f64 = 0.15;

/// The least number of area-uniform points of the check.
const LEAST_POINTS: usize = 200_000;

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
    pub around: VertexTriangles,
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
            around: VertexTriangles::new(patches),
            clearance: required_clearance(bounds),
            reach: REACH_SHARE * (bounds[1] - bounds[0]).max_element(),
        }
    }

    /// The points by which a number of lights is placed and checked: area-uniform ones, then every vertex and edge midpoint. The
    /// areas of a triangle's points sum to its own.
    #[must_use]
    pub fn points(&self, lights: usize) -> Vec<SurfacePoint> {
        let count = (lights * POINTS_PER_LIGHT).max(LEAST_POINTS);
        let mut points = spread_points(self.patches, count);
        points.extend(feature_points(self.patches));
        share_area(self.patches, &mut points);
        let most = INNER_CLEARANCES * self.clearance;
        points.par_iter_mut().for_each(|point| point.move_inside(self.patches, most));
        points
    }
}

/// The triangles around each vertex, as offsets and a list.
pub struct VertexTriangles {
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl VertexTriangles {
    fn new(patches: &Patches) -> Self {
        let mut starts = vec![0u32; patches.positions.len() + 1];
        for &v in patches.triangles.as_flattened() {
            starts[v as usize + 1] += 1;
        }
        for v in 1..starts.len() {
            starts[v] += starts[v - 1];
        }
        let mut next = starts.clone();
        let mut triangles = vec![0; patches.triangles.len() * 3];
        for (t, corners) in patches.triangles.iter().enumerate() {
            for &v in corners {
                triangles[next[v as usize] as usize] = t as u32;
                next[v as usize] += 1;
            }
        }
        Self { starts, triangles }
    }

    /// Those around a vertex, ascending.
    #[must_use]
    pub fn of(&self, vertex: u32) -> &[u32] {
        let v = vertex as usize;
        &self.triangles[self.starts[v] as usize..self.starts[v + 1] as usize]
    }
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

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
            clearance: required_clearance(bounds),
            reach: REACH_SHARE * (bounds[1] - bounds[0]).max_element(),
        }
    }

    /// The points by which a number of lights is placed and checked: area-uniform ones, then every vertex and edge midpoint. The
    /// areas of a triangle's points sum to its own: its area-uniform points share it, or where it has none all others.
    #[must_use]
    pub fn points(&self, lights: usize) -> Vec<SurfacePoint> {
        let count = (lights * POINTS_PER_LIGHT).max(LEAST_POINTS);
        let mut points = spread_points(self.patches, count);
        let spread = points.len();
        points.extend(feature_points(self.patches));
        share_area(self.patches, &mut points, spread);
        self.seen(points)
    }

    /// Without the points that lie inside something solid: nobody sees them, and no light reaches them.
    fn seen(&self, points: Vec<SurfacePoint>) -> Vec<SurfacePoint> {
        points.into_par_iter().filter(|point| !self.way_out.is_buried(point.position, point.normal)).collect()
    }
}

/// Gives each triangle's area to its points: the first `spread` of them all, or where it has none of these, the others.
fn share_area(patches: &Patches, points: &mut Vec<SurfacePoint>, spread: usize) {
    let count = |points: &[SurfacePoint]| {
        let mut counts = vec![0u32; patches.triangles.len()];
        for point in points.iter().filter(|p| !p.back) {
            counts[point.triangle as usize] += 1;
        }
        counts
    };
    let (of_spread, of_features) = (count(&points[..spread]), count(&points[spread..]));
    let bare = (0..patches.triangles.len()).filter(|&t| of_spread[t] + of_features[t] == 0);
    points.extend(bare.flat_map(|t| centre_points(patches, t)).collect::<Vec<_>>());
    for (p, point) in points.iter_mut().enumerate() {
        let t = point.triangle as usize;
        let sharers = match (of_spread[t], of_features[t]) {
            (0, 0) => 1,
            (0, features) => features,
            (spread, _) => spread,
        };
        let shares = of_spread[t] == 0 || p < spread;
        point.area = if shares { patches.area(t) / f64::from(sharers) } else { 0.0 };
    }
}

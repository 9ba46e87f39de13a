//! What tags cost: the light that a tagged surface no longer receives from lights that are not its own.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use vlm_shaders::cpu::form_factor::{LightGeometry, form_factor};

use super::facts::Evidence;

/// Points over all tagged surface at which light is summed. More are slower, each by the number of lights.
const POINTS: usize = 512;

/// The least number of points of a tag.
const LEAST_POINTS: usize = 4;

/// By tag, the share of the irradiance that its tag keeps from a tagged surface, 0 to 1: light of lights with its tag that stand
/// for other regions, where every surface is lit alike.
pub fn tag_costs(evidence: &Evidence) -> BTreeMap<u32, f64> {
    let asset = evidence.asset;
    if asset.tags.iter().all(|&tag| tag == 0) {
        return BTreeMap::new();
    }
    let patches = &evidence.verification.patches;
    let mut points_of_tag: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (p, point) in evidence.verification.points.iter().enumerate() {
        let tag = evidence.tags.of(patches.triangle_source[point.triangle as usize]);
        if tag != 0 && point.area > 0.0 {
            points_of_tag.entry(tag).or_default().push(p);
        }
    }
    let each = (POINTS / points_of_tag.len().max(1)).max(LEAST_POINTS);
    let centre = evidence.scene.bounds().map_or(DVec3::ZERO, |[low, high]| 0.5 * (low + high));
    let geometry: Vec<LightGeometry> =
        evidence.lights.corners.iter().map(|c| LightGeometry::new(c.map(|p| p - centre))).collect();
    let cost = |(tag, points): (u32, Vec<usize>)| {
        let every = points.len().div_ceil(each);
        let [lost, all] = points
            .into_par_iter()
            .step_by(every)
            .map(|p| light_on(evidence, &geometry, centre, p, tag))
            .collect::<Vec<_>>()
            .into_iter()
            .fold([0.0, 0.0], |[lost, all], [l, a]| [lost + l, all + a]);
        (tag, if all > 0.0 { lost / all } else { 0.0 })
    };
    points_of_tag.into_iter().map(cost).collect()
}

/// Irradiance on a point under unit irradiance everywhere: what its tag takes away, and all but that of its own region.
fn light_on(
    evidence: &Evidence,
    geometry: &[LightGeometry],
    centre: DVec3,
    point: usize,
    tag: u32,
) -> [f64; 2] {
    let point = &evidence.verification.points[point];
    let own = Some(evidence.verification.patches.triangle_region[point.triangle as usize]);
    let (x, n): (Vec3, Vec3) = ((point.position - centre).as_vec3(), point.normal.as_vec3());
    let (mut lost, mut all) = (0.0, 0.0);
    for (l, light) in geometry.iter().enumerate() {
        if evidence.region_of_light[l] == own {
            continue;
        }
        let strength = evidence.asset.albedo[l].element_sum();
        let irradiance = f64::from(form_factor(light, x, n) * strength);
        all += irradiance;
        if evidence.asset.tags.get(l) == Some(&tag) {
            lost += irradiance;
        }
    }
    [lost, all]
}

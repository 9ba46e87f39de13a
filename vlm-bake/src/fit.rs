//! Places a light that fails by itself, where it hides.
//!
//! It sinks, shrinks, turns, and moves to another part of what it stands for. A light of half the size reaches half as high over its
//! points' horizons, and stands for surface half as far away: what it leaves is another light's or not covered, and a larger radiosity
//! keeps the flux. So a smaller light always has less to hide from; the largest that hides is taken.

use glam::{DQuat, DVec3, Vec3A};

use crate::bvh::nearest::closest_point;
use crate::clearance::rise;
use crate::correspondence::{LEAST_COSINE, Light};
use crate::surface::SurfacePoint;
use crate::verify::judge::{Evidence, hides};

/// The sizes to which a light may shrink, largest first. Smaller ones hide more lights instead of tagging them, and let their surface's
/// light come from too small a place, which is seen from near by.
const SIZES: [f64; 10] = [1.0, 0.85, 0.7, 0.5, 0.35, 0.25, 0.17, 0.12, 0.08, 0.05];

/// Down to this size a light stays over the middle of where it was; smaller ones may move to any part of what it stood for.
const STAYS: f64 = 0.5;

/// Places to which a smaller light may move, spread over its points.
const PLACES: usize = 6;

/// A light sinks by itself by at most this share of its longest edge, for the reason that vertices move by no more.
const SINK_SHARE: f64 = 0.4;

/// A light lies this many times the required clearance behind its surface, so that rounding does not fail it.
const MARGIN: f64 = 1.05;

/// The largest light that hides, sunk by at most `deepest` metres; `None` if none does. `own` are the points for which it stands.
#[must_use]
pub fn fitted(light: &Light, own: &[&SurfacePoint], evidence: &Evidence, deepest: f64) -> Option<Light> {
    let middle = light.corners.iter().sum::<DVec3>() / 3.0;
    let step = own.len().div_ceil(PLACES).max(1);
    SIZES.iter().find_map(|&size| {
        let places = own.iter().skip(step / 2).step_by(step).map(|p| p.position).filter(|_| size < STAYS);
        std::iter::once(middle).chain(places).find_map(|place| {
            let smaller = Light { corners: light.corners.map(|v| place + (v - middle) * size), ..*light };
            let straight = sunk(&smaller, own, evidence, deepest);
            straight.or_else(|| sunk(&turned(&smaller, place, own)?, own, evidence, deepest))
        })
    })
}

/// The light turned to the mean normal of the points near it.
fn turned(light: &Light, middle: DVec3, own: &[&SurfacePoint]) -> Option<Light> {
    let reach = light.longest_edge();
    let near = own.iter().filter(|p| p.position.distance(middle) < reach);
    let mean = near.map(|p| p.normal * (p.area + f64::MIN_POSITIVE)).sum::<DVec3>().try_normalize()?;
    let turn = DQuat::from_rotation_arc(light.normal().try_normalize()?, mean);
    Some(Light { corners: light.corners.map(|v| middle + turn * (v - middle)), ..*light })
}

/// The light as far along its normal as the points ask for that it would still stand for, if it hides there.
fn sunk(light: &Light, own: &[&SurfacePoint], evidence: &Evidence, deepest: f64) -> Option<Light> {
    let (normal, size) = (light.normal(), light.longest_edge());
    let target = MARGIN * evidence.ground.clearance;
    let mut standing: Vec<&SurfacePoint> = own.to_vec();
    let mut sunk = *light;
    let mut below_island = f64::NEG_INFINITY;
    // Deeper, it may reach fewer points, and need less depth: once is enough to leave the far ones out.
    for _ in 0..2 {
        standing.retain(|p| p.normal.dot(normal) > LEAST_COSINE && distance(&sunk, p) <= size);
        let needed =
            |p: &&SurfacePoint| (rise(&light.corners, p.position, p.normal) + target) / p.normal.dot(normal);
        let depth = standing.iter().map(needed).fold(below_island, f64::max);
        if depth.abs() > deepest.min(SINK_SHARE * size) {
            return None;
        }
        sunk.corners = light.corners.map(|v| v - normal * depth);
        below_island = depth + island_rise(&sunk, evidence) + target;
    }
    hides(&sunk, &standing, evidence).then_some(sunk)
}

/// How far the corners rise above the island of a light, metres; negative where all lie below.
fn island_rise(light: &Light, evidence: &Evidence) -> f64 {
    let island = evidence.ground.patches.regions[light.region as usize].island;
    let signed = |v: &DVec3| Some(evidence.ground.distance.at(*v, island)?.signed);
    light.corners.iter().filter_map(signed).fold(f64::NEG_INFINITY, f64::max)
}

fn distance(light: &Light, point: &SurfacePoint) -> f64 {
    let corners = light.corners.map(|v| (v - point.inner).as_vec3a());
    f64::from(closest_point(&corners, Vec3A::ZERO).length())
}

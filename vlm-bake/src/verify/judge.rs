//! What is wrong with a light, if anything.
//!
//! A light fails
//! - where it lights one of the surface points for which it stands ([`crate::correspondence`]), or comes nearer to that than
//!   the clearance ([`crate::clearance::self_lighting`]);
//! - where the straight way from one of these points through the solid to the nearest place of the light leads out into the
//!   open on another side ([`crate::way_out`]), or would with a little more depth;
//! - where a corner lies in front of its island, or the middle of an edge or its centre in front of another side of it
//!   ([`crate::signed_distance`]): a side that faces more than 60 degrees away from the light. In front of its own side it may lie between
//!   its corners: there it bridges a recess.

use glam::{DVec3, Vec3, Vec3A};
use rayon::prelude::*;

use crate::bvh::nearest::closest_point;
use crate::clearance::self_lighting;
use crate::correspondence::{LEAST_COSINE, Light};
use crate::ground::Ground;
use crate::patches::Region;
use crate::surface::SurfacePoint;
use crate::topology::{Lists, cross_of};

/// A light comes out of its island when it lies less than this share of the clearance behind it: a mitred vertex at a sharp edge
/// may be nearer to the edge than to either face.
const POKE_SHARE: f64 = 0.25;

/// The cosine below which a side of an island is another side than that for which a light stands.
const OTHER_SIDE_COSINE: f64 = 0.5;

/// The way from a point to its light is looked at where it goes inward by this cosine at least.
const STRAIGHT_COSINE: f64 = 0.3;

/// Why a light fails, and by how much.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Violation {
    /// The light.
    pub light: u32,
    /// Number of surface points that it lights.
    pub points: u32,
    /// By how much it would have to move, metres.
    pub depth: f64,
    /// Where it is worst, world space.
    pub place: DVec3,
    /// It comes out on another side of its object.
    pub pokes_out: bool,
    /// The triangles of the patches whose receivers must not be lit by the light, ascending.
    pub triangles: Vec<u32>,
}

/// All that the check looks at.
pub struct Evidence<'a> {
    /// The visible surface.
    pub ground: &'a Ground<'a>,
    /// Points on it.
    pub points: &'a [SurfacePoint],
    /// Which of them each light stands for.
    pub standing: &'a Lists,
}

impl<'a> Evidence<'a> {
    /// `None` for an authored light in a scene where nothing reflects.
    fn region(&self, light: &Light) -> Option<&Region> {
        self.ground.patches.regions.get(light.region as usize)
    }

    /// The surface points of a light.
    #[must_use]
    pub fn own_points(&self, light: usize) -> Vec<&'a SurfacePoint> {
        self.standing.of(light).iter().map(|&p| &self.points[p as usize]).collect()
    }
}

/// Every light that fails, ascending. Lights of two-sided surfaces fail where they light their own points.
#[must_use]
pub fn verify(lights: &[Light], evidence: &Evidence) -> Vec<Violation> {
    lights.par_iter().enumerate().filter_map(|(l, light)| judge(l, light, evidence)).collect()
}

/// What is wrong with a light, if anything.
#[must_use]
pub fn judge(number: usize, light: &Light, evidence: &Evidence) -> Option<Violation> {
    let own = evidence.own_points(number);
    let mut violation = Violation { light: number as u32, ..Violation::default() };
    lit_points(light, &own, evidence, &mut violation);
    lie_before(light, &own, &mut violation);
    if let Some(region) = evidence.region(light).filter(|region| !region.two_sided) {
        poke_between(light, &own, evidence, &mut violation);
        poke_beside(light, region.island, evidence, &mut violation);
    }
    violation.triangles.sort_unstable();
    violation.triangles.dedup();
    (violation.points > 0 || violation.pokes_out).then_some(violation)
}

/// Whether nothing would be wrong with a light of a one-sided surface if it stood for these points: [`judge`] without the reasons.
#[must_use]
pub fn hides(light: &Light, own: &[&SurfacePoint], evidence: &Evidence) -> bool {
    let (normal, ground) = (light.normal(), evidence.ground);
    let lit = |p: &&SurfacePoint| {
        self_lighting(&light.corners, normal, p.position, p.normal, ground.clearance) > 0.0
    };
    let mut violation = Violation::default();
    if own.iter().any(lit) {
        return false;
    }
    lie_before(light, own, &mut violation);
    if let Some(region) = evidence.region(light).filter(|_| !violation.pokes_out) {
        poke_beside(light, region.island, evidence, &mut violation);
    }
    !violation.pokes_out
        && !own.iter().any(|point| pokes_from(light, point, evidence, &mut Vec::new()).is_some())
}

impl Violation {
    /// Notes a fault of that depth at a place; the deepest stays.
    fn note(&mut self, depth: f64, place: DVec3) {
        if depth > self.depth {
            (self.depth, self.place) = (depth, place);
        }
    }
}

/// Looks for points of a light that it lights.
fn lit_points(light: &Light, own: &[&SurfacePoint], evidence: &Evidence, violation: &mut Violation) {
    let normal = light.normal();
    for point in own {
        let depth =
            self_lighting(&light.corners, normal, point.position, point.normal, evidence.ground.clearance);
        if depth > 0.0 {
            violation.points += 1;
            violation.triangles.push(point.triangle);
            violation.note(depth, point.position);
        }
    }
    lit_corners(light, evidence, &mut violation.triangles);
}

/// Adds the triangles that meet those at a corner at which the light lights them too: no point may lie just there.
fn lit_corners(light: &Light, evidence: &Evidence, triangles: &mut Vec<u32>) {
    let (ground, normal) = (evidence.ground, light.normal());
    let patches = ground.patches;
    let mut beside = Vec::new();
    for &t in triangles.iter() {
        for v in patches.triangles[t as usize] {
            let place = patches.positions[v as usize];
            beside.extend(ground.around.of(v as usize).iter().copied().filter(|&other| {
                let n = cross_of(patches.corners(other as usize)).normalize_or_zero();
                let side = if light.back { -n } else { n };
                patches.triangle_region[other as usize] == light.region
                    && side.dot(normal) > LEAST_COSINE
                    && self_lighting(&light.corners, normal, place, side, ground.clearance) > 0.0
            }));
        }
    }
    triangles.extend(beside);
}

/// A light may bridge recesses, but not lie before all that it stands for.
fn lie_before(light: &Light, own: &[&SurfacePoint], violation: &mut Violation) {
    let normal = light.normal();
    let height = |point: &SurfacePoint| (point.position - light.corners[0]).dot(normal);
    if !own.is_empty() && own.iter().all(|point| height(point) <= 0.0) {
        violation.pokes_out = true;
        violation.triangles.extend(own.iter().map(|point| point.triangle));
        for point in own {
            violation.note(-height(point), point.position);
        }
    }
}

/// Looks for surface between a light's points and the light.
fn poke_between(light: &Light, own: &[&SurfacePoint], evidence: &Evidence, violation: &mut Violation) {
    for point in own {
        if let Some(length) = pokes_from(light, point, evidence, &mut violation.triangles) {
            violation.pokes_out = true;
            violation.note(length, point.position);
        }
    }
}

/// The length of the way from a point to the nearest place of its light, metres, if it leads out; then adds the triangles that must
/// not be lit.
fn pokes_from(
    light: &Light,
    point: &SurfacePoint,
    evidence: &Evidence,
    triangles: &mut Vec<u32>,
) -> Option<f64> {
    let from = point.inner;
    let corners = light.corners.map(|v| (v - from).as_vec3a());
    let way = Vec3::from(closest_point(&corners, Vec3A::ZERO)).as_dvec3();
    // A point behind its light lies in a recess that the light bridges; one beside it says nothing of what is behind itself.
    let behind = way.dot(-point.normal) > STRAIGHT_COSINE * way.length();
    (behind && leads_out(point, from, from + way, evidence, triangles)).then(|| way.length())
}

/// True if the way from a surface point to a place behind it leads out on another side; then the triangles on the way, and that
/// of the point, must not be lit.
fn leads_out(
    point: &SurfacePoint,
    from: DVec3,
    place: DVec3,
    evidence: &Evidence,
    triangles: &mut Vec<u32>,
) -> bool {
    let ground = evidence.ground;
    let start = from - point.normal * ground.way_out.least_length();
    let Some(direction) = (place - start).try_normalize() else { return false };
    let end = place + direction * (POKE_SHARE * ground.clearance);
    let object = ground.objects[ground.patches.triangle_region[point.triangle as usize] as usize];
    let own = ground.patches.triangle_source[point.triangle as usize];
    let out = ground.way_out.leads_out(start, end, object, |triangle| triangle == own);
    if out {
        triangles.push(point.triangle);
        let crossed = ground.way_out.crossed(start, end, object);
        // Sources of patches ascend.
        triangles.extend(
            crossed
                .iter()
                .filter_map(|t| ground.patches.triangle_source.binary_search(t).ok().map(|t| t as u32)),
        );
    }
    out
}

/// Looks for places of a light that lie in front of its island, or into the open behind it.
fn poke_beside(light: &Light, island: u32, evidence: &Evidence, violation: &mut Violation) {
    let [a, b, c] = light.corners;
    let (normal, room) = (light.normal(), POKE_SHARE * evidence.ground.clearance);
    let distance = &evidence.ground.distance;
    for (i, place) in
        [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0].into_iter().enumerate()
    {
        let Some(near) = distance.at(place, island) else { continue };
        let bridges = i >= 3 && near.normal.dot(normal) >= OTHER_SIDE_COSINE;
        let out = near.signed + room;
        if out > 0.0 && !bridges {
            violation.pokes_out = true;
            violation.triangles.push(near.triangle);
            violation.note(out, place);
        }
        // The nearest surface may be the far side of a fold: what looks the light's way tells whether that lies between.
        let Some(from) = distance.alike(place, island, normal, OTHER_SIDE_COSINE) else { continue };
        if (place - from.position).dot(from.normal) < 0.0
            && leads_out(&from, from.inner, place, evidence, &mut violation.triangles)
        {
            violation.pokes_out = true;
            violation.note(place.distance(from.position), place);
        }
    }
}

//! Checks a bake from its asset and the visible triangles alone, by brute force; calls nothing of the code that it checks.
//!
//! Points are spread over every triangle. The light of a point is, of those that look its way (within 26 degrees) and whose samples lie on
//! the same connected part and primitive, the one straight behind it or else the nearest. A triangle that bears a light's tag never sees it.
//! - A light *lights itself* where it comes nearer than the clearance to lighting a sample that it carries, or a point of which it is the
//!   light. It *lights its triangle* where it lights any other point of a triangle on which its samples lie.
//! - An untagged light *lies in front* where its place nearest to one of its samples is above that sample's horizon.
//! - An untagged light *comes out* where a straight walk to it from just behind the surface leaves through the back of a triangle of
//!   another side (more than 60 degrees off the light's normal) or meets a two-sided one. The walk goes from each point to the nearest
//!   place of its light, and to the light's own corners and middles from the surface nearest to them. In a scene of closed surfaces it
//!   must also end in free space: bodies may overlap.

use glam::{DMat3, DVec3};
use vlm_bake::scene::Scene;
use vlm_format::VlmAsset;

use super::Triangle;
use crate::random::plastic_point;

mod geometry;
mod surface;

use geometry::{Segment, aspect, closest_on, cross, unit_normal};
pub use surface::{Surface, tag_of_triangle};

/// Cosine between a point's normal and the light that may stand for it.
const ALIKE: f64 = 0.9;

/// Cosine between a light's normal and a triangle's, below which that is another side.
const OTHER_SIDE: f64 = 0.5;

/// Longest edge over height; f32 rounding may exceed the 100 that are allowed.
const MAX_ASPECT: f64 = 100.1;

/// Points over the whole surface, on top of [`LEAST_POINTS`].
const POINTS: f64 = 4000.0;

/// Points per triangle at least.
const LEAST_POINTS: u32 = 3;

/// The flux under uniform light may differ by this share.
pub const FLUX_TOLERANCE: f64 = 0.02;

/// What can be wrong with a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The asset has no light.
    NoLights,
    /// A sample does not lie on the surface of its object.
    SampleOffSurface,
    /// It lights surface that it stands for, or nearly.
    LightsItself,
    /// It lights surface that another light stands for, on a triangle on which its own samples lie.
    LightsItsTriangle,
    /// It lies before its own samples.
    LiesInFront,
    /// It comes out on another side.
    ComesOut,
    /// It is longer than 100 times its height.
    TooThin,
    /// Under uniform light, the lights together reflect more or less than the surface.
    Flux,
}

/// One fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// What is wrong.
    pub kind: Kind,
    /// The light, 0 where the fault is no single light's.
    pub light: u32,
    /// Where, world space, metres.
    pub place: DVec3,
    /// By how much it would have to move, metres; or the ratio for [`Kind::TooThin`] and [`Kind::Flux`].
    pub by: f64,
}

/// What the check found.
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    /// At most one for each light and kind, the worst.
    pub faults: Vec<Fault>,
    /// Number of lights.
    pub lights: usize,
    /// Share of the lights' area that carries a tag.
    pub tagged_share: f64,
    /// Flux of the lights over that of the surface, under uniform light.
    pub flux_ratio: f64,
    /// Points with a light.
    pub covered: usize,
    /// All points.
    pub points: usize,
}

impl Verdict {
    /// The kinds of faults, ascending, each with the number of lights and the worst figure.
    #[must_use]
    pub fn by_kind(&self) -> Vec<(Kind, usize, f64)> {
        let mut kinds: Vec<Kind> = self.faults.iter().map(|f| f.kind).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let of = |kind| self.faults.iter().filter(move |f| f.kind == kind);
        kinds.iter().map(|&k| (k, of(k).count(), of(k).map(|f| f.by).fold(0.0, f64::max))).collect()
    }

    fn add(&mut self, fault: Fault) {
        let known = self.faults.iter_mut().find(|f| f.kind == fault.kind && f.light == fault.light);
        match known {
            Some(known) if known.by < fault.by => *known = fault,
            Some(_) => {}
            None => self.faults.push(fault),
        }
    }
}

/// A light in world space.
pub struct Light {
    /// Counter-clockwise from the emitting side, metres.
    pub corners: Triangle,
    /// Unit, towards the emitting side.
    pub normal: DVec3,
    /// 0 for none.
    pub tag: u32,
    /// Sum of its samples' reflectance, mean over the channels.
    pub reflectance: f64,
    /// Index into the scene's objects.
    pub object: u32,
    /// Position and normal.
    pub samples: Vec<(DVec3, DVec3)>,
}

/// The lights of an asset in world space.
#[must_use]
pub fn world_lights(scene: &Scene, asset: &VlmAsset) -> Vec<Light> {
    let mut lights = Vec::new();
    for vlm in &asset.vlms {
        let Some(number) = scene.objects.iter().position(|o| o.node == vlm.node) else { continue };
        let world = scene.objects[number].world_from_node;
        let normals = DMat3::from_mat4(world).inverse().transpose();
        for l in vlm.lights[0] as usize..(vlm.lights[0] + vlm.lights[1]) as usize {
            let mut corners =
                asset.triangles[l].map(|v| world.transform_point3(asset.positions[v as usize].as_dvec3()));
            if world.determinant() < 0.0 {
                corners.swap(1, 2);
            }
            let samples =
                &asset.samples[asset.sample_starts[l] as usize..asset.sample_starts[l + 1] as usize];
            let place = |s: &vlm_format::Sample| {
                let normal = (normals * s.normal.as_dvec3()).normalize_or_zero();
                (world.transform_point3(s.position.as_dvec3()), normal)
            };
            lights.push(Light {
                corners,
                normal: unit_normal(corners),
                tag: asset.tags.get(l).copied().unwrap_or(0),
                reflectance: samples.iter().map(|s| f64::from(s.reflectance.element_sum()) / 3.0).sum(),
                object: number as u32,
                samples: samples.iter().map(place).collect(),
            });
        }
    }
    lights
}

/// Everything that is wrong with a bake.
#[must_use]
pub fn check(scene: &Scene, asset: &VlmAsset) -> Verdict {
    let surface = Surface::new(scene, asset);
    let lights = world_lights(scene, asset);
    let area: f64 = lights.iter().map(|l| 0.5 * cross(l.corners).length()).sum();
    let tagged: f64 = lights.iter().filter(|l| l.tag != 0).map(|l| 0.5 * cross(l.corners).length()).sum();
    let mut verdict = Verdict {
        lights: lights.len(),
        tagged_share: tagged / area.max(f64::MIN_POSITIVE),
        ..Verdict::default()
    };
    if lights.is_empty() {
        verdict.add(Fault { kind: Kind::NoLights, light: 0, place: DVec3::ZERO, by: 1.0 });
        return verdict;
    }
    let owned = check_samples(&surface, &lights, &mut verdict);
    check_points(&surface, &lights, &owned, &mut verdict);
    check_places(&surface, &lights, &owned, &mut verdict);
    check_shapes(&lights, &mut verdict);
    check_flux(&surface, &lights, &mut verdict);
    verdict
}

/// The triangles on which the samples of each light lie; the light must not light its samples.
fn check_samples(surface: &Surface, lights: &[Light], verdict: &mut Verdict) -> Vec<Vec<u32>> {
    let mut owned = Vec::with_capacity(lights.len());
    for (l, light) in lights.iter().enumerate() {
        let mut own = Vec::new();
        for &(x, n) in &light.samples {
            let found = surface.triangles_at(x, n, light.object);
            if found.is_empty() {
                let by = surface.extent;
                verdict.add(Fault { kind: Kind::SampleOffSurface, light: l as u32, place: x, by });
            }
            // Where triangles lie upon each other, the light belongs to the one that bears its tag.
            if !found.iter().any(|&t| shields(surface, light, t)) {
                judge(surface, light, l, (x, n), verdict);
            }
            let height = (closest_on(light.corners, x) - x).dot(n);
            if light.tag == 0 && height > surface.rounding {
                verdict.add(Fault { kind: Kind::LiesInFront, light: l as u32, place: x, by: height });
            }
            own.extend(found);
        }
        own.sort_unstable();
        own.dedup();
        owned.push(own);
    }
    owned
}

/// The triangle bears the light's tag, so that it never sees the light.
fn shields(surface: &Surface, light: &Light, triangle: u32) -> bool {
    light.tag != 0 && light.tag == surface.tags[triangle as usize]
}

/// How far a place lies within a light's reach: the lesser of its height before the light's plane and of the light's height over its horizon.
fn lit_by(light: &Light, x: DVec3, n: DVec3) -> f64 {
    let before = (x - light.corners[0]).dot(light.normal);
    let above = light.corners.iter().map(|v| (*v - x).dot(n)).fold(f64::NEG_INFINITY, f64::max);
    before.min(above)
}

/// Adds a fault if a light lights a place for which it stands, or comes nearer to that than the clearance.
fn judge(surface: &Surface, light: &Light, number: usize, (x, n): (DVec3, DVec3), verdict: &mut Verdict) {
    let by = lit_by(light, x, n) + surface.clearance;
    if by > 0.0 {
        verdict.add(Fault { kind: Kind::LightsItself, light: number as u32, place: x, by });
    }
}

/// Points of every triangle against the light that stands for them and against those with samples on that triangle.
fn check_points(surface: &Surface, lights: &[Light], owned: &[Vec<u32>], verdict: &mut Verdict) {
    let candidates = surface.candidates(owned);
    let total: f64 = surface.areas.iter().sum();
    for t in 0..surface.triangles.len() {
        let count = LEAST_POINTS + (POINTS * surface.areas[t] / total) as u32;
        for side in surface.sides(t) {
            let normal = side * surface.normals[t];
            let alike = |l: &&u32| lights[**l as usize].normal.dot(normal) > ALIKE;
            let unshielded = |l: &&u32| !shields(surface, &lights[**l as usize], t as u32);
            let kin: Vec<u32> = candidates.of_part(surface.part[t]).iter().filter(alike).copied().collect();
            let own = candidates.of_triangle(t).iter().filter(alike).filter(unshielded);
            let own: Vec<u32> = own.copied().collect();
            for i in 0..count {
                verdict.points += 1;
                let x = place_on(surface.triangles[t], i);
                for &l in &own {
                    let by = lit_by(&lights[l as usize], x, normal);
                    if by > surface.rounding {
                        verdict.add(Fault { kind: Kind::LightsItsTriangle, light: l, place: x, by });
                    }
                }
                check_own_light(surface, lights, &kin, (x, normal), t, verdict);
            }
        }
    }
}

/// A point of triangle `t` against its light. Where several are equally near, as on both sides of a common edge, the point is any one's:
/// it is wrong only if none of them would do.
fn check_own_light(
    surface: &Surface,
    lights: &[Light],
    kin: &[u32],
    (x, n): (DVec3, DVec3),
    t: usize,
    verdict: &mut Verdict,
) {
    let nearest = lights_at(lights, kin, (x, n), surface.rounding);
    verdict.covered += usize::from(!nearest.is_empty());
    let unshielded = |l: u32| !shields(surface, &lights[l as usize], t as u32);
    let lit = |&(l, _): &(u32, DVec3)| {
        if unshielded(l) { lit_by(&lights[l as usize], x, n) } else { f64::NEG_INFINITY }
    };
    let Some(&(l, end)) = nearest.iter().min_by(|a, b| lit(a).total_cmp(&lit(b))) else { return };
    if unshielded(l) {
        judge(surface, &lights[l as usize], l as usize, (x, n), verdict);
    }
    if lights[l as usize].tag == 0 {
        walk(surface, &lights[l as usize], l, (x, n), end, t, verdict);
    }
}

/// Point `i` of a triangle; none lies on its border.
fn place_on([a, b, c]: Triangle, i: u32) -> DVec3 {
    let (u, v) = plastic_point(i, (0.13, 0.41));
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    let (u, v) = (0.001 + 0.997 * f64::from(u), 0.001 + 0.997 * f64::from(v));
    a + (b - a) * u + (c - a) * v
}

/// The lights of a point with a place of each: the one straight behind, or straight before, where that is at most three times as far as
/// the nearest; else the nearest, several if their distances differ by less than `slack`, and none if it is farther than its own size.
fn lights_at(lights: &[Light], from: &[u32], (x, n): (DVec3, DVec3), slack: f64) -> Vec<(u32, DVec3)> {
    let places: Vec<(u32, DVec3, f64)> = from
        .iter()
        .map(|&l| (l, closest_on(lights[l as usize].corners, x)))
        .map(|(l, place)| (l, place, place.distance(x)))
        .collect();
    let Some(nearest) = places.iter().min_by(|a, b| a.2.total_cmp(&b.2)) else { return Vec::new() };
    let [a, b, c] = lights[nearest.0 as usize].corners;
    if nearest.2 > a.distance(b).max(b.distance(c)).max(c.distance(a)) {
        return Vec::new();
    }
    for direction in [-n, n] {
        let way = Segment::new(x, x + direction * (3.0 * nearest.2));
        let met = from.iter().filter_map(|&l| Some((l, way.meets(lights[l as usize].corners)?)));
        if let Some((l, share)) = met.min_by(|a, b| a.1.total_cmp(&b.1)) {
            return vec![(l, x + way.direction * share)];
        }
    }
    let near = places.iter().filter(|p| p.2 <= nearest.2 + slack);
    near.map(|&(l, place, _)| (l, place)).collect()
}

/// Walks from just behind a surface point to a place of its light.
fn walk(
    surface: &Surface,
    light: &Light,
    number: u32,
    (x, n): (DVec3, DVec3),
    end: DVec3,
    own: usize,
    verdict: &mut Verdict,
) {
    let segment = Segment::new(x - n * surface.step, end);
    let leaves = |t: usize| {
        let other = surface.normals[t].dot(light.normal) < OTHER_SIDE;
        let out = other && segment.direction.dot(surface.normals[t]) > 0.0;
        if t == own || !(out || surface.two_sided[t]) { None } else { segment.meets(surface.triangles[t]) }
    };
    let share = (0..surface.triangles.len()).filter_map(leaves).fold(f64::INFINITY, f64::min);
    let by = (1.0 - share) * segment.direction.length();
    if by > surface.rounding && (!surface.closed || surface.is_free(end)) {
        verdict.add(Fault { kind: Kind::ComesOut, light: number, place: end, by });
    }
}

/// Corners, middles of the edges and centre of every untagged light, from the surface of its own part and side that is nearest to them.
fn check_places(surface: &Surface, lights: &[Light], owned: &[Vec<u32>], verdict: &mut Verdict) {
    for (l, light) in lights.iter().enumerate().filter(|(_, light)| light.tag == 0) {
        let parts: Vec<u32> = owned[l].iter().map(|&t| surface.part[t as usize]).collect();
        let own = |t: &usize| {
            parts.contains(&surface.part[*t]) && surface.normals[*t].dot(light.normal) > OTHER_SIDE
        };
        let near: Vec<usize> = (0..surface.triangles.len()).filter(own).collect();
        let [a, b, c] = light.corners;
        for place in [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0] {
            let from = near.iter().map(|&t| (t, surface.inner_place(t, place)));
            let nearest =
                from.min_by(|p, q| p.1.distance_squared(place).total_cmp(&q.1.distance_squared(place)));
            if let Some((t, x)) = nearest {
                walk(surface, light, l as u32, (x, surface.normals[t]), place, t, verdict);
            }
        }
    }
}

fn check_shapes(lights: &[Light], verdict: &mut Verdict) {
    for (l, light) in lights.iter().enumerate() {
        let by = aspect(light.corners);
        if by > MAX_ASPECT {
            verdict.add(Fault { kind: Kind::TooThin, light: l as u32, place: light.corners[0], by });
        }
    }
}

/// Under uniform light the lights reflect what the surface does.
fn check_flux(surface: &Surface, lights: &[Light], verdict: &mut Verdict) {
    let of_lights: f64 = lights.iter().map(|l| 0.5 * cross(l.corners).length() * l.reflectance).sum();
    verdict.flux_ratio = of_lights / surface.flux;
    let by = (verdict.flux_ratio - 1.0).abs();
    if by > FLUX_TOLERANCE {
        verdict.add(Fault { kind: Kind::Flux, light: 0, place: DVec3::ZERO, by });
    }
}

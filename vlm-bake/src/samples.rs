//! Stage 8: for each light, a few points on the visible surface that it stands for.
//!
//! A light lies behind the surface, so a shadow test at the light itself would always say "in shadow". Phase 1 instead finds the
//! irradiance `E` at the light's samples and sums
//! ```text
//! B = emission + sum_s reflectance_s E_s,      sum_s reflectance_s = albedo (A_surface / A_light)
//! ```
//! The ratio of the areas keeps the reflected flux where the light is smaller or larger than its surface; `flux` then makes up for
//! surface for which no light stands.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::f32::consts::PI;

use crate::correspondence::Light;
use crate::patches::Patches;
use crate::scene::Scene;
use crate::surface::SurfacePoint;
use crate::tag::Accusation;
use crate::topology::{Lists, cross_of};

/// The surface may be at most this many times as large as the light that stands for it: more would make that light a hot spot. What
/// is cut off is lost.
const MOST_AREA_RATIO: f64 = 4.0;

/// A finished light, in world space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BakedLight {
    /// Counter-clockwise seen from the emitting side, metres.
    pub corners: [DVec3; 3],
    /// Index into [`Scene::objects`].
    pub object: u32,
    /// Linear albedo of the surface that it stands for.
    pub albedo: Vec3,
    /// Radiosity that it emits by itself, lx.
    pub emission: Vec3,
    /// Index into [`Patches::regions`] of the surface for which it stands; 0 for authored ones.
    pub region: u32,
    /// It stands for the back of a two-sided surface.
    pub back: bool,
    /// Its radiosity over that of its surface: what it has less in area. 0 for authored ones.
    pub concentration: f32,
    /// The area of its surface over its own; 0 for authored ones. The concentration before objects' light was conserved, so that no colour
    /// is in it.
    pub area_ratio: f32,
    /// 0 for none.
    pub tag: u32,
    /// Its area before it moved behind its surface, square metres; 0 for authored ones.
    pub rest_area: f64,
    /// What it must not light, if anything.
    pub accused: Option<Accusation>,
    /// Made by an artist.
    pub authored: bool,
    /// Where phase 1 looks.
    pub samples: Vec<WorldSample>,
}

impl BakedLight {
    /// Radiosity of its surface over its own; 1 for authored ones, which are their own surface.
    #[must_use]
    pub fn surface_gain(&self) -> f32 {
        inverse_or_one(self.concentration)
    }

    /// The same by areas alone, whatever the colours.
    #[must_use]
    pub fn area_gain(&self) -> f32 {
        inverse_or_one(self.area_ratio)
    }
}

fn inverse_or_one(ratio: f32) -> f32 {
    if ratio > 0.0 { 1.0 / ratio } else { 1.0 }
}

/// A sample in world space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WorldSample {
    /// On the visible surface, metres.
    pub position: DVec3,
    /// Unit geometric normal.
    pub normal: DVec3,
    /// See [`vlm_format::Sample::reflectance`].
    pub reflectance: Vec3,
    /// The share of its light's area that it speaks for.
    pub share: f32,
}

/// A surface point with its colours.
#[derive(Clone, Copy)]
struct Candidate<'a> {
    point: &'a SurfacePoint,
    /// Where a sample would be: inside its triangle.
    position: DVec3,
    albedo: Vec3,
    emission: Vec3,
}

/// What the lights are drawn from.
pub struct Sources<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its patches.
    pub patches: &'a Patches,
    /// Per light, a number that it shares with the lights of its neighbourhood: parts of one face of the decimated mesh.
    pub group: &'a [u32],
    /// Per light, its area before it moved behind its surface, square metres.
    pub rest_areas: &'a [f64],
    /// Per light, what it must not light.
    pub accused: &'a [Option<Accusation>],
    /// Points on the visible surface.
    pub points: &'a [SurfacePoint],
    /// Which of them each light stands for.
    pub standing: &'a Lists,
}

/// A light much larger than the mean has at most this many times as many samples. Higher values follow shadows that fall on large lights.
const MOST_SAMPLES_SHARE: f64 = 64.0;

/// A light much smaller than the mean has at least this share of samples.
const LEAST_SAMPLES_SHARE: f64 = 0.25;

/// The finished lights, each with about `count` samples: more where it is larger than the mean, fewer where it is smaller. Lights without
/// any surface are left out.
#[must_use]
pub fn samples(sources: &Sources, lights: &[Light], count: u32) -> Vec<BakedLight> {
    // The ratio of areas is the group's: over one light, the number of points fluctuates too much.
    let mut areas: FxHashMap<u32, [f64; 2]> = FxHashMap::default();
    for (l, light) in lights.iter().enumerate() {
        let own = sources.standing.of(l).iter();
        let [surface, made] = areas.entry(sources.group[l]).or_default();
        *surface += own.map(|&p| sources.points[p as usize].area).sum::<f64>();
        *made += light.area();
    }
    let mean_area = lights.iter().map(Light::area).sum::<f64>() / lights.len().max(1) as f64;
    let finish = |(l, light): (usize, &Light)| {
        let share = (light.area() / mean_area).clamp(LEAST_SAMPLES_SHARE, MOST_SAMPLES_SHARE);
        let count = (f64::from(count) * share).ceil() as usize;
        let [surface, made] = areas[&sources.group[l]];
        let ratio = (surface / made).min(MOST_AREA_RATIO) as f32;
        finish_light(sources, l, light, ratio, count)
    };
    lights.par_iter().enumerate().filter_map(finish).collect()
}

/// One light with colours and samples; `None` if it stands for nothing that shines.
fn finish_light(
    sources: &Sources,
    number: usize,
    light: &Light,
    ratio: f32,
    count: usize,
) -> Option<BakedLight> {
    let candidates = candidates(sources, number);
    let region = sources.patches.regions[light.region as usize];
    let object = sources.scene.primitives[region.primitive as usize].object;
    let accused = sources.accused[number].clone();
    let rest_area = sources.rest_areas[number];
    let bare = BakedLight {
        corners: light.corners,
        object,
        region: light.region,
        back: light.back,
        concentration: ratio,
        area_ratio: ratio,
        rest_area,
        accused,
        ..BakedLight::default()
    };
    let finished = colour(bare, &candidates, ratio, count);
    (!finished.samples.is_empty() || finished.emission != Vec3::ZERO).then_some(finished)
}

/// The points of a light with the colours of the surface there, each the mean over the point's share of the area.
fn candidates<'a>(sources: &Sources<'a>, number: usize) -> Vec<Candidate<'a>> {
    let coloured = |&p: &u32| {
        let point = &sources.points[p as usize];
        let triangle = sources.patches.triangle_source[point.triangle as usize];
        let surface = sources.scene.albedo_at(triangle as usize, point.barycentric, point.area as f32);
        let position = point.inner;
        Candidate { point, position, albedo: surface.reflectance(), emission: surface.emission * PI }
    };
    sources.standing.of(number).iter().map(coloured).collect()
}

/// Finishes a light from its candidates.
fn colour(mut light: BakedLight, candidates: &[Candidate], ratio: f32, count: usize) -> BakedLight {
    if candidates.is_empty() {
        return light;
    }
    let area: f64 = candidates.iter().map(|c| c.point.area).sum();
    let share = |c: &Candidate| (c.point.area / area) as f32;
    light.albedo = candidates.iter().map(|c| c.albedo * share(c)).sum();
    light.emission = candidates.iter().map(|c| c.emission * share(c)).sum::<Vec3>() * ratio;
    // Samples in a recess that the light bridges are the last choice: the light lies before them.
    let normal = cross_of(light.corners).normalize_or_zero();
    let before = |c: &&Candidate| (c.point.position - light.corners[0]).dot(normal) > 0.0;
    let behind: Vec<Candidate> = candidates.iter().filter(before).copied().collect();
    let chosen = spread(if behind.is_empty() { candidates } else { &behind }, count);
    light.samples = chosen
        .iter()
        .map(|c| WorldSample {
            position: c.position,
            normal: c.point.normal,
            reflectance: Vec3::ZERO,
            share: 0.0,
        })
        .collect();
    for candidate in candidates {
        let away = |s: &WorldSample| s.position.distance_squared(candidate.position);
        if let Some(nearest) = light.samples.iter_mut().min_by(|a, b| away(a).total_cmp(&away(b))) {
            nearest.reflectance += candidate.albedo * (share(candidate) * ratio);
            nearest.share += share(candidate);
        }
    }
    // One stays even where all are black: it tells what the light stands for.
    let reflects = light.samples.iter().any(|s| s.reflectance != Vec3::ZERO);
    if reflects {
        light.samples.retain(|s| s.reflectance != Vec3::ZERO && s.share > 0.0);
    } else {
        light.samples.truncate(1);
    }
    let shares: f32 = light.samples.iter().map(|s| s.share).sum();
    light.samples.iter_mut().for_each(|s| s.share = if shares > 0.0 { s.share / shares } else { 1.0 });
    light
}

/// At most `count` candidates far from each other: first the one nearest to their centre, then always the farthest from all
/// chosen (Gonzalez 1985).
fn spread<'a>(candidates: &[Candidate<'a>], count: usize) -> Vec<Candidate<'a>> {
    let centre = candidates.iter().map(|c| c.position).sum::<DVec3>() / candidates.len() as f64;
    let mut away: Vec<f64> = candidates.iter().map(|c| -c.position.distance_squared(centre)).collect();
    let mut chosen: Vec<Candidate> = Vec::with_capacity(count);
    while chosen.len() < count.min(candidates.len()) {
        let Some(next) = (0..candidates.len()).max_by(|&a, &b| away[a].total_cmp(&away[b]).then(b.cmp(&a)))
        else {
            break;
        };
        let first = chosen.is_empty();
        chosen.push(candidates[next]);
        for (away, c) in away.iter_mut().zip(candidates) {
            let distance = c.position.distance_squared(candidates[next].position);
            *away = if first { distance } else { away.min(distance) };
        }
    }
    settle(candidates, chosen)
}

/// Rounds of [`settle`]. More even out the samples' shares further; three get within a few per cent of where it ends.
const SETTLING_ROUNDS: usize = 3;

/// Moves each chosen candidate into the middle of those nearest to it (Lloyd 1982), so that samples stand for like shares of the area.
fn settle<'a>(candidates: &[Candidate<'a>], mut chosen: Vec<Candidate<'a>>) -> Vec<Candidate<'a>> {
    for _ in 0..SETTLING_ROUNDS {
        let mut cells = vec![(DVec3::ZERO, 0.0); chosen.len()];
        for c in candidates {
            let cell = nearest(&chosen, c.position);
            cells[cell].0 += c.position * c.point.area;
            cells[cell].1 += c.point.area;
        }
        for (c, (sum, area)) in chosen.iter_mut().zip(cells).filter(|(_, (_, area))| *area > 0.0) {
            *c = candidates[nearest(candidates, sum / area)];
        }
    }
    chosen
}

/// The candidate nearest to a place.
fn nearest(candidates: &[Candidate], place: DVec3) -> usize {
    let away = |c: usize| candidates[c].position.distance_squared(place);
    (0..candidates.len()).min_by(|&a, &b| away(a).total_cmp(&away(b))).unwrap_or(0)
}

//! Stage 8: for each light, a few points on the visible surface that it stands for.
//!
//! A light lies behind the surface, so a shadow test at the light itself would always say "in shadow". Phase 1 instead finds the
//! irradiance `E` at the light's samples and sums
//! ```text
//! B = emission + sum_s reflectance_s E_s,      sum_s reflectance_s = albedo (A_surface / A_light) intensity tint
//! ```
//! The ratio of the areas keeps the reflected flux where the light is smaller or larger than its surface.

use glam::{DVec3, Vec3, Vec3A};
use rayon::prelude::*;
use std::f32::consts::PI;

use crate::bvh::nearest::closest_point;
use crate::decimate::LightMesh;
use crate::patches::Patches;
use crate::refine::Lights;
use crate::scene::{Scene, Steering};
use crate::surface::{Standing, SurfacePoint};

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
    /// 0 for none.
    pub tag: u32,
    /// Made by an artist.
    pub authored: bool,
    /// Where phase 1 looks.
    pub samples: Vec<WorldSample>,
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
}

/// A surface point with its colours.
#[derive(Clone, Copy)]
struct Candidate<'a> {
    point: &'a SurfacePoint,
    albedo: Vec3,
    emission: Vec3,
}

/// What the lights are drawn from.
pub struct Sources<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its patches.
    pub patches: &'a Patches,
    /// The offset mesh.
    pub mesh: &'a LightMesh,
    /// Tag per face.
    pub tags: &'a [u32],
    /// Points on the visible surface.
    pub points: &'a [SurfacePoint],
    /// Which of them each face stands for.
    pub standing: &'a Standing,
}

/// The finished lights, each with at most `count` samples, in the order of `lights`. A face that stands for no point makes no
/// lights.
#[must_use]
pub fn samples(sources: &Sources, lights: &Lights, count: u32) -> Vec<BakedLight> {
    let numbers: Vec<u32> = (0..lights.lights.len() as u32).collect();
    let runs: Vec<&[u32]> =
        numbers.chunk_by(|&a, &b| lights.lights[a as usize].face == lights.lights[b as usize].face).collect();
    runs.par_iter().flat_map_iter(|run| face_lights(sources, lights, run, count as usize)).collect()
}

/// The lights of one face.
fn face_lights(sources: &Sources, lights: &Lights, run: &[u32], count: usize) -> Vec<BakedLight> {
    let Some(face) = run.first().map(|&l| lights.lights[l as usize].face as usize) else { return Vec::new() };
    let candidates = candidates(sources, face);
    let region = sources.patches.regions[sources.mesh.faces[face].region as usize];
    let object = sources.scene.primitives[region.primitive as usize].object;
    let steering = &sources.scene.objects[object as usize].steering;
    let surface_area: f64 = candidates.iter().map(|c| c.point.area).sum();
    let ratio = (surface_area / sources.mesh.area(face)).min(MOST_AREA_RATIO) as f32;
    if candidates.is_empty() {
        return Vec::new();
    }
    let owned = share_out(lights, run, &candidates);
    run.iter()
        .zip(owned)
        .map(|(&l, own)| {
            let light = BakedLight {
                corners: lights.corners(l as usize),
                object,
                tag: sources.tags[face],
                ..BakedLight::default()
            };
            colour(light, &own, ratio, steering, count)
        })
        .filter(|light| !light.samples.is_empty() || light.emission != Vec3::ZERO)
        .collect()
}

/// The points of a face with the colours of the surface there, each the mean over the point's share of the area.
fn candidates<'a>(sources: &Sources<'a>, face: usize) -> Vec<Candidate<'a>> {
    let of = |&p: &u32| {
        let point = &sources.points[p as usize];
        let triangle = sources.patches.triangle_source[point.triangle as usize];
        let surface = sources.scene.albedo_at(triangle as usize, point.barycentric, point.area as f32);
        Candidate { point, albedo: surface.reflectance(), emission: surface.emission * PI }
    };
    sources.standing.of(face).iter().map(of).collect()
}

/// Gives each candidate to the nearest light of the face; a light that gets none borrows the candidate nearest to its centre.
fn share_out<'a>(lights: &Lights, run: &[u32], candidates: &[Candidate<'a>]) -> Vec<Vec<Candidate<'a>>> {
    let origin = candidates[0].point.position;
    let near = |p: DVec3| Vec3A::from((p - origin).as_vec3());
    let corners: Vec<[Vec3A; 3]> = run.iter().map(|&l| lights.corners(l as usize).map(near)).collect();
    let mut owned = vec![Vec::new(); run.len()];
    for candidate in candidates {
        let p = near(candidate.point.position);
        let away = |i: &usize| closest_point(&corners[*i], p).distance_squared(p);
        if let Some(nearest) = (0..run.len()).min_by(|a, b| away(a).total_cmp(&away(b))) {
            owned[nearest].push(*candidate);
        }
    }
    for (own, corners) in owned.iter_mut().zip(&corners).filter(|(own, _)| own.is_empty()) {
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let away = |c: &&Candidate| near(c.point.position).distance_squared(centre);
        own.extend(candidates.iter().min_by(|a, b| away(a).total_cmp(&away(b))));
    }
    owned
}

/// Finishes a light from its candidates.
fn colour(
    mut light: BakedLight,
    candidates: &[Candidate],
    ratio: f32,
    steering: &Steering,
    count: usize,
) -> BakedLight {
    let strength = steering.tint * steering.intensity;
    let each = 1.0 / candidates.len() as f32;
    light.albedo = candidates.iter().map(|c| c.albedo).sum::<Vec3>() * each;
    light.emission = candidates.iter().map(|c| c.emission).sum::<Vec3>() * each * ratio * strength;
    let chosen = spread(candidates, count);
    light.samples = chosen
        .iter()
        .map(|c| WorldSample { position: c.point.position, normal: c.point.normal, reflectance: Vec3::ZERO })
        .collect();
    for candidate in candidates {
        let away = |s: &WorldSample| s.position.distance_squared(candidate.point.position);
        if let Some(nearest) = light.samples.iter_mut().min_by(|a, b| away(a).total_cmp(&away(b))) {
            nearest.reflectance += candidate.albedo * (each * ratio) * strength;
        }
    }
    light.samples.retain(|s| s.reflectance != Vec3::ZERO);
    light
}

/// At most `count` candidates far from each other: first the one nearest to their centre, then always the farthest from all
/// chosen (Gonzalez 1985).
fn spread<'a>(candidates: &[Candidate<'a>], count: usize) -> Vec<Candidate<'a>> {
    let centre = candidates.iter().map(|c| c.point.position).sum::<DVec3>() / candidates.len() as f64;
    let mut away: Vec<f64> = candidates.iter().map(|c| -c.point.position.distance_squared(centre)).collect();
    let mut chosen: Vec<Candidate> = Vec::with_capacity(count);
    while chosen.len() < count.min(candidates.len()) {
        let Some(next) = (0..candidates.len()).max_by(|&a, &b| away[a].total_cmp(&away[b]).then(b.cmp(&a)))
        else {
            break;
        };
        let first = chosen.is_empty();
        chosen.push(candidates[next]);
        for (away, c) in away.iter_mut().zip(candidates) {
            let distance = c.point.position.distance_squared(candidates[next].point.position);
            *away = if first { distance } else { away.min(distance) };
        }
    }
    chosen
}

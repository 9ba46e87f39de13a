//! The pictures of a view, pixel by pixel.

use glam::{DVec3, Vec3};
use image::{Rgb, RgbImage};
use rayon::prelude::*;
use vlm_format::VlmAsset;

use super::colour::{
    self, BACKGROUND, HATCH, KEPT_DARK, MAKES_NONE, PLAIN, POKING, VIOLATION, encode, of_tag, pale, ramp,
    scramble, shade, shade_linear,
};
use super::correspondence::Place;
use super::facts::{Evidence, Fact, View};
use super::grid_view::{self, GridScales, near_lights_at};
use crate::bvh::Bvh;
use crate::camera::CameraRays;
use crate::scene::Camera;

/// The ramp of the clearance ends at this many times the required one.
pub const CLEARANCE_END: f64 = 64.0;

/// A light lies in front of the surface if it is nearer than this share of its distance.
const IN_FRONT: f32 = 0.9995;

/// What a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// The scene by a lamp at the eye.
    Scene,
    /// Lights as facets.
    Lights,
    /// Lights that reach what they stand for.
    Violations,
    /// Depth of the lights over the required one.
    Clearance,
    /// Tags, and what has no light.
    Tags,
    /// Distance of the lights beyond the clearance.
    Error,
    /// Albedo of the surface.
    TexelAlbedo,
    /// Albedo of the light that stands there.
    LightAlbedo,
    /// Probes of the grid as dots in the colour of their reach.
    Probes,
    /// How many near lights a pixel evaluates.
    NearLights,
}

impl Subject {
    /// All, in the order of the page; those of the grid stand last.
    const ALL: [Self; 10] = [
        Self::Scene,
        Self::Lights,
        Self::Violations,
        Self::Clearance,
        Self::Tags,
        Self::Error,
        Self::TexelAlbedo,
        Self::LightAlbedo,
        Self::Probes,
        Self::NearLights,
    ];

    /// Those of which an asset has something to show, in the order of the page.
    pub fn of(asset: &VlmAsset) -> &'static [Self] {
        if asset.grid.is_some() { &Self::ALL } else { &Self::ALL[..8] }
    }
}

/// Where the pictures' ramps end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scales {
    /// Of the decimation error, metres.
    pub error_end_m: f64,
    /// Of the grid; zeros without one.
    pub grid: GridScales,
}

impl Scales {
    /// As long as they must be for nearly all that there is.
    pub fn new(evidence: &Evidence) -> Self {
        let grid = evidence.asset.grid.as_ref().map(GridScales::new);
        Self { error_end_m: error_end(evidence), grid: grid.unwrap_or_default() }
    }
}

/// Draws one subject.
pub fn draw(
    evidence: &Evidence,
    view: &View,
    camera: &Camera,
    subject: Subject,
    scales: &Scales,
) -> RgbImage {
    if subject == Subject::Lights {
        return facets(evidence, camera, view.width, view.height);
    }
    let mut picture = RgbImage::from_fn(view.width, view.height, |x, y| {
        let fact = view.facts[(y * view.width + x) as usize].as_ref();
        Rgb(fact.map_or(BACKGROUND, |fact| pixel(evidence, fact, subject, [x, y], scales)))
    });
    if subject == Subject::Probes {
        grid_view::dots(evidence, view, camera, &scales.grid, &mut picture);
    }
    picture
}

fn pixel(evidence: &Evidence, fact: &Fact, subject: Subject, at: [u32; 2], scales: &Scales) -> [u8; 3] {
    let required_m = evidence.verification.required_m;
    let lit = |colour: [u8; 3]| shade(colour, fact.facing);
    let measured = |value: &dyn Fn() -> [u8; 3]| match fact.place {
        Place::Light(_) => lit(value()),
        Place::Uncovered => lit(hatched(at, PLAIN)),
        Place::MakesNone => lit(MAKES_NONE),
    };
    match subject {
        Subject::Scene => shade_linear(fact.point.albedo + fact.point.emission, fact.facing),
        Subject::TexelAlbedo => encode(fact.point.albedo),
        Subject::LightAlbedo => match fact.place {
            Place::Light(light) => encode(evidence.asset.albedo[light as usize]),
            Place::Uncovered => hatched(at, PLAIN),
            Place::MakesNone => MAKES_NONE,
        },
        Subject::Clearance => measured(&|| of_clearance(fact, required_m)),
        Subject::Error => measured(&|| ramp((fact.light.distance_m - required_m) / scales.error_end_m)),
        Subject::Tags => measured(&|| of_tags(fact, at)),
        Subject::Violations => match fact.place {
            Place::MakesNone => lit(MAKES_NONE),
            _ => lit(of_violation(evidence, fact).unwrap_or(PLAIN)),
        },
        // Dark, since dots may be bright.
        Subject::Probes => greyed(fact).map(|channel| channel / 2),
        Subject::NearLights => {
            let near = evidence.asset.grid.as_ref().and_then(|grid| near_lights_at(grid, fact));
            lit(near.map_or(MAKES_NONE, |near| ramp(near as f64 / scales.grid.near)))
        }
        Subject::Lights => BACKGROUND,
    }
}

/// Logarithmic from 1 to [`CLEARANCE_END`] times the required clearance; below that the colour of violations.
fn of_clearance(fact: &Fact, required_m: f64) -> [u8; 3] {
    if fact.fails(required_m) {
        return if fact.is_kept_dark() { KEPT_DARK } else { VIOLATION };
    }
    ramp((fact.light.clearance_m / required_m).ln() / CLEARANCE_END.ln())
}

/// The surface's tag; pale where its own light does not carry one, dots of the light's where the surface bears none.
fn of_tags(fact: &Fact, [x, y]: [u32; 2]) -> [u8; 3] {
    let is_dot = x % 4 < 2 && y % 4 < 2;
    match (fact.light.tag, fact.surface_tag) {
        (0, 0) => PLAIN,
        (0, surface) => pale(of_tag(surface)),
        (light, 0) => {
            if is_dot {
                of_tag(light)
            } else {
                PLAIN
            }
        }
        (_, surface) => of_tag(surface),
    }
}

/// The colour of what is wrong with the light of a point, if anything is.
fn of_violation(evidence: &Evidence, fact: &Fact) -> Option<[u8; 3]> {
    let Place::Light(light) = fact.place else { return None };
    if fact.fails(evidence.verification.required_m) {
        return Some(if fact.is_kept_dark() { KEPT_DARK } else { VIOLATION });
    }
    evidence.pokes_out[light as usize].map(|tagged| if tagged { KEPT_DARK } else { POKING })
}

/// The scene without much colour, so that others stand out on it.
fn greyed(fact: &Fact) -> [u8; 3] {
    shade_linear(fact.point.albedo.lerp(Vec3::splat(0.5), 0.6), fact.facing)
}

/// Diagonal stripes.
fn hatched([x, y]: [u32; 2], colour: [u8; 3]) -> [u8; 3] {
    if (x + y) % 7 < 2 { HATCH } else { colour }
}

/// A close-up: the scene greyed, so that colours stand out, and the light where it lies in front of all surface.
pub fn draw_close(evidence: &Evidence, view: &View, camera: &Camera, light: Option<u32>) -> RgbImage {
    let corners: Vec<Vec3> =
        light.map(|l| evidence.lights.corners[l as usize].map(|p| p.as_vec3()).to_vec()).unwrap_or_default();
    let triangle: &[[u32; 3]] = if light.is_some() { &[[0, 1, 2]] } else { &[] };
    let (bvh, rays) = (Bvh::new(&corners, triangle), CameraRays::new(camera, view.width, view.height));
    let shows = |x: u32, y: u32, fact: Option<&Fact>| {
        let ray = rays.through(x, y);
        let end = fact.map_or(f32::INFINITY, |fact| IN_FRONT * fact.point.position.distance(ray.origin));
        light.is_some() && bvh.hit(ray.origin, ray.direction, end).is_some()
    };
    RgbImage::from_fn(view.width, view.height, |x, y| {
        let fact = view.facts[(y * view.width + x) as usize].as_ref();
        if shows(x, y, fact) {
            return Rgb(POKING);
        }
        Rgb(fact.map_or(BACKGROUND, |fact| {
            let scene = greyed(fact);
            match fact.place {
                Place::Uncovered => hatched([x, y], scene),
                _ => of_violation(evidence, fact).map_or(scene, |colour| shade(colour, fact.facing)),
            }
        }))
    })
}

/// The lights alone, as the camera would see them: a colour for each, dark where one meets the next.
fn facets(evidence: &Evidence, camera: &Camera, width: u32, height: u32) -> RgbImage {
    let lights = evidence.lights;
    let positions: Vec<Vec3> = lights.corners.iter().flatten().map(|p: &DVec3| p.as_vec3()).collect();
    let triangles: Vec<[u32; 3]> =
        (0..lights.corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let bvh = Bvh::new(&positions, &triangles);
    let rays = CameraRays::new(camera, width, height);
    let seen: Vec<Option<(u32, f32)>> = (0..width * height)
        .into_par_iter()
        .map(|i| {
            let ray = rays.through(i % width, i / width);
            let hit = bvh.hit_where(ray.origin, ray.direction, f32::INFINITY, |hit| hit.front)?;
            let normal = lights.normals[hit.triangle as usize].as_vec3();
            Some((hit.triangle, -ray.direction.dot(normal)))
        })
        .collect();
    let light_at = |x: u32, y: u32| {
        (x < width && y < height).then(|| seen[(y * width + x) as usize].map(|(light, _)| light))
    };
    RgbImage::from_fn(width, height, |x, y| {
        let Some((light, facing)) = seen[(y * width + x) as usize] else { return Rgb(BACKGROUND) };
        let is_edge = [light_at(x + 1, y), light_at(x, y + 1)].iter().flatten().any(|&l| l != Some(light));
        let albedo = evidence.asset.albedo[light as usize].lerp(Vec3::splat(0.5), 0.25);
        let tint = 0.75 + 0.35 * scramble(light);
        let flat = shade(encode(albedo * tint), facing);
        Rgb(if is_edge { flat.map(|c| c / 2) } else { flat })
    })
}

/// Where the ramp of the error ends: what all but a hundredth of the surface stays below, metres; `None` if nothing is covered.
fn error_end(evidence: &Evidence) -> f64 {
    let verification = evidence.verification;
    let pairs = verification.points.iter().zip(&verification.light_of_point);
    // Every eighth point settles a percentile well enough.
    let mut beyond: Vec<f64> = pairs
        .step_by(8)
        .filter(|(p, _)| p.area > 0.0)
        .filter_map(|(p, light)| {
            let fact = evidence.light_fact((*light)? as usize, p.inner, p.normal);
            Some(fact.distance_m - verification.required_m)
        })
        .collect();
    beyond.sort_unstable_by(f64::total_cmp);
    let end = beyond.get(beyond.len() * 99 / 100).copied().unwrap_or(0.0);
    round_up(end.max(verification.required_m))
}

/// The next of 1, 2, 5, 10, ... times a power of ten.
fn round_up(length: f64) -> f64 {
    let power = 10f64.powf(length.log10().floor());
    [1.0, 2.0, 5.0].iter().map(|step| step * power).find(|&end| length <= end).unwrap_or(10.0 * power)
}

/// The stops of a legend's ramp as a CSS gradient.
pub fn css_ramp() -> String {
    let stops: Vec<String> = (0..=12).map(|i| colour::css(ramp(f64::from(i) / 12.0))).collect();
    format!("linear-gradient(to right, {})", stops.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ramps_end_at_round_lengths() {
        assert_eq!([0.3, 1.0, 1.1, 4.0, 7.0].map(round_up), [0.5, 1.0, 2.0, 5.0, 10.0]);
    }
}

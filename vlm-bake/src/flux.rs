//! Keeps the light that each object reflects, though its lights cover less, or more, than its surface.
//!
//! Under uniform irradiance a surface sends out `sum of area x albedo` per irradiance, its reflecting area; its lights send out
//! `sum of area x reflectance`. What decimation dropped, and what no light stands for, is missing from the second. So the lights of
//! each object are scaled, channel by channel, until the two agree; likewise what they emit by themselves.
//!
//! The lights of a hollow grow as they move behind its wall. Whoever stands in it sees the wall at the same solid angle at any
//! depth, so there it is the radiosity that must stay, and the reflecting area may grow as the lights do.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};
use schemars::JsonSchema;
use serde::Serialize;
use vlm_shaders::cpu::resolve::luminance;

use crate::patches::Patches;
use crate::samples::BakedLight;
use crate::scene::{Scene, Surface};
use crate::surface::SurfacePoint;
use crate::topology::area;

/// Lights are scaled by at most this factor, up or down: beyond it, what is left would be a hot spot in place of much that was dropped.
/// What is cut off is lost, and reported.
const MOST_SCALING: f64 = 8.0;

/// The reflecting area of a hollow may grow by at most this factor.
const MOST_GROWTH: f64 = 1.1;

/// Light that an object sends out may differ by this share before the report names it.
pub const TOLERANCE: f64 = 0.02;

/// The light that an object sends out, as the report shows it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ObjectFlux {
    /// Node path.
    pub object: String,
    /// Area of the surface that can be seen, square metres; both sides of two-sided surface.
    pub visible_m2: f64,
    /// Area of its lights, square metres.
    pub lights_m2: f64,
    /// Reflecting area (area times albedo) of the surface per channel, square metres.
    pub visible_reflecting_m2: [f64; 3],
    /// Reflecting area of its lights, before an artist's tint and intensity.
    pub lights_reflecting_m2: [f64; 3],
    /// What the surface emits, lm.
    pub visible_emitted_lm: [f64; 3],
    /// What its lights emit by themselves, likewise.
    pub lights_emitted_lm: [f64; 3],
    /// Both agree within 2 %.
    pub kept: bool,
}

/// What goes out of an object.
#[derive(Clone, Copy, Default)]
struct Sent {
    area: f64,
    /// Of lights, before they moved.
    rest_area: f64,
    reflected: DVec3,
    emitted: DVec3,
}

/// Scales the lights of each object to what its surface sends out. `surfaces` holds the mean surface of each scene triangle, `points`
/// those that can be seen, with their shares of the area.
pub fn conserve(
    scene: &Scene,
    patches: &Patches,
    surfaces: &[Surface],
    points: &[SurfacePoint],
    lights: &mut [BakedLight],
) -> Vec<ObjectFlux> {
    let visible = sent_by_surface(scene, patches, surfaces, points);
    let before = sent_by_lights(scene, lights);
    let scale = |wanted: DVec3, there: DVec3| {
        let factor = |wanted: f64, there: f64| {
            let factor = wanted / there;
            if there > 0.0 { factor.clamp(1.0 / MOST_SCALING, MOST_SCALING) } else { 1.0 }
        };
        DVec3::new(factor(wanted.x, there.x), factor(wanted.y, there.y), factor(wanted.z, there.z)).as_vec3()
    };
    for light in lights.iter_mut() {
        let (visible, before) = (&visible[light.object as usize], &before[light.object as usize]);
        let growth = if before.rest_area > 0.0 { before.area / before.rest_area } else { 1.0 };
        let growth = growth.clamp(1.0, MOST_GROWTH);
        let reflected = scale(visible.reflected * growth, before.reflected);
        let emitted = scale(visible.emitted * growth, before.emitted);
        light.samples.iter_mut().for_each(|s| s.reflectance *= reflected);
        light.emission *= emitted;
        let emits = light.albedo == Vec3::ZERO;
        light.concentration *= luminance(if emits { emitted } else { reflected });
    }
    let after = sent_by_lights(scene, lights);
    let objects = visible.iter().zip(after).enumerate().filter(|(_, (visible, _))| visible.area > 0.0);
    objects.map(|(object, (visible, after))| report(&scene.objects[object].path, visible, &after)).collect()
}

fn report(path: &str, visible: &Sent, lights: &Sent) -> ObjectFlux {
    let agrees = |a: DVec3, b: DVec3| {
        (a - b).abs().cmple(TOLERANCE * a.abs().max_element().max(1e-12) * DVec3::ONE).all()
    };
    ObjectFlux {
        object: path.to_owned(),
        visible_m2: visible.area,
        lights_m2: lights.area,
        visible_reflecting_m2: visible.reflected.to_array(),
        lights_reflecting_m2: lights.reflected.to_array(),
        visible_emitted_lm: visible.emitted.to_array(),
        lights_emitted_lm: lights.emitted.to_array(),
        kept: agrees(visible.reflected, lights.reflected) && agrees(visible.emitted, lights.emitted),
    }
}

fn sent_by_surface(
    scene: &Scene,
    patches: &Patches,
    surfaces: &[Surface],
    points: &[SurfacePoint],
) -> Vec<Sent> {
    let mut sent = vec![Sent::default(); scene.objects.len()];
    for point in points {
        let source = patches.triangle_source[point.triangle as usize] as usize;
        let surface = &surfaces[source];
        let primitive = &scene.primitives[scene.triangle_primitive[source] as usize];
        let to = &mut sent[primitive.object as usize];
        to.area += point.area;
        to.reflected += surface.reflectance().as_dvec3() * point.area;
        to.emitted += (surface.emission * PI).as_dvec3() * point.area;
    }
    sent
}

fn sent_by_lights(scene: &Scene, lights: &[BakedLight]) -> Vec<Sent> {
    let mut sent = vec![Sent::default(); scene.objects.len()];
    for light in lights {
        let area = area(light.corners);
        let to = &mut sent[light.object as usize];
        to.area += area;
        to.rest_area += light.rest_area;
        to.reflected += light.samples.iter().map(|s| s.reflectance.as_dvec3()).sum::<DVec3>() * area;
        to.emitted += light.emission.as_dvec3() * area;
    }
    sent
}

/// Applies what artists ask for: tint and intensity of each light's object.
pub fn steer(scene: &Scene, lights: &mut [BakedLight]) {
    for light in lights {
        let steering = &scene.objects[light.object as usize].steering;
        let strength = steering.strength();
        light.samples.iter_mut().for_each(|s| s.reflectance *= strength);
        light.emission *= strength;
    }
}

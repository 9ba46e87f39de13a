//! Virtual point lights: Keller, "Instant Radiosity", 1997.
//!
//! Every frame, paths from the lights leave a virtual point light where they first meet a surface, and points drawn on
//! emitters are further ones. Every pixel sums them all, each with a shadow ray:
//! `E(x) = sum_i Phi_i / pi * min(cos_x cos_i / d^2, 1 / r^2) V(x, i)`. The bound keeps points next to a light from glowing; it
//! loses the light of what is nearer than about `r`. Keller uses shadow maps and lets paths go on; one bounce here,
//! as the truth has one.

mod shoot;

use std::f32::consts::FRAC_1_PI;
use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;
use vlm_bake::render::PhaseSeconds;
use vlm_bake::shade::{SurfacePoint, TraceScene};

use super::Entry;
use crate::method::{Cost, Method, MethodError, Picture, Prepared, Stage, View};
use shoot::{PointLight, Sources};

/// The method's line in the table. The tolerance is for the noise of so many lights.
pub const ENTRY: Entry = Entry {
    name: "instant_radiosity",
    sweep,
    proof: || Box::new(InstantRadiosity { lights: 4096, clamp: 0.005 }),
    tolerance: 0.02,
};

/// Lights and clamp in a room: the more lights, the less light stands in for each, and the smaller the bound may be.
const SWEEP: [(u32, f32); 7] =
    [(16, 0.1), (64, 0.1), (256, 0.1), (1024, 0.1), (1024, 0.05), (4096, 0.05), (4096, 0.025)];

/// Scenes of more triangles than this get four times the lights and half the clamp: most of their lights lie where the
/// camera does not look.
const ROOM_TRIANGLES: usize = 10_000;

fn sweep(stage: &Stage<'_>) -> Vec<Box<dyn Method>> {
    let (more, closer) = if stage.trace.scene.triangles.len() > ROOM_TRIANGLES { (4, 0.5) } else { (1, 1.0) };
    let setting = |(lights, clamp)| InstantRadiosity { lights: more * lights, clamp: closer * clamp };
    SWEEP.map(|knobs| Box::new(setting(knobs)) as Box<dyn Method>).into()
}

/// The method at one setting.
pub struct InstantRadiosity {
    /// Virtual point lights. Four times as many halve the error or better; the time of a frame grows in proportion.
    pub lights: u32,
    /// Distance below which a light grows no brighter, as a share of the scene's extent. Higher values lose light in
    /// corners, lower values leave bright spots.
    pub clamp: f32,
}

impl Method for InstantRadiosity {
    fn name(&self) -> &'static str {
        ENTRY.name
    }

    fn knob(&self) -> String {
        format!("lights={} clamp={}", self.lights, self.clamp)
    }

    fn prepare(&self, stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError> {
        let start = Instant::now();
        let sources = Sources::new(stage.trace);
        let prepare_seconds = start.elapsed().as_secs_f64();
        let most_geometry = 1.0 / (self.clamp * stage.extent()).powi(2).max(f32::MIN_POSITIVE);
        Ok(Box::new(PreparedInstantRadiosity {
            sources,
            lights: self.lights,
            most_geometry,
            prepare_seconds,
        }))
    }
}

struct PreparedInstantRadiosity {
    sources: Sources,
    lights: u32,
    /// Bound of the geometry term, per square metre.
    most_geometry: f32,
    prepare_seconds: f64,
}

impl Prepared for PreparedInstantRadiosity {
    fn render(&self, view: &View<'_>, frame: u32) -> Result<Picture, MethodError> {
        let start = Instant::now();
        let shot = self.sources.shoot(view.trace, self.lights, frame);
        let inject = start.elapsed().as_secs_f64();

        let start = Instant::now();
        let gather = |point: &Option<SurfacePoint>| {
            point.as_ref().map_or((Vec3::ZERO, 0, 0), |p| self.gather(view.trace, &shot.lights, p))
        };
        let gathered: Vec<(Vec3, u64, u64)> = view.gbuffer.points.par_iter().map(gather).collect();
        Ok(Picture {
            seconds: PhaseSeconds { inject, gather: start.elapsed().as_secs_f64() },
            lights: shot.lights.len() as u32,
            pairs: gathered.iter().map(|(_, pairs, _)| pairs).sum(),
            rays: shot.rays + gathered.iter().map(|(.., rays)| rays).sum::<u64>(),
            indirect: gathered.into_iter().map(|(irradiance, ..)| irradiance).collect(),
        })
    }

    fn cost(&self) -> Cost {
        let bytes = u64::from(self.lights) * size_of::<PointLight>() as u64;
        Cost { prepare_seconds: self.prepare_seconds, bytes }
    }
}

impl PreparedInstantRadiosity {
    /// Irradiance of a point, pairs and shadow rays.
    fn gather(&self, scene: &TraceScene<'_>, lights: &[PointLight], x: &SurfacePoint) -> (Vec3, u64, u64) {
        let origin = scene.bvh.leave(x.position, x.geometric_normal);
        let (mut irradiance, mut rays) = (Vec3::ZERO, 0);
        for light in lights {
            let to_light = light.position - x.position;
            let squared = to_light.length_squared();
            let (at_x, at_light) = (x.normal.dot(to_light), -light.normal.dot(to_light));
            if at_x <= 0.0 || at_light <= 0.0 || x.geometric_normal.dot(to_light) <= 0.0 {
                continue;
            }
            rays += 1;
            let target = scene.bvh.leave(light.position, light.normal);
            if !scene.is_occluded(origin, target - origin, 1.0) {
                let geometry = (at_x * at_light / (squared * squared)).min(self.most_geometry);
                irradiance += light.flux * (FRAC_1_PI * geometry);
            }
        }
        (irradiance, lights.len() as u64, rays)
    }
}

//! How much light the surface gets from the lights that stand for it, measured with the form factor itself.

use glam::Vec3;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use vlm_shaders::cpu::form_factor::{LightGeometry, form_factor};

use crate::correspondence::Light;
use crate::surface::SurfacePoint;

/// Points over which the mean irradiance is taken: with all lights each, so that their number costs as much as it counts.
const MEAN_OVER: usize = 256;

/// The light that a surface gets from its own lights, each at unit radiosity, relative to the mean irradiance that all lights
/// give, unoccluded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct SelfLight {
    /// What 999 of 1,000 points do not exceed.
    pub p999: f64,
    /// The largest.
    pub max: f64,
}

/// Measures at the points. `ignores` tells whether a point's tag keeps a light away.
#[must_use]
pub fn self_light(
    lights: &[Light],
    points: &[SurfacePoint],
    light_of_point: &[Option<u32>],
    ignores: impl Fn(&SurfacePoint, u32) -> bool + Sync,
) -> SelfLight {
    let geometry: Vec<LightGeometry> = lights.par_iter().map(|l| LightGeometry::new(l.corners)).collect();
    let at = |point: &SurfacePoint, light: u32| {
        let dark = ignores(point, light);
        let (x, n): (Vec3, Vec3) = (point.position.as_vec3(), point.normal.as_vec3());
        if dark { 0.0 } else { f64::from(form_factor(&geometry[light as usize], x, n)) }
    };
    let stride = points.len().div_ceil(MEAN_OVER).max(1);
    let sums: Vec<f64> = points
        .par_iter()
        .step_by(stride)
        .map(|point| (0..lights.len() as u32).map(|light| at(point, light)).sum())
        .collect();
    let mean = sums.iter().sum::<f64>() / sums.len().max(1) as f64;
    let mut own: Vec<f64> = points
        .par_iter()
        .zip(light_of_point)
        .map(|(point, light)| light.map_or(0.0, |light| at(point, light)))
        .collect();
    own.par_sort_unstable_by(f64::total_cmp);
    let relative = |value: Option<&f64>| value.map_or(0.0, |v| if *v > 0.0 { v / mean } else { 0.0 });
    SelfLight { p999: relative(own.get(own.len() * 999 / 1000)), max: relative(own.last()) }
}

//! The exact sum over virtual area lights in f64: what a method with such lights would give if it neither cut lights off
//! nor rounded. The distance from it is the algorithm error; the rest of the distance from the truth is the model's.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use vlm_bake::render::{LitScene, RenderError};
use vlm_shaders::cpu::gather::Receiver;

use crate::form_factor::case::Case;
use crate::form_factor::reference::truth;
use crate::method::{Baked, View};

/// Pairs of a pixel and a light that are summed; each takes about a microsecond.
const PAIRS: usize = 2_000_000;

/// At least this many pixels are summed, whatever the number of lights.
const FEWEST_PIXELS: usize = 64;

/// At most this many: then the error over them differs from that over all pixels by some per cent of itself.
const MOST_PIXELS: usize = 1024;

/// The exact sum at some of a view's pixels.
pub struct ExactPixels {
    /// The lights that were summed.
    pub baked: Arc<Baked>,
    /// Pixels, evenly spread over those that show a surface.
    pixels: Vec<usize>,
    irradiance: Vec<DVec3>,
}

impl ExactPixels {
    /// Sums the lights at up to 1024 pixels, evenly spread, and at fewer (2 million pairs, 64 pixels at least) where there are
    /// many lights. A light adds nothing to a
    /// receiver of its own tag, nor where it lies wholly behind the receiver's surface.
    ///
    /// # Errors
    /// If a light belongs to no node of the scene.
    pub fn new(view: &View<'_>, baked: &Arc<Baked>) -> Result<Self, RenderError> {
        let lit = LitScene::new(view.trace, &baked.asset)?;
        let hits: Vec<usize> =
            (0..view.gbuffer.points.len()).filter(|&i| view.gbuffer.points[i].is_some()).collect();
        let wanted = (PAIRS / lit.lights.len().max(1)).clamp(FEWEST_PIXELS, MOST_PIXELS).min(hits.len());
        let pixels: Vec<usize> = (0..wanted).map(|i| hits[(2 * i + 1) * hits.len() / (2 * wanted)]).collect();
        let sum = |&pixel: &usize| {
            view.gbuffer.points[pixel]
                .as_ref()
                .map_or(DVec3::ZERO, |point| exact_sum(&lit, &lit.receiver(point)))
        };
        let irradiance = pixels.par_iter().map(sum).collect();
        Ok(Self { baked: Arc::clone(baked), pixels, irradiance })
    }

    /// Relative RMSE of a picture over these pixels; `None` where the sum is black.
    #[must_use]
    pub fn relative_rmse(&self, picture: &[Vec3]) -> Option<f64> {
        let pairs = || self.pixels.iter().zip(&self.irradiance);
        let error: f64 = pairs().map(|(&i, e)| picture[i].as_dvec3().distance_squared(*e)).sum();
        let power: f64 = self.irradiance.iter().map(|e| e.length_squared()).sum();
        (power > 0.0).then(|| (error / power).sqrt())
    }
}

fn exact_sum(lit: &LitScene, receiver: &Receiver) -> DVec3 {
    let (x, n) = (receiver.position, receiver.normal);
    let height = |corner: &Vec3| (*corner - x).as_dvec3().dot(receiver.geometric_normal.as_dvec3());
    let lights = lit.lights.geometry.iter().zip(&lit.lights.tags).zip(&lit.radiosity);
    let terms = lights.filter_map(|((light, &tag), radiosity)| {
        let corners = light.corners();
        let is_unseen = (tag != 0 && tag == receiver.tag) || corners.iter().all(|c| height(c) <= 0.0);
        if is_unseen || *radiosity == Vec3::ZERO {
            return None;
        }
        Some(truth(&Case { corners, x, n })?.form_factor * radiosity.as_dvec3())
    });
    terms.sum()
}

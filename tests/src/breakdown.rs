//! What limits the static grid's accuracy, cause by cause, for each camera of some scenes.
//!
//! All errors are relative RMSE of indirect irradiance against the path-traced truth, at the pixels that show a surface:
//! `lights` traces the truth's rays but takes the radiosity of the light that stands where they end: what is left is the resolution of
//! lights and samples. `grid` is the method itself: interpolation of visibility and far light, and rays of the probes, come on top.
//! `algorithm` is the distance of `grid` from the exact sum over its own lights with visibility.

use std::path::Path;
use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;
use vlm_bake::bake::{Bake, BakeError, bake};
use vlm_bake::options::BakeOptions;
use vlm_bake::progress::Silent;
use vlm_bake::render::{LitScene, RenderError, gather_by_grid};
use vlm_bake::scene::{Camera, Scene};
use vlm_bake::shade::TraceScene;

use crate::method::View;
use crate::metrics::{Comparison, Metrics, compare};
use crate::truth::{TruthError, Truths};

/// One camera of one scene with one bake.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The scene's name.
    pub scene: String,
    /// The camera's name.
    pub camera: String,
    /// The preset's name.
    pub preset: String,
    /// Lights.
    pub lights: usize,
    /// Probes.
    pub probes: usize,
    /// Bytes of the grid.
    pub grid_bytes: usize,
    /// Time of the bake's last stage, seconds.
    pub grid_seconds: f64,
    /// Noise of the truth itself.
    pub noise: f64,
    /// Error of the lights' resolution alone; empty where it was not asked for.
    pub lights_error: Option<f64>,
    /// Error of the grid.
    pub error: f64,
    /// Signed energy of the grid.
    pub energy: f64,
    /// Exact pairs a pixel.
    pub pairs: f64,
    /// Microseconds a pixel, refresh included.
    pub gather_us: f64,
}

/// Why there is no measurement.
#[derive(Debug, thiserror::Error)]
pub enum BreakdownError {
    /// The scene cannot be baked.
    #[error(transparent)]
    Bake(#[from] BakeError),
    /// No picture can be made.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// No truth can be had.
    #[error(transparent)]
    Truth(#[from] TruthError),
}

/// What to measure.
#[derive(Clone, Debug)]
pub struct BreakdownOptions {
    /// Pixels.
    pub size: (u32, u32),
    /// Directions per pixel of the truth.
    pub spp: u32,
    /// Directions per pixel of the `lights` column; 0 leaves it out.
    pub lights_spp: u32,
}

/// Bakes a scene and measures it from each camera.
///
/// # Errors
/// [`BreakdownError`] if there is no bake, picture or truth.
pub fn measure(
    name: &str,
    scene: &Scene,
    cameras: &[Camera],
    bake_options: &BakeOptions,
    truths: &Truths,
    options: &BreakdownOptions,
) -> Result<Vec<Row>, BreakdownError> {
    let baked = bake(scene, bake_options, &Silent)?;
    let trace = TraceScene::new(scene);
    let row = |camera: &Camera| {
        let view = View::new(&trace, camera, options.size);
        let truth = truths.truth(&view, options.spp)?;
        let start = Instant::now();
        let (picture, stats) = gather_by_grid(&trace, &baked.asset, &view.gbuffer, &Silent)?;
        let seconds = start.elapsed().as_secs_f64().min(stats.seconds.gather);
        let hit = view.hit();
        let compare = |image: &[Vec3]| -> Metrics {
            let width = options.size.0 as usize;
            compare(&Comparison { width, image, truth: &truth.irradiance, hit: &hit }).unwrap_or_default()
        };
        let lights_error = if options.lights_spp > 0 {
            let image = by_lights(&trace, &view, &baked, options.lights_spp)?;
            Some(compare(&image).relative_rmse)
        } else {
            None
        };
        let metrics = compare(&picture);
        let grid = &baked.report.grid;
        Ok(Row {
            scene: name.to_owned(),
            camera: camera.name.clone(),
            preset: bake_options.preset.name().to_owned(),
            lights: baked.asset.triangles.len(),
            probes: grid.probes,
            grid_bytes: grid.bytes,
            grid_seconds: baked.report.seconds.get("grid").copied().unwrap_or(0.0),
            noise: truth.noise,
            lights_error,
            error: metrics.relative_rmse,
            energy: metrics.signed_energy,
            pairs: stats.pairs_evaluated as f64 / metrics.pixels.max(1) as f64,
            gather_us: 1e6 * seconds / metrics.pixels.max(1) as f64,
        })
    };
    cameras.iter().map(row).collect()
}

/// Path tracing in which surface has the radiosity of its light.
fn by_lights(trace: &TraceScene, view: &View, baked: &Bake, spp: u32) -> Result<Vec<Vec3>, RenderError> {
    let lit = LitScene::new(trace, &baked.asset)?;
    let at = |(pixel, point): (usize, &Option<vlm_bake::shade::SurfacePoint>)| {
        point.as_ref().map_or(Vec3::ZERO, |point| {
            let row = vlm_bake::grid::transport(trace, &baked.stand_ins, point, spp, pixel as u64);
            row.iter().map(|&(light, share)| lit.radiosity[light as usize] * share).sum()
        })
    };
    Ok(view.gbuffer.points.par_iter().enumerate().map(at).collect())
}

/// The rows as a table.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| scene | camera | preset | lights | probes | grid MB | grid s | noise | lights | grid | energy | pairs | us/pixel |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for r in rows {
        let lights = r.lights_error.map_or_else(String::new, |e| format!("{e:.3}"));
        text += &format!(
            "| {} | {} | {} | {} | {} | {:.1} | {:.1} | {:.3} | {lights} | {:.3} | {:+.1} % | {:.1} | {:.2} |\n",
            r.scene,
            r.camera,
            r.preset,
            r.lights,
            r.probes,
            r.grid_bytes as f64 / 1e6,
            r.grid_seconds,
            r.noise,
            r.error,
            100.0 * r.energy,
            r.pairs,
            r.gather_us
        );
    }
    text
}

/// Truths of a scene's file, cached in a folder.
///
/// # Errors
/// If the folder cannot be made.
pub fn truths(cache: &Path, bytes: &[u8]) -> Result<Truths, TruthError> {
    Truths::new(cache, bytes)
}

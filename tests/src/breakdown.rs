//! What limits the static grid's accuracy, cause by cause, for each camera of some scenes.
//!
//! All errors are relative RMSE of indirect irradiance against the path-traced truth, at the pixels that show a surface:
//! `lights` traces the truth's rays but takes the radiosity of the light that stands where they end: what is left is the resolution of
//! lights and samples. `grid` is the method itself: interpolation of visibility and far light, and rays of the probes, come on top.
//! `algorithm` is the distance of `grid` from `lights`, relative to the latter: the exact sum over the same sources with visibility. The noise of
//! its rays, about the truth's, is in it.

use std::path::{Path, PathBuf};
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
use vlm_format::Grid;
use vlm_shaders::cpu::resolve::luminance;

use crate::method::View;
use crate::metrics::{Comparison, Metrics, compare};
use crate::pareto::false_colour::false_colour;
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
    /// Signed energy likewise.
    pub lights_energy: Option<f64>,
    /// Distance of the grid from the exact sum over its own sources with visibility.
    pub algorithm: Option<f64>,
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
    /// A picture cannot be written.
    #[error("{path}: {source}", path = path.display())]
    Picture {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: image::ImageError,
    },
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
    /// Folder for pictures of the signed error: its scale ends at the truth's mean.
    pub pictures: Option<PathBuf>,
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
        let compare = |image: &[Vec3], truth: &[Vec3]| -> Metrics {
            let width = options.size.0 as usize;
            compare(&Comparison { width, image, truth, hit: &hit }).unwrap_or_default()
        };
        let by_lights = if options.lights_spp > 0 {
            let image = traced_by_lights(&trace, &view, &baked, options.lights_spp)?;
            if let Some(folder) = &options.pictures {
                let path = folder.join(format!("{name}_{}_lights.png", camera.name));
                write_error(&path, options.size, &image, &truth.irradiance)?;
            }
            Some((compare(&image, &truth.irradiance), compare(&picture, &image)))
        } else {
            None
        };
        let metrics = compare(&picture, &truth.irradiance);
        if let Some(folder) = &options.pictures {
            let path = folder.join(format!("{name}_{}_{}.png", camera.name, bake_options.preset.name()));
            write_error(&path, options.size, &picture, &truth.irradiance)?;
        }
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
            lights_error: by_lights.map(|(lights, _)| lights.relative_rmse),
            lights_energy: by_lights.map(|(lights, _)| lights.signed_energy),
            algorithm: by_lights.map(|(_, algorithm)| algorithm.relative_rmse),
            error: metrics.relative_rmse,
            energy: metrics.signed_energy,
            pairs: stats.pairs_evaluated as f64 / metrics.pixels.max(1) as f64,
            gather_us: 1e6 * seconds / metrics.pixels.max(1) as f64,
        })
    };
    cameras.iter().map(row).collect()
}

/// Path tracing in which surface has the radiosity of its light.
fn traced_by_lights(
    trace: &TraceScene,
    view: &View,
    baked: &Bake,
    spp: u32,
) -> Result<Vec<Vec3>, RenderError> {
    let lit = LitScene::new(trace, &baked.asset)?;
    let no_grid = Grid::default();
    let radiosity = lit.source_radiosity(trace, baked.asset.grid.as_ref().unwrap_or(&no_grid));
    let at = |(pixel, point): (usize, &Option<vlm_bake::shade::SurfacePoint>)| {
        point.as_ref().map_or(Vec3::ZERO, |point| {
            let row = vlm_bake::grid::transport(trace, &baked.stand_ins, point, spp, pixel as u64);
            row.iter().map(|&(sample, share)| radiosity[sample as usize] * share).sum()
        })
    };
    Ok(view.gbuffer.points.par_iter().enumerate().map(at).collect())
}

/// The signed error of luminance over the truth's mean, blue too dark, red too bright.
fn write_error(
    path: &Path,
    (width, height): (u32, u32),
    picture: &[Vec3],
    truth: &[Vec3],
) -> Result<(), BreakdownError> {
    let mean = truth.iter().map(|&t| luminance(t)).sum::<f32>() / truth.len().max(1) as f32;
    let colour = |i: usize| false_colour(f64::from((luminance(picture[i]) - luminance(truth[i])) / mean));
    let pixels: Vec<u8> = (0..truth.len()).flat_map(colour).collect();
    image::save_buffer(path, &pixels, width, height, image::ExtendedColorType::Rgb8)
        .map_err(|source| BreakdownError::Picture { path: path.to_owned(), source })
}

/// The rows as a table.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| scene | camera | preset | lights | probes | grid MB | grid s | noise | lights | algorithm | grid | energy | pairs | us/pixel |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for r in rows {
        let lights = r.lights_error.zip(r.lights_energy);
        let lights =
            lights.map_or_else(String::new, |(e, energy)| format!("{e:.3}, {:+.1} %", 100.0 * energy));
        let algorithm = r.algorithm.map_or_else(String::new, |error| format!("{error:.3}"));
        text += &format!(
            "| {} | {} | {} | {} | {} | {:.1} | {:.1} | {:.3} | {lights} | {algorithm} | {:.3} | {:+.1} % | {:.1} | {:.2} |\n",
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

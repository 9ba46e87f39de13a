//! One bake from file to file, as `vlm bake` does it, in the process that is measured.

use std::path::Path;
use std::time::Instant;

use vlm_bake::bake::bake;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::scene::{LoadOptions, load};
use vlm_format::{GltfFile, Target, write_atomic, write_vlm};

use super::BakeBenchError;
use super::sample::{BAKE, ChildReport};
use crate::device::peak_memory;

/// Bakes a file into another, and says what it cost.
///
/// # Errors
/// [`BakeBenchError`] if the file cannot be read, baked or written.
pub fn run(input: &Path, output: &Path, preset: Preset) -> Result<ChildReport, BakeBenchError> {
    let start = Instant::now();
    let file = GltfFile::open(input)?;
    let scene = load(&file, &LoadOptions::default())?;
    let load = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let baked = bake(&scene, &BakeOptions::preset(preset, scene.triangles.len()), &Silent)?;
    let bake = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let outputs = write_vlm(&file, &baked.asset, &Target::from_path(output)?)?;
    write_atomic(&outputs, output.parent().unwrap_or(Path::new(".")))?;
    let write = start.elapsed().as_secs_f64();

    let whole = [("load", load), (BAKE, bake), ("write", write)];
    let stages = baked.report.seconds.iter().map(|(&stage, &seconds)| (stage, seconds));
    Ok(ChildReport {
        triangles: scene.triangles.len() as u64,
        lights: baked.report.lights as u64,
        seconds: whole.into_iter().chain(stages).map(|(phase, s)| (phase.to_owned(), s)).collect(),
        peak_bytes: peak_memory(),
    })
}

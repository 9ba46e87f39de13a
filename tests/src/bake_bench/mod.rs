//! Seconds of each stage of the bake and its peak memory against triangle count, `gltfpack -si 0.1` beside it.
//!
//! Each bake runs in a process of its own ([`child`]), so that its peak memory is its own. `gltfpack` (Kapoulkine) simplifies
//! the same file to a tenth of its triangles: no bake, but what artists know of the cost of such a step.

pub mod child;
pub mod sample;
mod gltfpack;
mod measure;
mod table;
mod figure;

pub use measure::{BakeBenchOptions, measure};
pub use sample::Run;
pub use table::summary;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::plot::PlotError;
use sample::Sample;

/// Why there is no measurement.
#[derive(Debug, thiserror::Error)]
pub enum BakeBenchError {
    /// There is no such scene.
    #[error("there is no scene `{0}`: name one of the repository's `assets` or of the test assets' `scenes`")]
    UnknownScene(String),
    /// A file is not readable or writable.
    #[error(transparent)]
    File(#[from] vlm_format::Error),
    /// A scene cannot be used.
    #[error(transparent)]
    Scene(#[from] vlm_bake::scene::Error),
    /// Nothing could be baked.
    #[error(transparent)]
    Bake(#[from] vlm_bake::bake::BakeError),
    /// A process could not be started, or a folder not be made.
    #[error("{what}: {source}")]
    Io {
        /// What was tried.
        what: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The bake's process failed.
    #[error("{input}: the bake failed: {message}")]
    Child {
        /// The file.
        input: String,
        /// What it said.
        message: String,
    },
    /// The samples cannot be written.
    #[error("{path}: {source}", path = path.display())]
    Csv {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: csv::Error,
    },
    /// A figure cannot be drawn or written.
    #[error(transparent)]
    Plot(#[from] PlotError),
}

/// Writes `raw.csv` (every sample), `table.md`, `bake_seconds` and `bake_memory` (SVG, PNG) into a folder that exists.
///
/// # Errors
/// [`BakeBenchError`] if a file cannot be written.
pub fn write(folder: &Path, run: &Run) -> Result<(), BakeBenchError> {
    let path = folder.join("raw.csv");
    write_samples(&path, run).map_err(|source| BakeBenchError::Csv { path, source })?;
    vlm_format::write_file(&folder.join("table.md"), summary(run).as_bytes())?;
    figure::write(folder, run)
}

/// A column for each phase that any sample has.
fn write_samples(path: &Path, run: &Run) -> Result<(), csv::Error> {
    let phases: BTreeSet<&str> =
        run.samples.iter().flat_map(|s| s.seconds.keys().map(String::as_str)).collect();
    let mut writer = csv::Writer::from_path(path)?;
    let fixed = ["input", "tool", "repeat", "triangles", "lights", "peak_bytes", "threads", "device"];
    let columns = phases.iter().map(|phase| format!("seconds_{phase}"));
    writer.write_record(fixed.iter().map(|&name| name.to_owned()).chain(columns))?;
    for sample in &run.samples {
        writer.write_record(record(sample, run, &phases))?;
    }
    Ok(writer.flush()?)
}

fn record(sample: &Sample, run: &Run, phases: &BTreeSet<&str>) -> Vec<String> {
    let optional = |value: Option<u64>| value.map_or_else(String::new, |v| v.to_string());
    let fixed = [
        sample.input.clone(),
        sample.tool.clone(),
        sample.repeat.to_string(),
        sample.triangles.to_string(),
        optional(sample.lights),
        optional(sample.peak_bytes),
        run.threads.to_string(),
        run.device.clone(),
    ];
    let seconds = |phase: &&str| sample.seconds.get(*phase).map_or_else(String::new, f64::to_string);
    fixed.into_iter().chain(phases.iter().map(seconds)).collect()
}

//! The thesis' lists of lights by cell, built in its way and by scattering: tests and seconds against lights and cells.
//!
//! All builds get the same lights, the same cells, the same reach and all threads. The thesis' tests every cell against every light
//! ([`crate::thesis::ThesisGrid`]); [`scatter`] lets each light visit the cells that it may reach, once all cells, once those that hold
//! visible surface, which it finds as part of its time. Where cells have a list in both, the lists are the same, and the
//! measurement fails if not. Aquotte 2017, table 5.2: 12.5 s for 100^3 cells and 100,000 lights on a graphics card.
//!
//! The baker builds no such lists: its grid ([`vlm_bake::grid`]) holds probes, which rays connect with what they see.

pub mod row;
mod lights;
mod span;
pub mod scatter;
mod measure;
mod table;
mod figure;

pub use measure::{GridOptions, measure};
pub use table::summary;

use std::path::{Path, PathBuf};

use crate::plot::PlotError;
use row::Row;

/// Why there is no measurement.
#[derive(Debug, thiserror::Error)]
pub enum GridBenchError {
    /// There is no such scene.
    #[error("there is no scene `{0}`: besides `room`, {hint}", hint = crate::pareto::scene::hint())]
    UnknownScene(String),
    /// A scene's file is not readable.
    #[error(transparent)]
    File(#[from] vlm_format::Error),
    /// A scene cannot be used.
    #[error(transparent)]
    Scene(#[from] vlm_bake::scene::Error),
    /// A scene has no lights.
    #[error("{scene}: {error}")]
    Bake {
        /// The scene's name.
        scene: String,
        /// The reason.
        error: vlm_bake::bake::BakeError,
    },
    /// A light belongs to no node of its scene.
    #[error("{scene}: {error}")]
    Lights {
        /// The scene's name.
        scene: String,
        /// The reason.
        error: vlm_bake::render::RenderError,
    },
    /// Two builds of one grid disagree.
    #[error(
        "{scene}, {lights} lights, {cells} cells along each axis: `{builder}` disagrees with the thesis' lists: {how}"
    )]
    Differ {
        /// The scene's name.
        scene: String,
        /// Lights in the grid.
        lights: usize,
        /// Cells along every axis.
        cells: u32,
        /// The build.
        builder: &'static str,
        /// Where.
        how: String,
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

/// Writes `raw.csv` (every sample), `table.md` and `SCENE_grid` (SVG, PNG) into a folder that exists.
///
/// # Errors
/// [`GridBenchError`] if a file cannot be written.
pub fn write(folder: &Path, rows: &[Row], options: &GridOptions) -> Result<(), GridBenchError> {
    let path = folder.join("raw.csv");
    write_rows(&path, rows).map_err(|source| GridBenchError::Csv { path, source })?;
    vlm_format::write_file(&folder.join("table.md"), summary(rows, options).as_bytes())?;
    figure::write(folder, rows)
}

fn write_rows(path: &Path, rows: &[Row]) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_path(path)?;
    rows.iter().try_for_each(|row| writer.serialize(row))?;
    Ok(writer.flush()?)
}

//! One line of `raw.csv`: one build of one grid.

use serde::{Deserialize, Serialize};

/// The thesis' build: every cell tests every light.
pub const THESIS: &str = "thesis";

/// The same lists, by lights that visit the cells that they may reach.
pub const SCATTER: &str = "scatter";

/// The same, for cells that hold visible surface alone.
pub const SURFACE: &str = "scatter to surface";

/// All builds.
pub const BUILDERS: [&str; 3] = [THESIS, SCATTER, SURFACE];

/// One sample. Every repeat is a row of its own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The scene's name.
    pub scene: String,
    /// Triangles of the scene's surface.
    pub triangles: u64,
    /// Lights in the grid.
    pub lights: u64,
    /// Cells along every axis.
    pub cells_per_axis: u32,
    /// Reach of a light over its radius.
    pub range: f32,
    /// One of [`BUILDERS`].
    pub builder: String,
    /// Number of the interleaved repeat, from 0.
    pub repeat: u32,
    /// Wall time of the build, seconds.
    pub seconds: f64,
    /// Pairs of a cell and a light that were tested, and rows of cells that were left out as a whole.
    pub tests: u64,
    /// Cells of the box.
    pub cells: u64,
    /// Cells that have a list.
    pub stored_cells: u64,
    /// Ids in all lists, padding not counted.
    pub entries: u64,
    /// Pairs of a cell and a light that did not fit.
    pub dropped: u64,
    /// Bytes of the lists and of what finds them.
    pub bytes: u64,
    /// Threads that the build may use.
    pub threads: u32,
    /// The processor, in its own words.
    pub device: String,
}

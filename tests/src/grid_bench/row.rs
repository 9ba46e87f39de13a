//! One line of `raw.csv`: one build of one grid.

use serde::{Deserialize, Serialize};

/// Name of our build.
pub const OURS: &str = "ours";

/// Name of the thesis' build.
pub const THESIS: &str = "thesis";

/// One sample. Every repeat is a row of its own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The scene's name.
    pub scene: String,
    /// Triangles of the scene's surface.
    pub triangles: u64,
    /// Lights in the grid.
    pub lights: u64,
    /// Cells along the longest axis; ours are cubes, the thesis has this many along every axis.
    pub cells_per_axis: u32,
    /// Reach of a light over its radius.
    pub range: f32,
    /// [`OURS`] or [`THESIS`].
    pub builder: String,
    /// Number of the interleaved repeat, from 0.
    pub repeat: u32,
    /// Wall time of the build, seconds.
    pub seconds: f64,
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

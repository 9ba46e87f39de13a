//! What a bake made, as `--report` writes it. Other tools read these keys.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use crate::flux::ObjectFlux;
use crate::tag::TagReport;
use crate::verify::ClearanceReport;

/// The report of one bake.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Report {
    /// Triangles of the visible scene.
    pub visible_triangles: usize,
    /// Budget of lights.
    pub asked_lights: u32,
    /// Lights made.
    pub lights: usize,
    /// Why the budget was missed by more than 5 %, empty if it was met.
    pub missed_because: String,
    /// Of these, made by artists.
    pub authored_lights: usize,
    /// Samples over all lights.
    pub samples: usize,
    /// What decimation reached.
    pub decimation: DecimationReport,
    /// How far the lights moved.
    pub offset: OffsetReport,
    /// The proof that no light lights the surface that it stands for.
    pub clearance: ClearanceReport,
    /// Why a receiver may ignore some lights.
    pub tags: Vec<TagReport>,
    /// Total area of the lights, and of those that carry a tag, square metres.
    pub area: AreaReport,
    /// What each object sends out, and what its lights do.
    pub flux: Vec<ObjectFlux>,
    /// The grid, all 0 if the asset has none.
    pub grid: GridReport,
    /// Seconds per stage that ran, in alphabetical order of the stages.
    pub seconds: BTreeMap<&'static str, f64>,
    /// Stages that did not run, since nothing changed for them after the last bake. Only a watcher remembers that.
    pub reused: Vec<&'static str>,
    /// BLAKE3 of the written file, empty before it is written.
    pub hash: String,
    /// What was left out or guessed while the scene was read.
    pub notes: Vec<String>,
}

/// Decimation in figures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct DecimationReport {
    /// Faces asked for.
    pub asked: usize,
    /// Faces reached, after coplanar ones were merged.
    pub reached: usize,
    /// The simplifier's error, metres.
    pub error_m: f64,
    /// Mean distance of the surface from the faces that stand for it, metres.
    pub mean_m: f64,
    /// The distance that 99 % of the covered surface keeps, metres.
    pub p99_m: f64,
}

/// The offset in figures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct OffsetReport {
    /// Mean over the vertices, metres.
    pub mean_m: f64,
    /// Greatest, metres.
    pub max_m: f64,
}

/// Areas in figures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct AreaReport {
    /// Area of the surface that reflects or emits, square metres.
    pub visible_m2: f64,
    /// Part of it for which no light stands: what was too small for the budget.
    pub uncovered_m2: f64,
    /// Area of all lights, square metres.
    pub lights_m2: f64,
    /// Area of the lights that carry a tag, square metres.
    pub tagged_m2: f64,
    /// Area of the visible surface that some tag keeps dark from these lights, square metres; both sides of two-sided surface.
    pub covered_by_tags_m2: f64,
}

/// The grid in figures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct GridReport {
    /// Cells that list probes.
    pub leaves: usize,
    /// Probes, on surface and in free space.
    pub probes: usize,
    /// Lights over all leaves' lists of near lights.
    pub near_entries: usize,
    /// Entries over all rows of far light.
    pub far_entries: usize,
    /// Bytes in the file.
    pub bytes: usize,
}

//! What is measured: one process over one file.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// The tool of this project.
pub const VLM: &str = "vlm";

/// The tool beside it.
pub const GLTFPACK: &str = "gltfpack";

/// Phase: from the start of the process to its end, as the one that started it sees it.
pub const PROCESS: &str = "process";

/// Phase: all stages of the bake.
pub const BAKE: &str = "bake";

/// Phases of our process in their order: reading, the stages of [`vlm_bake::bake::bake`], writing.
pub const PHASES: [&str; 9] =
    ["load", "patches", "decimate", "mend", "samples", "authored", "tag", "grid", "write"];

/// One sample. Every repeat is one of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// `room` or the scene's name.
    pub input: String,
    /// [`VLM`] or [`GLTFPACK`].
    pub tool: String,
    /// Number of the interleaved repeat, from 0.
    pub repeat: u32,
    /// Triangles of the scene.
    pub triangles: u64,
    /// Lights made, by us alone.
    pub lights: Option<u64>,
    /// Seconds by phase.
    pub seconds: BTreeMap<String, f64>,
    /// The most memory the process had resident, bytes; `None` where the system does not tell, and for other tools.
    pub peak_bytes: Option<u64>,
}

/// A whole measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Everything in `raw.csv`.
    pub samples: Vec<Sample>,
    /// The version of `gltfpack`, or why there is none.
    pub gltfpack: Result<String, String>,
    /// Scenes that are not on this machine.
    pub absent: Vec<String>,
    /// The preset of the bakes.
    pub preset: String,
    /// Threads that a bake may use.
    pub threads: usize,
    /// The processor, in its own words.
    pub device: String,
}

impl Default for Run {
    fn default() -> Self {
        Self {
            samples: Vec::new(),
            gltfpack: Err("not looked for".to_owned()),
            absent: Vec::new(),
            preset: String::new(),
            threads: 0,
            device: String::new(),
        }
    }
}

/// What a child reports of its bake, as JSON on stdout.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ChildReport {
    /// Triangles of the scene.
    pub triangles: u64,
    /// Lights made.
    pub lights: u64,
    /// Seconds by phase.
    pub seconds: BTreeMap<String, f64>,
    /// The most memory the process had resident, bytes.
    pub peak_bytes: Option<u64>,
}

//! One line of `raw.csv`: one picture by one method at one setting of its knob, what it cost and how wrong it is.

use serde::{Deserialize, Serialize};

/// One sample of a run. Every repeat is a row of its own, so that medians and their spread can be recomputed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The scene's name.
    pub scene: String,
    /// The camera's name.
    pub camera: String,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The method's name.
    pub method: String,
    /// The setting of the method's knobs: `key=value` pairs, separated by spaces; empty without knobs.
    pub knob: String,
    /// `cpu` or `gpu`.
    pub backend: String,
    /// The processor or graphics card, in its driver's words.
    pub device: String,
    /// Number of the interleaved repeat, from 0.
    pub repeat: u32,
    /// Lights that the method uses: virtual area lights, virtual point lights, or probes.
    pub lights: u32,
    /// Pairs of a pixel and a light (or probe) evaluated.
    pub pairs: u64,
    /// Rays traced by the method per frame, both phases.
    pub rays: u64,
    /// Bytes that the method keeps for the frame beside the scene.
    pub bytes: u64,
    /// What happens once per scene (bake, grid, probe placement), seconds.
    pub seconds_prepare: f64,
    /// Phase 1, per frame: light arrives at lights or probes, seconds.
    pub seconds_inject: f64,
    /// Phase 2, per frame: indirect light of every pixel, seconds.
    pub seconds_gather: f64,
    /// Model error: relative RMSE against the path-traced truth.
    pub relative_rmse: f64,
    /// `mean((a - b)^2 / (b^2 + e^2))`.
    pub rel_mse: f64,
    /// Mean FLIP of the shown pictures, 0 to 1.
    pub flip: f64,
    /// `sum(a) / sum(b) - 1`.
    pub signed_energy: f64,
    /// 99th percentile of the luminance's error over the truth's mean.
    pub p99: f64,
    /// Largest difference of the error between neighbouring pixels over the truth's mean.
    pub largest_jump: f64,
    /// RMS of the change between two frames of a still scene over the truth's RMS: noise that a player sees.
    pub frame_change: f64,
    /// Algorithm error: relative RMSE against the exact f64 sum over the same lights; empty where a method has no area lights.
    pub algorithm_rmse: Option<f64>,
    /// Directions per pixel of the truth.
    pub truth_spp: u32,
    /// Relative RMSE of the truth's own noise, estimated from two independent halves.
    pub truth_noise: f64,
    /// True if the truth's noise is below a third of this row's relative RMSE.
    pub truth_suffices: bool,
}

impl Row {
    /// Time of a frame, seconds: both phases.
    #[must_use]
    pub fn frame_seconds(&self) -> f64 {
        self.seconds_inject + self.seconds_gather
    }
}

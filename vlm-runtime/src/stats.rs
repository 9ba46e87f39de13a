//! What a frame took, so that what is skipped shows.

use serde::Serialize;

/// What a frame took.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FrameStats {
    /// The frame's number since loading, from 1.
    pub frame: u64,
    /// The passes that ran, in order: `shadow`, `direct`, `inject`, `refresh`,
    /// `refresh_free`, `gather`.
    pub passes: Vec<&'static str>,
    /// Lights of the asset.
    pub lights: u32,
    /// Lights whose direct light was found anew.
    pub lights_injected: u32,
    /// Lights whose direct light was not. With those above, they are all.
    pub lights_skipped: Skipped,
    /// Probes of the grid.
    pub probes: u32,
    /// Probes at which arriving light was found anew: all, or those that a change may reach.
    pub probes_refreshed: u32,
    /// Shadow maps that were read, since they changed.
    pub shadow_maps: u32,
    /// Pairs of a pixel and a light whose geometry was read, so without lights that are black in this frame, and those of the pixel's tag; by [`crate::VlmRenderer::pairs_evaluated`].
    pub pairs_evaluated: Option<u64>,
    /// Written to the device since the frame before, loading included.
    pub bytes_uploaded: u64,
    /// Light comes through the grid.
    pub uses_grid: bool,
    /// Tags are looked at.
    pub uses_tags: bool,
    /// What moves is lit by probes in free space.
    pub uses_free_probes: bool,
    /// The times of the newest frame that the device has told about, mostly a frame or two ago; `None` before the first, without
    /// [`crate::Settings::time_passes`], and on devices without `TIMESTAMP_QUERY`.
    pub times: Option<FrameTimes>,
}

/// How long the passes of a frame took on the device.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FrameTimes {
    /// [`FrameStats::frame`].
    pub frame: u64,
    /// In order.
    pub passes: Vec<PassTime>,
}

/// How long a pass took on the device.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PassTime {
    /// As in [`FrameStats::passes`].
    pub pass: &'static str,
    /// From the end of the pass before to its own end, for the first pass from its beginning, seconds: together they are the frame's. Software
    /// devices tell the wall's time, and some stamp the first beginning too late.
    pub seconds: f64,
}

/// Lights whose direct light was not found anew, by reason. Tags leave out pairs of a pixel and a light, not lights: see
/// [`FrameStats::pairs_evaluated`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Skipped {
    /// Some real light reaches them, but none that changed.
    pub unchanged: u32,
    /// Their surface reflects nothing.
    pub black: u32,
    /// No real light reaches them, by its range.
    pub unlit: u32,
}

//! What a frame took, so that what is skipped shows.

use serde::Serialize;

/// What a frame took.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FrameStats {
    /// The passes that ran, in order: `direct`, `inject`, `refresh`, `gather`.
    pub passes: Vec<&'static str>,
    /// Lights of the asset.
    pub lights: u32,
    /// Lights whose direct light was found anew.
    pub lights_injected: u32,
    /// Lights whose direct light was not.
    pub lights_skipped: Skipped,
    /// Pairs of a pixel and a light whose geometry was read; by [`crate::VlmRenderer::pairs_evaluated`].
    pub pairs_evaluated: Option<u64>,
    /// Written to the device since the frame before, loading included.
    pub bytes_uploaded: u64,
    /// Light comes through the grid.
    pub uses_grid: bool,
    /// Tags are looked at.
    pub uses_tags: bool,
}

/// Lights whose direct light was not found anew, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Skipped {
    /// Nothing that lights them changed.
    pub unchanged: u32,
    /// Their surface reflects nothing.
    pub black: u32,
}

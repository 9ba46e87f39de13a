//! What can go wrong, with the number or the name that tells what to do about it.

use vlm_format::Stale;

/// Why there is no indirect light.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No adapter, not even a software one.
    #[error("no adapter: install a driver (Debian: mesa-vulkan-drivers and libvulkan1): {0}")]
    NoAdapter(String),
    /// The adapter gives no device, or the device was lost.
    #[error("the GPU failed: {0}")]
    Device(String),
    /// Something is larger than the device allows.
    #[error("{what} takes {needed}, {} more than the device's {limit}: ask for a higher `{name}`, or bake with fewer lights or probes", needed - limit)]
    Limit {
        /// What is too large.
        what: String,
        /// The limit's name in `wgpu::Limits`, or of a constant of this crate.
        name: &'static str,
        /// What is needed.
        needed: u64,
        /// What there is.
        limit: u64,
    },
    /// The file changed since its lights were made; each entry says which VLM no longer fits and why.
    #[error("{file}: the Virtual Light Mesh is stale, bake the file again: {}", reasons(stale))]
    Stale {
        /// Name of the file.
        file: String,
        /// Every VLM that no longer fits.
        stale: Vec<Stale>,
    },
    /// The file could not be read or breaks the rules of its format.
    #[error(transparent)]
    Format(vlm_format::Error),
    /// The file has no Virtual Light Mesh.
    #[error("{file}: there is no Virtual Light Mesh: bake the file first, `vlm bake {file} -o OUT`")]
    NoLights {
        /// Name of the file.
        file: String,
    },
    /// A frame was asked for before [`crate::VlmRenderer::load`].
    #[error("no asset is loaded: call `VlmRenderer::load` first")]
    NotLoaded,
    /// A frame was recorded before [`crate::VlmRenderer::prepare`].
    #[error("the frame is not prepared: call `VlmRenderer::prepare` first")]
    NotPrepared,
    /// Visibility does not have one number for each real light and point.
    #[error("visibility has {found} numbers, but {lights} lights and {points} points need {}", u64::from(*lights) * u64::from(*points))]
    VisibilityLength {
        /// Numbers given.
        found: u64,
        /// Real lights of the frame.
        lights: u32,
        /// Points: see [`crate::VlmRenderer::points`].
        points: u32,
    },
    /// Nodes move, but [`crate::Settings::moving_nodes`] is off.
    #[error("nodes move, but `Settings::moving_nodes` is off: switch it on before the asset is loaded")]
    MovingOff,
    /// A node that moves bears no VLM.
    #[error("node {node} moves, but bears no Virtual Light Mesh")]
    UnknownNode {
        /// Index of the glTF node.
        node: u32,
    },
    /// A shadow map belongs to no light of the frame.
    #[error("shadow map {map} is of light {light}, but the frame has {lights} lights")]
    UnknownLight {
        /// The map's number in [`crate::Visibility::Maps`].
        map: u32,
        /// [`crate::ShadowMap::light`].
        light: u32,
        /// Real lights of the frame.
        lights: u32,
    },
    /// A number of the frame is infinite or not a number.
    #[error("{what} is not finite")]
    NotFinite {
        /// Which.
        what: String,
    },
    /// A texture has another size or format than the irradiance needs.
    #[error("the {what} texture is {found}, it must be {expected}")]
    Target {
        /// Which texture.
        what: &'static str,
        /// What it is.
        found: String,
        /// What it must be.
        expected: String,
    },
    /// [`crate::Settings::count_pairs`] is off.
    #[error("pairs are not counted: switch `Settings::count_pairs` on")]
    CountingOff,
}

impl From<vlm_format::Error> for Error {
    fn from(error: vlm_format::Error) -> Self {
        match error {
            vlm_format::Error::Stale { file, stale } => Self::Stale { file, stale },
            other => Self::Format(other),
        }
    }
}

fn reasons(stale: &[Stale]) -> String {
    let reasons: Vec<String> = stale.iter().map(|stale| format!("{}: {}", stale.vlm, stale.reason)).collect();
    reasons.join("; ")
}

/// An error where something takes more than there is.
pub(crate) fn within(what: &str, name: &'static str, needed: u64, limit: u64) -> Result<(), Error> {
    if needed <= limit { Ok(()) } else { Err(Error::Limit { what: what.to_owned(), name, needed, limit }) }
}

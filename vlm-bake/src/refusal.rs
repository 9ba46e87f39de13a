//! Why nothing could be baked.

use crate::ground::Ground;
use crate::options::BakeOptions;
use crate::patches::Patches;
use crate::slivers::MAX_ASPECT;
use crate::topology::aspect_ratio;

/// Why nothing could be baked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BakeError {
    /// No surface reflects or emits.
    #[error(
        "no surface reflects or emits light, so there is nothing to bake: every material is black, blended or transmissive, or \
         every object is excluded by `extras.vlm`. Give at least one surface an opaque material that is not black"
    )]
    NothingReflects,
    /// No light could be placed, or none is left.
    #[error("no light is left of the {asked} asked for: {reason}")]
    NothingLeft {
        /// The budget.
        asked: u32,
        /// What is in the way, and what to do.
        reason: String,
    },
    /// [`crate::progress::Progress::is_cancelled`] said so.
    #[error("the bake was cancelled")]
    Cancelled,
}

/// A scene narrower than so many times the depth at which lights must lie has no room for them.
const LEAST_EXTENT: f64 = 100.0;

/// The refusal of a scene without a light that could be placed; `hidden` is the number of derived ones before authored meshes took some away.
pub(crate) fn nothing_left(
    patches: &Patches,
    ground: &Ground,
    hidden: usize,
    options: &BakeOptions,
) -> BakeError {
    let (low, high) = patches
        .positions
        .iter()
        .fold((glam::DVec3::INFINITY, glam::DVec3::NEG_INFINITY), |(l, h), &p| (l.min(p), h.max(p)));
    let extent = (high - low).max_element();
    let thin = |t: usize| aspect_ratio(patches.corners(t)) > MAX_ASPECT;
    let reason = if hidden > 0 {
        "authored meshes take all of them away; make the meshes whose `extras.vlm.mode` is subtract or both smaller".to_owned()
    } else if extent < LEAST_EXTENT * ground.clearance {
        format!(
            "the surface is {extent:.3} m wide, and something so far away that single precision knows places to {:.3} m only; move the \
             scene to the origin, and remove what lies far from it",
            ground.clearance
        )
    } else if (0..patches.triangles.len()).all(thin) {
        format!("all triangles are more than {MAX_ASPECT} times as long as high; divide them")
    } else {
        "the surface falls into pieces that are too small for so few, or too flat to hide any; ask for more lights, or leave out what is \
         tiny or flattened"
            .to_owned()
    };
    BakeError::NothingLeft { asked: options.lights, reason }
}

//! Why nothing could be baked.

use glam::DVec3;

use crate::ground::Ground;
use crate::options::BakeOptions;
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
pub(crate) fn nothing_left(ground: &Ground, hidden: usize, options: &BakeOptions) -> BakeError {
    let reason = if hidden > 0 {
        "authored meshes take all of them away; make the meshes whose `extras.vlm.mode` is subtract or both smaller".to_owned()
    } else {
        no_room(ground).unwrap_or_else(|| {
            "the surface is too flat, or in pieces too small, to hide any; leave out what is flattened, or ask for more lights".to_owned()
        })
    };
    BakeError::NothingLeft { asked: options.lights, reason }
}

/// Why no number of lights fits behind the surface.
pub(crate) fn no_room(ground: &Ground) -> Option<String> {
    let patches = ground.patches;
    let boxed = |(low, high): (DVec3, DVec3), &place: &DVec3| (low.min(place), high.max(place));
    let (low, high) = patches.positions.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), boxed);
    let extent = (high - low).max_element();
    if extent < LEAST_EXTENT * ground.clearance {
        return Some(format!(
            "the surface is {extent:.3} m wide, but all that is drawn reaches so far that single precision knows places to {:.3} m; move the \
             scene to the origin, and remove what lies far from it",
            ground.clearance
        ));
    }
    let thin = |t: usize| aspect_ratio(patches.corners(t)) > MAX_ASPECT;
    (0..patches.triangles.len())
        .all(thin)
        .then(|| format!("all triangles are more than {MAX_ASPECT} times as long as high; divide them"))
}

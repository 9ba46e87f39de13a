//! The scenes of a run by name.

use std::path::{Path, PathBuf};

use crate::assets;

/// Size of the pictures of scenes in the repository, pixels: a run of all methods takes less than 5 minutes on two cores.
const ROOM_SIZE: (u32, u32) = (192, 192);

/// Size of the pictures of larger scenes: a run of all methods takes less than 20 minutes.
const HALL_SIZE: (u32, u32) = (256, 144);

/// The file of a scene: one of the repository's, else one of the test assets; `None` if there is none.
#[must_use]
pub fn file(name: &str) -> Option<PathBuf> {
    let own = own_file(name);
    if own.exists() {
        return Some(own);
    }
    let full_name = if name == "dungeon" { "dungeon_kaykit" } else { name };
    assets::find(&format!("scenes/{full_name}.glb"))
}

/// The size of its pictures unless the user names one.
#[must_use]
pub fn default_size(name: &str) -> (u32, u32) {
    if own_file(name).exists() { ROOM_SIZE } else { HALL_SIZE }
}

fn own_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets").join(format!("{name}.glb"))
}

//! The scenes of a run by name.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::DVec3;
use vlm_bake::scene::{Camera, Projection, look as look_from};

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
    assets::look(&format!("scenes/{full_name}.glb"))
}

/// The size of its pictures unless the user names one.
#[must_use]
pub fn default_size(name: &str) -> (u32, u32) {
    if own_file(name).exists() { ROOM_SIZE } else { HALL_SIZE }
}

/// Cameras beside those of a scene's file: Sponza's lower arcade and upper gallery.
#[must_use]
pub fn more_cameras(name: &str) -> Vec<Camera> {
    let look = |name: &str, from: DVec3, to: DVec3| Camera {
        name: name.to_owned(),
        world_from_view: look_from(from, (from - to).normalize_or_zero()),
        projection: Projection::Perspective(1.0),
    };
    if name == "sponza" {
        vec![
            look("arcade", DVec3::new(-9.0, 1.8, 4.4), DVec3::new(4.0, 1.6, 4.2)),
            look("gallery", DVec3::new(9.0, 6.0, -4.6), DVec3::new(-4.0, 5.6, -4.2)),
        ]
    } else {
        Vec::new()
    }
}

fn own_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets")
}

fn own_file(name: &str) -> PathBuf {
    own_folder().join(format!("{name}.glb"))
}

/// The names of all scenes that [`file()`] finds now, sorted.
#[must_use]
pub fn known() -> Vec<String> {
    let folders = assets::roots().map(|root| root.join("scenes")).chain([own_folder()]);
    // A folder that is not there or not readable has no scenes.
    let entries = folders.filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten();
    let names = entries.filter_map(|entry| {
        let path = entry.path();
        let is_scene = path.extension().is_some_and(|extension| extension == "glb");
        is_scene.then(|| path.file_stem().map(|stem| stem.to_string_lossy().into_owned()))?
    });
    names.collect::<BTreeSet<_>>().into_iter().collect()
}

/// What a message about a scene that is not there should add.
pub(crate) fn hint() -> String {
    format!(
        "there are {}; the environment variable VLM_ASSETS names the folder whose `scenes` holds more",
        known().join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_scenes_are_found() {
        let known = known();
        assert!(known.iter().any(|name| name == "cornell"), "{known:?}");
        assert!(known.iter().all(|name| file(name).is_some()), "{known:?}");
        assert_eq!(file("nowhere"), None);
        assert!(hint().contains("cornell") && hint().contains("VLM_ASSETS"));
    }
}

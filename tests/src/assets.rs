//! Where the scenes and odd files are that tests run on; they are not part of the repository.

use std::path::{Path, PathBuf};

/// A file or folder of the test assets, `VLM_ASSETS` first, then `../shared/assets` beside the repository.
///
/// Where it is absent, says so on stderr and returns `None`: the test then returns, and reads "ignored".
pub fn find(relative: &str) -> Option<PathBuf> {
    let found = look(relative);
    if found.is_none() {
        eprintln!("ignored: `{relative}` is neither in VLM_ASSETS nor in ../shared/assets");
    }
    found
}

/// As [`find`], without a word where it is absent: for programs, which have an error of their own for it.
#[must_use]
pub fn look(relative: &str) -> Option<PathBuf> {
    roots().map(|root| root.join(relative)).find(|path| path.exists())
}

/// The .glb and .gltf files of a folder and those below it, by path.
#[must_use]
pub fn gltf_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    collect(folder, &mut found);
    found.sort();
    found
}

fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    for path in folder.read_dir().into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path())) {
        if path.is_dir() {
            collect(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "glb" || extension == "gltf") {
            found.push(path);
        }
    }
}

/// The folders in which assets may be, in the order in which they are asked.
pub(crate) fn roots() -> impl Iterator<Item = PathBuf> {
    let beside = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/assets");
    std::env::var_os("VLM_ASSETS").map(PathBuf::from).into_iter().chain([beside])
}

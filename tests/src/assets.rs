//! Where the scenes and odd files are that tests run on; they are not part of the repository.

use std::path::PathBuf;

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

/// The folders in which assets may be, in the order in which they are asked.
pub(crate) fn roots() -> impl Iterator<Item = PathBuf> {
    let beside = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/assets");
    std::env::var_os("VLM_ASSETS").map(PathBuf::from).into_iter().chain([beside])
}

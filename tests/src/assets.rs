//! Where the scenes and odd files are that tests run on; they are not part of the repository.
//!
//! A test that needs them bears `#[cfg_attr(not(has_scenes), ignore = "...")]`, or `has_corpus`.

use std::path::PathBuf;

/// A file or folder of the test assets: in `VLM_ASSETS` as it was at build time, else in `../shared/assets` beside the
/// repository. It need not exist.
#[must_use]
pub fn path(relative: &str) -> PathBuf {
    PathBuf::from(env!("VLM_ASSETS_FOLDER")).join(relative)
}

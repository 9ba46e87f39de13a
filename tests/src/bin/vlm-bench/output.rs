//! Where commands write.

use std::error::Error;
use std::path::Path;

/// Makes a folder, and those above it.
///
/// # Errors
/// The folder and the system's reason.
pub fn make_folder(folder: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder).map_err(|error| {
        let folder = folder.display();
        format!("cannot create the folder {folder}: {error}; name a folder that can be written").into()
    })
}

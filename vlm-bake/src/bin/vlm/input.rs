//! What all commands read: a file, or a pipe.

use std::io::{Read, stdin};
use std::path::{Path, PathBuf};

use vlm_format::{Error, GltfFile};

use crate::error::CliError;

/// True for `-`, which stands for standard input or output.
pub fn is_pipe(path: &Path) -> bool {
    path == Path::new("-")
}

/// Reads a glTF file, or standard input.
///
/// # Errors
/// If it cannot be read, or is not valid glTF.
pub fn open(input: &Path) -> Result<GltfFile, CliError> {
    Ok(open_checked(input)?)
}

/// As [`open`], with every problem of the file in the error.
///
/// # Errors
/// As [`open`].
pub fn open_checked(input: &Path) -> Result<GltfFile, Error> {
    if !is_pipe(input) {
        return GltfFile::open(input);
    }
    let mut bytes = Vec::new();
    let read = stdin().lock().read_to_end(&mut bytes);
    read.map_err(|source| Error::Io { path: PathBuf::from("standard input"), action: "read", source })?;
    GltfFile::from_slice(&bytes, "standard input", None)
}

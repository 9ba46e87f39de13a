//! What all commands read: a file, or a pipe.

use std::io::{Read, stdin};
use std::path::Path;

use vlm_format::GltfFile;

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
    if !is_pipe(input) {
        return Ok(GltfFile::open(input)?);
    }
    let mut bytes = Vec::new();
    stdin().lock().read_to_end(&mut bytes).map_err(|e| CliError::usage(format!("standard input: {e}")))?;
    Ok(GltfFile::from_slice(&bytes, "standard input", None)?)
}

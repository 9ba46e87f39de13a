//! What `vlm check` checks: files, the glTF files below folders, and those that globs match.

use std::path::PathBuf;

use vlm_bake::inputs::{InputsError, inputs};

use crate::error::CliError;

/// The files that names stand for, those of a folder sorted. What is not there stays in the list: it is to be reported as one file among
/// others.
///
/// # Errors
/// If a folder or glob holds no glTF file: a check of nothing would pass.
pub fn gltf_files(names: &[PathBuf]) -> Result<Vec<PathBuf>, CliError> {
    let mut files = Vec::new();
    for name in names {
        match inputs(std::slice::from_ref(name), &[]) {
            Ok(found) => files.extend(found.into_iter().map(|input| input.path)),
            Err(InputsError::Missing { .. }) => files.push(name.clone()),
            Err(error) => return Err(CliError::usage(error.to_string())),
        }
    }
    Ok(files)
}

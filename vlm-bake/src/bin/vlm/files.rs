//! Inputs by file or folder.

use std::fs;
use std::path::{Path, PathBuf};

use crate::error::CliError;

/// The glTF files that paths stand for: a file for itself, a folder for every .glb and .gltf below it, sorted by path. Links to folders are
/// not followed: they may lead in circles.
///
/// # Errors
/// If a folder cannot be read, or holds no glTF file: a check of nothing would pass.
pub fn gltf_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, CliError> {
    let mut files = Vec::new();
    for path in paths {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let before = files.len();
        collect(path, &mut files)?;
        if files.len() == before {
            let path = path.display();
            return Err(CliError::usage(format!(
                "{path}: there is no .glb or .gltf file in this folder or below; name another"
            )));
        }
        files[before..].sort();
    }
    Ok(files)
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), CliError> {
    let io = |source| {
        CliError::from(vlm_format::Error::Io { path: folder.to_owned(), action: "list the folder", source })
    };
    for entry in fs::read_dir(folder).map_err(io)? {
        let entry = entry.map_err(io)?;
        let path = entry.path();
        if entry.file_type().map_err(io)?.is_dir() {
            collect(&path, files)?;
        } else if is_gltf(&path) && path.is_file() {
            files.push(path);
        }
    }
    Ok(())
}

fn is_gltf(path: &Path) -> bool {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    extension.eq_ignore_ascii_case("glb") || extension.eq_ignore_ascii_case("gltf")
}

//! What all commands write: files, pipes and lines.

use std::fmt::Display;
use std::io::{ErrorKind, Write, stdout};
use std::path::Path;

use vlm_format::{Container, OutputFile, Target, write_atomic, write_file};

use crate::error::CliError;
use crate::input::is_pipe;

/// The container that the output's name asks for; a pipe gets a .glb.
///
/// # Errors
/// If the name is neither .glb nor .gltf.
pub fn target(output: &Path) -> Result<Target, CliError> {
    if is_pipe(output) {
        return Ok(Target { container: Container::Glb, file_name: "baked.glb".to_owned() });
    }
    Target::from_path(output).map_err(|error| CliError::usage(error.to_string()))
}

/// The folder of a path, `.` for a bare name.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Says at once, not after the work, that the folder to write into does not exist.
///
/// # Errors
/// If it does not; a pipe needs none.
pub fn check_folder(path: &Path) -> Result<(), CliError> {
    let folder = folder_of(path);
    if is_pipe(path) || folder.is_dir() {
        return Ok(());
    }
    Err(CliError::usage(format!(
        "{}: cannot be written: the folder {} does not exist; create it, or name another",
        path.display(),
        folder.display()
    )))
}

/// Writes the files of an output into the folder of `output`, or the only one into the pipe.
///
/// # Errors
/// If they cannot be written; files then are as they were.
pub fn deliver(output: &Path, files: &[OutputFile]) -> Result<(), CliError> {
    if !is_pipe(output) {
        return Ok(write_atomic(files, folder_of(output))?);
    }
    let mut pipe = stdout().lock();
    let sent = files.iter().try_for_each(|file| pipe.write_all(&file.bytes)).and_then(|()| pipe.flush());
    sent.map_err(|error| pipe_broken(&error))
}

/// Prints lines of a report on stdout. A reader that closes the pipe early, such as `head`, has seen what it wanted.
///
/// # Errors
/// If stdout cannot be written for another reason.
pub fn print(lines: &[impl Display]) -> Result<(), CliError> {
    let lines: String = lines.iter().map(|line| format!("{line}\n")).collect();
    print_bytes(lines.as_bytes())
}

/// Prints text that is already in lines, as [`print()`] does.
///
/// # Errors
/// As [`print()`].
pub fn print_bytes(text: &[u8]) -> Result<(), CliError> {
    let mut pipe = stdout().lock();
    match pipe.write_all(text).and_then(|()| pipe.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(pipe_broken(&error)),
        _ => Ok(()),
    }
}

/// Prints a report as JSON.
///
/// # Errors
/// As [`print()`].
pub fn print_json(report: &impl serde::Serialize) -> Result<(), CliError> {
    print(&[to_json(report)?])
}

/// A report as JSON.
///
/// # Errors
/// If it cannot be JSON.
pub fn to_json(report: &impl serde::Serialize) -> Result<String, CliError> {
    let json = serde_json::to_string_pretty(report);
    json.map_err(|error| CliError::usage(format!("the report cannot be JSON: {error}")))
}

/// Writes a report as JSON into a file.
///
/// # Errors
/// If it cannot be written.
pub fn write_json(path: &Path, report: &impl serde::Serialize) -> Result<(), CliError> {
    Ok(write_file(path, (to_json(report)? + "\n").as_bytes())?)
}

fn pipe_broken(error: &std::io::Error) -> CliError {
    CliError::usage(format!(
        "standard output: cannot write: {error}; check the disk or the program that reads it"
    ))
}

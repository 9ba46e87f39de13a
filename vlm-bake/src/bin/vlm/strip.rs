//! `vlm strip`: takes the Virtual Light Meshes out of a file.

use std::path::PathBuf;

use clap::Args;
use vlm_format::strip_vlm;

use crate::error::CliError;
use crate::input::{is_pipe, open};
use crate::output::{check_folder, deliver, print, target};

/// Flags of `vlm strip`.
#[derive(Args)]
pub struct StripArgs {
    /// glTF file (.glb or .gltf), or - for standard input (.glb)
    input: PathBuf,
    /// File to write (.glb or .gltf), or - for standard output (.glb)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

/// Runs the command. A file without Virtual Light Meshes passes through as it is.
///
/// # Errors
/// If the file cannot be read or written.
pub fn run(args: &StripArgs) -> Result<(), CliError> {
    let target = target(&args.output)?;
    check_folder(&args.output)?;
    let file = open(&args.input)?;
    deliver(&args.output, &strip_vlm(&file, &target)?)?;
    if is_pipe(&args.output) { Ok(()) } else { print(&[format!("stripped  {}", args.output.display())]) }
}

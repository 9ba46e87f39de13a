//! `vlm strip`: takes the Virtual Light Meshes out of a file.

use std::path::PathBuf;

use clap::Args;
use vlm_format::{Code, Issue, read_vlm, strip_vlm_compared, write_file, write_sidecar};

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
    /// Also write what is taken out, for `vlm relink`
    #[arg(long, value_name = "FILE.glb")]
    sidecar: Option<PathBuf>,
}

/// Runs the command. A file without Virtual Light Meshes passes through as it is. Where the bytes are not those that were baked, a note
/// says why.
///
/// # Errors
/// If the file cannot be read or written, or has nothing for the sidecar.
pub fn run(args: &StripArgs) -> Result<(), CliError> {
    let target = target(&args.output)?;
    [Some(&args.output), args.sidecar.as_ref()]
        .into_iter()
        .flatten()
        .try_for_each(|path| check_folder(path))?;
    let file = open(&args.input)?;
    let sidecar = match &args.sidecar {
        Some(path) => {
            let missing =
                || Issue::error(Code::NoVlm, "/extensions", Code::NoVlm.meaning()).in_file(file.name());
            Some((path, write_sidecar(&file, &read_vlm(&file)?.ok_or_else(missing)?)?))
        }
        None => None,
    };
    let stripped = strip_vlm_compared(&file, &target)?;
    if let Some((path, bytes)) = sidecar {
        write_file(path, &bytes)?;
    }
    deliver(&args.output, &stripped.files)?;
    if let Some(difference) = stripped.difference {
        eprintln!("note: {}: the bytes are not those that were baked: {difference}", args.output.display());
    }
    if is_pipe(&args.output) { Ok(()) } else { print(&[format!("stripped  {}", args.output.display())]) }
}

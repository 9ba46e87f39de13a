//! `vlm man`: manual pages, made from the same flags as `--help`.

use std::path::{Path, PathBuf};

use clap::{Args, Command, CommandFactory};
use clap_mangen::Man;
use vlm_format::write_file;

use crate::Cli;
use crate::error::CliError;
use crate::output::print;

/// Flags of `vlm man`.
#[derive(Args)]
pub struct ManArgs {
    /// Folder to write vlm.1, vlm-bake.1 and so on into; it is made if it does not exist
    folder: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// If the folder or a page cannot be written.
pub fn run(args: &ManArgs) -> Result<(), CliError> {
    let folder = &args.folder;
    std::fs::create_dir_all(folder).map_err(|error| failed(folder, &error))?;
    let mut vlm = Cli::command().disable_help_subcommand(true);
    vlm.build();
    let pages = std::iter::once(&vlm).chain(vlm.get_subcommands());
    let count = pages.map(|command| write_page(folder, command)).sum::<Result<usize, CliError>>()?;
    print(&[format!("wrote     {count} manual pages into {}", folder.display())])
}

/// Writes the page of one command and returns 1.
fn write_page(folder: &Path, command: &Command) -> Result<usize, CliError> {
    let man = Man::new(command.clone());
    let path = folder.join(man.get_filename());
    let mut page = Vec::new();
    man.render(&mut page).map_err(|error| failed(&path, &error))?;
    write_file(&path, &page)?;
    Ok(1)
}

fn failed(path: &Path, error: &std::io::Error) -> CliError {
    CliError::usage(format!("{}: cannot be written: {error}; name another folder", path.display()))
}

//! `vlm completions`: a script that completes the commands and flags in a shell.

use clap::{Args, CommandFactory};
use clap_complete::{Shell, generate};

use crate::Cli;
use crate::error::CliError;
use crate::output::print_bytes;

/// Flags of `vlm completions`.
#[derive(Args)]
pub struct CompletionsArgs {
    /// The shell that reads the script
    #[arg(value_enum)]
    shell: Shell,
}

/// Runs the command.
///
/// # Errors
/// If stdout cannot be written.
pub fn run(args: &CompletionsArgs) -> Result<(), CliError> {
    let mut script = Vec::new();
    generate(args.shell, &mut Cli::command(), "vlm", &mut script);
    print_bytes(&script)
}

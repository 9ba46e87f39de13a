//! `vlm`: bakes Virtual Light Meshes into glTF files, and shows their light without a GPU.
//!
//! Reports go to stdout, everything else to stderr. Exit codes: 0 done, 1 the input or the result failed a check,
//! 2 it could not run.

mod error;
mod progress;
mod render;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use error::CliError;

#[derive(Parser)]
#[command(version, about = "Bakes Virtual Light Meshes into glTF files, and shows their light")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a picture on the CPU
    Render(render::RenderArgs),
}

fn main() -> ExitCode {
    let result: Result<(), CliError> = match Cli::parse().command {
        Command::Render(args) => render::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            error.exit_code()
        }
    }
}

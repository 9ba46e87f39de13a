//! `vlm`: bakes Virtual Light Meshes into glTF files, and shows their light without a GPU.
//!
//! Reports go to stdout, everything else to stderr. Exit codes: 0 done, 1 the input or the result failed a check,
//! 2 it could not run.

mod error;
mod input;
mod files;
mod problem;
mod geometry;
mod sarif;
mod output;
mod progress;
mod settings;
mod bake;
mod batch;
mod watch;
mod check;
mod inspect;
mod inspect_bytes;
mod inspect_grid;
mod diff;
mod strip;
mod relink;
mod render;
mod schema;
mod completions;
mod man;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use error::CliError;

#[derive(Parser)]
#[command(name = "vlm", version, about = "Bakes Virtual Light Meshes into glTF files, and shows their light")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Bake Virtual Light Meshes into glTF files
    Bake(bake::BakeArgs),
    /// Follow files, and bake those that change
    Watch(watch::WatchArgs),
    /// Check that files are valid and that their Virtual Light Meshes still fit them
    Check(check::CheckArgs),
    /// Show what is in a file's Virtual Light Meshes
    Inspect(inspect::InspectArgs),
    /// Tell what changed between two bakes
    Diff(diff::DiffArgs),
    /// Take the Virtual Light Meshes out of a file
    Strip(strip::StripArgs),
    /// Attach Virtual Light Meshes again that another tool dropped or renumbered
    Relink(relink::RelinkArgs),
    /// Render a picture on the CPU
    Render(render::RenderArgs),
    /// Print the JSON Schema of a report, or list those that there are
    Schema(schema::SchemaArgs),
    /// Print a script that completes commands and flags in a shell
    Completions(completions::CompletionsArgs),
    /// Write manual pages, one for each command
    Man(man::ManArgs),
}

fn main() -> ExitCode {
    let result: Result<(), CliError> = match Cli::parse().command {
        Command::Bake(args) => bake::run(&args),
        Command::Watch(args) => watch::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Diff(args) => diff::run(&args),
        Command::Strip(args) => strip::run(&args),
        Command::Relink(args) => relink::run(&args),
        Command::Render(args) => render::run(&args),
        Command::Schema(args) => schema::run(&args),
        Command::Completions(args) => completions::run(&args),
        Command::Man(args) => man::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(CliError::Quiet) => CliError::Quiet.exit_code(),
        Err(error) => {
            eprintln!("error: {error}");
            error.exit_code()
        }
    }
}

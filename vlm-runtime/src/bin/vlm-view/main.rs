//! `vlm-view`: shows the light of a glTF file on the GPU, and follows the file as it changes.
//!
//! Reports go to stdout, everything else to stderr. Exit codes: 0 done, 1 the input failed a check, 2 it could not run.

// No input may crash it.
#![warn(clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)]

mod plot;
mod panel;
mod flying;
mod surface;
mod window;

use std::process::ExitCode;

use clap::Parser;
use vlm_runtime::view::{Arguments, headless};

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let done = if arguments.headless {
        headless(&arguments).and_then(|made| made.print(&arguments))
    } else {
        window::run(arguments)
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

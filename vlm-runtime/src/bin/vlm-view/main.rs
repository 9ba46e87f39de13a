//! `vlm-view`: shows the light of a glTF file on the GPU.
//!
//! Reports go to stdout, everything else to stderr. Exit codes: 0 done, 1 the input failed a check, 2 it could not run.

use std::process::ExitCode;

use clap::Parser;
use vlm_runtime::view::{Arguments, headless};

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let done = headless(&arguments).map(|_| ());
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

//! `vlm-bench rebuild`: from a change to the written file.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use vlm_tests::rebuild_bench::{RebuildOptions, measure, summary};

use crate::output::write_run;

/// Flags of `vlm-bench rebuild`.
#[derive(Args)]
pub struct RebuildArgs {
    /// glTF files that are edited while `vlm watch` follows them
    #[arg(value_name = "FILE")]
    scenes: Vec<PathBuf>,
    /// Files of the batch that is baked twice; 0 for none
    #[arg(long, value_name = "N", default_value_t = 200)]
    batch: u32,
    /// Repeats, of which the median counts
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=20))]
    repeats: u32,
    /// The program [default: the `vlm` beside this one]
    #[arg(long, value_name = "VLM")]
    program: Option<PathBuf>,
    /// Also write raw.csv and table.md into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// For files that cannot be baked, read or written.
pub fn run(args: &RebuildArgs) -> Result<(), Box<dyn Error>> {
    let beside = std::env::current_exe()?.with_file_name(format!("vlm{}", std::env::consts::EXE_SUFFIX));
    let program = std::path::absolute(args.program.clone().unwrap_or(beside))?;
    if !program.is_file() {
        return Err(
            format!("{}: is not there; build it, or name it with --program", program.display()).into()
        );
    }
    let options =
        RebuildOptions { program, scenes: args.scenes.clone(), batch: args.batch, repeats: args.repeats };
    let rows = measure(&options, &|line| eprintln!("{line}"))?;
    let text = summary(&rows);
    println!("{text}");
    args.out.as_deref().map_or(Ok(()), |out| write_run(out, &rows, &text))
}

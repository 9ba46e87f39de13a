//! `vlm-bench clearance`: how well lights hide, over files and budgets.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use vlm_tests::clearance_bench::{files, measure, summary};

use crate::output::write_run;

/// Flags of `vlm-bench clearance`.
#[derive(Args)]
pub struct ClearanceArgs {
    /// .glb files, or folders of them
    #[arg(required = true, value_name = "FILE|FOLDER")]
    inputs: Vec<PathBuf>,
    /// Numbers of lights, separated by commas; 0 for the preset's own
    #[arg(long, value_name = "NS", value_delimiter = ',', default_value = "50,500,5000,50000,0")]
    budgets: Vec<u32>,
    /// Also write raw.csv and table.md into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command. Files that cannot be baked are named and left out.
///
/// # Errors
/// If files cannot be written.
pub fn run(args: &ClearanceArgs) -> Result<(), Box<dyn Error>> {
    let mut rows = Vec::new();
    for file in args.inputs.iter().flat_map(|input| files(input)) {
        eprintln!("{}", file.display());
        match measure(&file, &args.budgets) {
            Ok(found) => rows.extend(found),
            Err(error) => eprintln!("left out: {error}"),
        }
    }
    let text = summary(&rows);
    println!("{text}");
    args.out.as_deref().map_or(Ok(()), |out| write_run(out, &rows, &text))
}

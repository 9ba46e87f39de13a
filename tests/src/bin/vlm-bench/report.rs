//! `vlm-bench report`: the summary and the figures of a run, anew.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use vlm_tests::pareto::report;

#[derive(Args)]
pub struct ReportArgs {
    /// Folder of a run: raw.csv, and images for the contact sheets
    dir: PathBuf,
}

pub fn run(args: &ReportArgs) -> Result<(), Box<dyn Error>> {
    Ok(report(&args.dir)?)
}

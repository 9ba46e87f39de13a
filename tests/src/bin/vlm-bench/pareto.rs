//! `vlm-bench pareto`: run time against error of every method.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use vlm_bake::flags::size;
use vlm_tests::method::Backend;
use vlm_tests::pareto;
use vlm_tests::pareto::run::{RunOptions, run};
use vlm_tests::truth::Spp;

/// Flags of `vlm-bench pareto`.
#[derive(Args)]
pub struct ParetoArgs {
    /// Scenes, separated by commas: of the repository's assets or of the test assets
    #[arg(long, value_name = "NAMES", value_delimiter = ',', required = true)]
    scenes: Vec<String>,
    /// Folder of the run
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Size of the pictures in pixels [default: 192x192 for own scenes, 256x144 for others]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(u32, u32)>,
    /// Times that everything is rendered, 2 or more
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = two_or_more)]
    repeats: u32,
    /// Where the methods run
    #[arg(long, value_enum, default_value = "cpu")]
    backend: Backend,
    /// Methods, separated by commas [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    methods: Option<Vec<String>>,
    /// Folder in which truths are kept; relative to the current folder
    #[arg(long, value_name = "DIR", default_value = "target/truth")]
    cache: PathBuf,
    /// The most directions per pixel of the truth
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = two_or_more)]
    spp: u32,
}

fn two_or_more(text: &str) -> Result<u32, String> {
    text.parse().ok().filter(|number| *number >= 2).ok_or_else(|| "expected 2 or more".to_owned())
}

/// Runs the command: 1 if a method failed its proof.
///
/// # Errors
/// Whatever keeps the run from being whole.
pub fn command(args: &ParetoArgs) -> Result<ExitCode, Box<dyn Error>> {
    let options = RunOptions {
        scenes: args.scenes.clone(),
        out: args.out.clone(),
        size: args.size,
        repeats: args.repeats,
        backend: args.backend,
        methods: args.methods.clone(),
        cache: args.cache.clone(),
        spp: Spp { first: 1024.min(args.spp), most: args.spp },
    };
    let outcome = run(&options, &|line| eprintln!("{line}"))?;
    pareto::report(&args.out)?;
    eprintln!("see {}", args.out.join("summary.md").display());
    Ok(if outcome.refused.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

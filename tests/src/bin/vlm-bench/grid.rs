//! `vlm-bench grid`: lists of lights by cell, built in the thesis' way and by scattering.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use vlm_tests::grid_bench::{GridOptions, measure, summary, write};
use vlm_tests::pareto::scene;

use crate::output::make_folder;

/// Flags of `vlm-bench grid`.
#[derive(Args)]
pub struct GridArgs {
    /// Scenes, separated by commas: `room` (made in memory), or of the assets [default: room and sponza, or else cornell]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    scenes: Option<Vec<String>>,
    /// Numbers of lights, separated by commas
    #[arg(long, value_name = "NS", value_delimiter = ',', default_value = "1000,3000,10000,30000,100000",
        value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    lights: Vec<u32>,
    /// Cells along every axis, separated by commas
    #[arg(long, value_name = "NS", value_delimiter = ',', default_value = "16,32,64,100",
        value_parser = clap::value_parser!(u32).range(1..=256))]
    cells: Vec<u32>,
    /// Reach of a light over its own radius
    #[arg(long, value_name = "R", default_value_t = 4.5, value_parser = positive)]
    range: f64,
    /// Thesis: entries of each cell's list
    #[arg(long, value_name = "K", default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..))]
    list: u32,
    /// Triangles of the room's surface
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u64).range(100..=20_000_000))]
    surface: u64,
    /// Thesis: leave out builds that would take longer than so many seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 20.0, value_parser = positive)]
    limit: f64,
    /// Interleaved repeats, of which the median counts
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    repeats: u32,
    /// Also write raw.csv, table.md and a figure per scene into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn positive(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| "expected a number above 0".to_owned())
}

/// Runs the command.
///
/// # Errors
/// For scenes that cannot be had, builds that disagree, and files that cannot be written.
pub fn run(args: &GridArgs) -> Result<(), Box<dyn Error>> {
    let options = GridOptions {
        scenes: args.scenes.clone().unwrap_or_else(default_scenes),
        lights: args.lights.clone(),
        cells: args.cells.clone(),
        range: args.range as f32,
        list: args.list,
        surface: args.surface,
        limit: args.limit,
        repeats: args.repeats,
    };
    // Before the measurement, which may take minutes.
    args.out.as_deref().map(make_folder).transpose()?;
    let rows = measure(&options, &|line| eprintln!("{line}"))?;
    print!("{}", summary(&rows, &options));
    if let Some(folder) = &args.out {
        write(folder, &rows, &options)?;
    }
    Ok(())
}

fn default_scenes() -> Vec<String> {
    let real = if scene::file("sponza").is_some() { "sponza" } else { "cornell" };
    ["room", real].map(str::to_owned).to_vec()
}

//! `vlm-bench bake`: seconds per stage and peak memory against triangles.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use vlm_bake::options::Preset;
use vlm_tests::bake_bench::{BakeBenchOptions, child, measure, summary, write};

use crate::output::make_folder;

/// Triangles that a room may have.
const ROOMS: std::ops::RangeInclusive<u64> = 100..=20_000_000;

/// Real scenes where the user names none, those on the machine.
const SCENES: [&str; 5] = ["cornell_sphere", "veach_ajar", "sibenik", "dungeon", "sponza"];

/// Flags of `vlm-bench bake`.
#[derive(Args)]
pub struct BakeArgs {
    /// Triangles of the rooms made in memory: numbers separated by commas, or A..B in steps of ten. 1e7 takes a minute a repeat and
    /// 5 GB
    #[arg(long, value_name = "NS|A..B", default_value = "1e3..1e6", value_parser = sizes)]
    triangles: Sizes,
    /// Real scenes, separated by commas; `none` for none [default: those of cornell_sphere, veach_ajar, sibenik, dungeon and
    /// sponza that are there]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    scenes: Option<Vec<String>>,
    /// What the bakes cost and give
    #[arg(long, value_name = "draft|game|quality", default_value = "game")]
    preset: Preset,
    /// Interleaved repeats, of which the median counts
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    repeats: u32,
    /// The program to compare with: a name in PATH, or a path
    #[arg(long, value_name = "PROGRAM", default_value = "gltfpack")]
    gltfpack: String,
    /// Also write raw.csv, table.md and figures into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Flags of the process that is measured.
#[derive(Args)]
pub struct ChildArgs {
    /// File to bake
    input: PathBuf,
    /// File to write
    output: PathBuf,
    /// Name of the preset
    preset: Preset,
}

/// Numbers of triangles.
#[derive(Clone, Debug, PartialEq)]
struct Sizes(Vec<u64>);

fn sizes(text: &str) -> Result<Sizes, String> {
    let number = |text: &str| {
        let value = text.trim().parse::<f64>().ok().filter(|v| v.fract() == 0.0).map(|v| v as u64);
        let (least, most) = (ROOMS.start(), ROOMS.end());
        value
            .filter(|v| ROOMS.contains(v))
            .ok_or_else(|| format!("`{text}` is no number from {least} to {most}, such as 1e5"))
    };
    let Some((first, last)) = text.split_once("..") else {
        return Ok(Sizes(text.split(',').map(number).collect::<Result<_, _>>()?));
    };
    let (first, last) = (number(first)?, number(last)?);
    if first > last {
        return Err(format!("{first} is above {last}"));
    }
    Ok(Sizes(std::iter::successors(Some(first), |size| Some(size * 10)).take_while(|&s| s <= last).collect()))
}

/// Runs the command.
///
/// # Errors
/// For scenes that cannot be had, bakes that fail, and files that cannot be written.
pub fn run(args: &BakeArgs) -> Result<(), Box<dyn Error>> {
    let named = args.scenes.clone().map(|names| names.into_iter().filter(|n| n != "none").collect());
    let options = BakeBenchOptions {
        program: std::env::current_exe()?,
        gltfpack: args.gltfpack.clone(),
        triangles: args.triangles.0.clone(),
        scenes_required: named.is_some(),
        scenes: named.unwrap_or_else(|| SCENES.map(str::to_owned).to_vec()),
        preset: args.preset.name().to_owned(),
        repeats: args.repeats,
    };
    // Before the measurement, which may take minutes.
    args.out.as_deref().map(make_folder).transpose()?;
    let run = measure(&options, &|line| eprintln!("{line}"))?;
    print!("{}", summary(&run));
    if let Some(folder) = &args.out {
        write(folder, &run)?;
    }
    Ok(())
}

/// Runs the measured process: bakes, and prints its report as JSON.
///
/// # Errors
/// For files that cannot be read, baked or written.
pub fn run_child(args: &ChildArgs) -> Result<(), Box<dyn Error>> {
    println!("{}", serde_json::to_string(&child::run(&args.input, &args.output, args.preset)?)?);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_lists_or_decades() {
        assert_eq!(sizes("1e3..1e5"), Ok(Sizes(vec![1_000, 10_000, 100_000])));
        assert_eq!(sizes("2000,1e5"), Ok(Sizes(vec![2_000, 100_000])));
        assert_eq!(sizes("3e3..5e4"), Ok(Sizes(vec![3_000, 30_000])));
        for wrong in ["", "1e3..", "1e5..1e3", "ten", "1e9", "1", "NaN", "150.5"] {
            assert!(sizes(wrong).is_err(), "{wrong}");
        }
    }
}

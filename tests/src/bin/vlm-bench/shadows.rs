//! `vlm-bench shadows`: the error of shadow maps at the points that phase 1 lights.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use vlm_bake::options::Preset;
use vlm_tests::baked::Baked;
use vlm_tests::shadow_bench::{measure, summary};

use crate::output::write_run;

/// Flags of `vlm-bench shadows`.
#[derive(Args)]
pub struct ShadowsArgs {
    /// glTF files (.glb or .gltf), which are baked first
    #[arg(required = true, value_name = "FILE")]
    inputs: Vec<PathBuf>,
    /// Texels along a side of the maps, separated by commas
    #[arg(long, value_name = "NS", value_delimiter = ',', default_value = "512,1024,2048,4096",
        value_parser = clap::value_parser!(u32).range(1..=8192))]
    sizes: Vec<u32>,
    /// Offsets along the normal in texels, separated by commas
    #[arg(long, value_name = "NS", value_delimiter = ',', default_value = "2")]
    offsets: Vec<f32>,
    /// Preset of the bake: draft, game or quality
    #[arg(long, value_name = "draft|game|quality", default_value = "draft")]
    preset: Preset,
    /// Also write raw.csv and table.md into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// For files that cannot be baked, a device that fails, and files that cannot be written.
pub fn run(args: &ShadowsArgs) -> Result<(), Box<dyn Error>> {
    let mut rows = Vec::new();
    for input in &args.inputs {
        eprintln!("{}", input.display());
        let Baked { name, scene, asset } = Baked::open(input, args.preset)?;
        rows.extend(measure((&name, &scene, &asset), &args.sizes, &args.offsets)?);
    }
    let text = summary(&rows);
    println!("{text}");
    args.out.as_deref().map_or(Ok(()), |out| write_run(out, &rows, &text))
}

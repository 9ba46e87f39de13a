//! `vlm-bench breakdown`: what limits the static grid's accuracy, scene by scene.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::scene::{LoadOptions, load};
use vlm_format::GltfFile;
use vlm_tests::breakdown::{BreakdownOptions, measure, table};
use vlm_tests::pareto::scene;
use vlm_tests::truth::Truths;

use crate::output::{make_folder, write_run};

/// Flags of `vlm-bench breakdown`.
#[derive(Args)]
pub struct BreakdownArgs {
    /// Scenes by name, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "cornell")]
    scenes: Vec<String>,
    /// Presets, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "game")]
    presets: Vec<Preset>,
    /// Only cameras whose name has this in it
    #[arg(long, default_value = "")]
    camera: String,
    /// Probes instead of the preset's
    #[arg(long)]
    probes: Option<u32>,
    /// Rays instead of the preset's
    #[arg(long)]
    rays: Option<u32>,
    /// Near lights of a probe instead of the preset's
    #[arg(long)]
    near: Option<u32>,
    /// Lights instead of the preset's
    #[arg(long)]
    lights: Option<u32>,
    /// Directions per pixel of the truth
    #[arg(long, default_value_t = 1024)]
    spp: u32,
    /// Also trace what the lights' resolution alone errs by
    #[arg(long)]
    causes: bool,
    /// Folder of the truth's cache
    #[arg(long, default_value = "target/truth")]
    cache: PathBuf,
    /// Also write raw.csv and table.md into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// If a scene cannot be had, or files cannot be written.
pub fn run(args: &BreakdownArgs) -> Result<(), Box<dyn Error>> {
    args.out.as_deref().map(make_folder).transpose()?;
    let mut rows = Vec::new();
    for name in &args.scenes {
        let path = scene::file(name).ok_or_else(|| format!("there is no scene `{name}`"))?;
        let file = GltfFile::open(&path)?;
        let scene = load(&file, &LoadOptions::default())?;
        let mut cameras = scene.cameras.clone();
        cameras.extend(scene::more_cameras(name));
        cameras.retain(|camera| camera.name.contains(&args.camera));
        let truths = Truths::new(&args.cache, &std::fs::read(&path)?)?;
        let options = BreakdownOptions {
            size: scene::default_size(name),
            spp: args.spp,
            pictures: args.out.clone(),
            lights_spp: if args.causes { args.spp } else { 0 },
        };
        for &preset in &args.presets {
            let mut bake = BakeOptions::preset(preset, scene.triangles.len());
            bake.lights = args.lights.unwrap_or(bake.lights);
            bake.grid.probes = args.probes.unwrap_or(bake.grid.probes);
            bake.grid.rays = args.rays.unwrap_or(bake.grid.rays);
            bake.grid.near = args.near.unwrap_or(bake.grid.near);
            rows.extend(measure(name, &scene, &cameras, &bake, &truths, &options)?);
        }
    }
    let text = table(&rows);
    println!("{text}");
    args.out.as_deref().map_or(Ok(()), |out| write_run(out, &rows, &text))
}

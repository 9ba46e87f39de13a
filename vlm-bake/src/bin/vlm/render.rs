//! `vlm render`: a picture of a glTF, lit directly and by one bounce.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use vlm_bake::flags::{positive, size};
use vlm_bake::picture::{write_irradiance, write_png};
use vlm_bake::progress::Progress;
use vlm_bake::render::{Method, RenderOptions, RenderReport, Rendering, render};
use vlm_bake::scene::{LoadOptions, load};
use vlm_format::read_vlm;

use crate::error::CliError;
use crate::input::open;
use crate::output::{print, print_json};
use crate::progress::Bars;

/// Flags of `vlm render`.
#[derive(Args)]
pub struct RenderArgs {
    /// glTF file (.glb or .gltf), or - for standard input (.glb)
    file: PathBuf,
    /// Camera of the file, by name or number from 0 [default: the first; one chosen to show the scene if there is none]
    #[arg(long, value_name = "NAME|INDEX")]
    camera: Option<String>,
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", default_value = "640x480", value_parser = size)]
    size: (u32, u32),
    /// Where the indirect light comes from
    #[arg(long, value_enum, default_value = "vlm")]
    method: MethodArg,
    /// Directions per pixel of the method `reference`; four times as many halve the noise
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..))]
    spp: u32,
    /// Cut the holes of alpha masks; without this they count as solid
    #[arg(long)]
    alpha_masks: bool,
    /// Write the picture, tone mapped
    #[arg(long, value_name = "IMG.png")]
    out: Option<PathBuf>,
    /// What the picture multiplies radiance (nt) by [default: chosen so that the mean brightness shows as middle grey]
    #[arg(long, value_name = "FACTOR", value_parser = positive)]
    exposure: Option<f32>,
    /// Write the indirect irradiance in lx, RGB float32, 0 where nothing is hit
    #[arg(long, value_name = "E1.exr")]
    irradiance: Option<PathBuf>,
    /// Report as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum MethodArg {
    /// The virtual lights of each point's grid cell
    Vlm,
    /// Every virtual light at every pixel
    Brute,
    /// No indirect light
    Direct,
    /// Path tracing: slow, true, needs no virtual lights
    Reference,
}

impl From<MethodArg> for Method {
    fn from(method: MethodArg) -> Self {
        match method {
            MethodArg::Vlm => Self::Vlm,
            MethodArg::Brute => Self::Brute,
            MethodArg::Direct => Self::Direct,
            MethodArg::Reference => Self::Reference,
        }
    }
}

/// Runs the command.
///
/// # Errors
/// Whatever keeps the picture from being made or written.
pub fn run(args: &RenderArgs) -> Result<(), CliError> {
    let bars = Bars::new();
    let method = Method::from(args.method);
    bars.begin("read", 1);
    let file = open(&args.file)?;
    let mut scene = load(&file, &LoadOptions::default())?;
    let notes = scene.add_defaults_for_view();
    let needs_lights = matches!(method, Method::Vlm | Method::Brute);
    let asset = if needs_lights { read_vlm(&file)? } else { None };
    let camera = scene.camera(args.camera.as_deref())?;
    let (width, height) = args.size;
    let options = RenderOptions { width, height, method, samples: args.spp, alpha_masks: args.alpha_masks };

    let rendering = render(&scene, asset.as_ref(), &camera, &options, &bars)?;
    let exposure = write_files(args, &rendering)?;
    drop(bars);
    let report = RenderReport {
        camera: camera.name,
        width,
        height,
        method: method.name().to_owned(),
        stats: rendering.stats,
    };
    for note in notes {
        eprintln!("note: {}: {note}", file.name());
    }
    print_report(args, &report, exposure)
}

/// Writes what was asked for; returns the picture's exposure.
fn write_files(args: &RenderArgs, rendering: &Rendering) -> Result<Option<f32>, CliError> {
    if let Some(path) = &args.irradiance {
        write_irradiance(rendering, path)?;
    }
    Ok(args.out.as_deref().map(|path| write_png(rendering, path, args.exposure)).transpose()?)
}

fn print_report(args: &RenderArgs, report: &RenderReport, exposure: Option<f32>) -> Result<(), CliError> {
    if args.json {
        return print_json(report);
    }
    let RenderReport { camera, width, height, method, stats } = report;
    let mut lines = vec![
        format!("rendered  {width} x {height} by {method} from camera {camera}"),
        format!("time      inject {:.3} s, gather {:.3} s", stats.seconds.inject, stats.seconds.gather),
        format!("lights    {}, {} pairs evaluated", stats.lights, stats.pairs_evaluated),
    ];
    if let (Some(path), Some(exposure)) = (&args.out, exposure) {
        lines.push(format!("picture   {}  (radiance in nt times {exposure:.4})", path.display()));
    }
    if let Some(path) = &args.irradiance {
        lines.push(format!("E1        {}", path.display()));
    }
    print(&lines)
}

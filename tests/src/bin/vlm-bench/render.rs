//! `vlm-bench render`: `vlm render` with every method, and the distance from a reference.

use std::error::Error;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::Serialize;
use vlm_bake::flags::size;
use vlm_bake::picture::{read_irradiance, write_irradiance, write_png};
use vlm_bake::progress::Silent;
use vlm_bake::render::{Method, RenderError, RenderOptions, RenderReport, RenderStats, Rendering, render};
use vlm_bake::scene::{Camera, LoadOptions, Scene, load};
use vlm_bake::shade::TraceScene;
use vlm_format::{GltfFile, VlmAsset, read_vlm};
use vlm_tests::method::{Method as CompareMethod, MethodError, Picture, Stage, View};
use vlm_tests::methods::ddgi::Ddgi;
use vlm_tests::methods::instant_radiosity::InstantRadiosity;
use vlm_tests::metrics::{Comparison, Metrics, compare_shown};
use vlm_tests::thesis::{self, ThesisOptions};

/// Flags of `vlm-bench render`: those of `vlm render`, and what only this command has.
#[derive(Args)]
pub struct RenderArgs {
    /// glTF file (.glb or .gltf)
    file: PathBuf,
    /// Camera of the file, by name or number from 0 [default: the first]
    #[arg(long, value_name = "NAME|INDEX")]
    camera: Option<String>,
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", default_value = "640x480", value_parser = size)]
    size: (u32, u32),
    /// Where the indirect light comes from
    #[arg(long, value_enum, default_value = "vlm")]
    method: MethodArg,
    /// Directions per pixel of the method `reference`
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..))]
    spp: u32,
    /// Thesis: radius of a light's hemisphere over the light's own radius
    #[arg(long, value_name = "R", default_value_t = 4.5)]
    range: f32,
    /// Thesis: entries of each cell's list
    #[arg(long, value_name = "K", default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..))]
    list: u32,
    /// Thesis: cells along each axis
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=512))]
    grid: u32,
    /// Instant radiosity: virtual point lights
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..))]
    lights: u32,
    /// Instant radiosity: distance below which a light grows no brighter, as a share of the scene's extent
    #[arg(long, value_name = "SHARE", default_value_t = 0.05)]
    clamp: f32,
    /// DDGI: probe spacings along the scene's longest axis
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..=128))]
    cells: u32,
    /// DDGI: rays per probe
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..))]
    rays: u32,
    /// Write the picture, tone mapped
    #[arg(long, value_name = "IMG.png")]
    out: Option<PathBuf>,
    /// Write the indirect irradiance in lx, RGB float32, 0 where nothing is hit
    #[arg(long, value_name = "E1.exr")]
    irradiance: Option<PathBuf>,
    /// Compare with this indirect irradiance, as --irradiance wrote it
    #[arg(long, value_name = "E1.exr")]
    compare: Option<PathBuf>,
    /// Report as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MethodArg {
    /// The virtual lights of each point's grid cell
    Vlm,
    /// Every virtual light at every pixel
    Brute,
    /// No indirect light
    Direct,
    /// Path tracing
    Reference,
    /// Aquotte 2017: active hemispheres, lists of fixed size, the textbook formula in single precision
    Thesis,
    /// Keller 1997: virtual point lights with shadow rays, clamped
    #[value(alias = "instant_radiosity")]
    InstantRadiosity,
    /// Probes as in Majercik et al. 2019: octahedral irradiance and depth moments
    Ddgi,
}

/// What the thesis' lists held.
#[derive(Clone, Copy, Debug, Serialize)]
struct ThesisReport {
    dropped: u64,
    overflowing_cells: u64,
    build_seconds: f64,
}

#[derive(Debug, Serialize)]
struct BenchReport {
    #[serde(flatten)]
    render: RenderReport,
    #[serde(skip_serializing_if = "Option::is_none")]
    thesis: Option<ThesisReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    metrics: Option<Metrics>,
}

/// Runs the command.
///
/// # Errors
/// Whatever keeps the picture from being made, written or compared.
pub fn run(args: &RenderArgs) -> Result<(), Box<dyn Error>> {
    let file = GltfFile::open(&args.file)?;
    let scene = load(&file, &LoadOptions::default())?;
    let needs_lights = matches!(args.method, MethodArg::Vlm | MethodArg::Brute | MethodArg::Thesis);
    let asset = if needs_lights { read_vlm(&file)? } else { None };
    let camera = scene.camera(args.camera.as_deref())?;
    let (rendering, thesis) = render_by(args, &scene, asset.as_ref(), &camera)?;
    if let Some(path) = &args.irradiance {
        write_irradiance(&rendering, path)?;
    }
    if let Some(path) = &args.out {
        write_png(&rendering, path, None)?;
    }
    let report = BenchReport {
        metrics: compared(args, &rendering)?,
        thesis,
        render: RenderReport {
            camera: camera.name,
            width: args.size.0,
            height: args.size.1,
            method: args.method.to_possible_value().map_or_else(String::new, |v| v.get_name().to_owned()),
            stats: rendering.stats,
        },
    };
    if args.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        println!("{report:#?}");
    }
    Ok(())
}

fn render_by(
    args: &RenderArgs,
    scene: &Scene,
    asset: Option<&VlmAsset>,
    camera: &Camera,
) -> Result<(Rendering, Option<ThesisReport>), MethodError> {
    let method = match args.method {
        MethodArg::InstantRadiosity => {
            let method = InstantRadiosity { lights: args.lights, clamp: args.clamp };
            return Ok((render_method(args, scene, camera, &method)?, None));
        }
        MethodArg::Ddgi => {
            let method = Ddgi { cells: args.cells as f32, rays: args.rays };
            return Ok((render_method(args, scene, camera, &method)?, None));
        }
        MethodArg::Thesis => {
            let options = ThesisOptions { range: args.range, list: args.list, grid: args.grid };
            let asset = asset.ok_or(RenderError::NoLights)?;
            let (rendering, grid) = thesis::render(scene, asset, camera, args.size, &options, &Silent)?;
            let report = ThesisReport {
                dropped: grid.overflow.dropped,
                overflowing_cells: grid.overflow.cells,
                build_seconds: grid.build_seconds,
            };
            return Ok((rendering, Some(report)));
        }
        MethodArg::Vlm => Method::Vlm,
        MethodArg::Brute => Method::Brute,
        MethodArg::Direct => Method::Direct,
        MethodArg::Reference => Method::Reference,
    };
    let (width, height) = args.size;
    let options = RenderOptions { width, height, method, samples: args.spp, alpha_masks: false };
    Ok((render(scene, asset, camera, &options, &Silent)?, None))
}

/// A frame by a method of the comparison.
fn render_method(
    args: &RenderArgs,
    scene: &Scene,
    camera: &Camera,
    method: &dyn CompareMethod,
) -> Result<Rendering, MethodError> {
    let trace = TraceScene::new(scene);
    let view = View::new(&trace, camera, args.size);
    let Picture { indirect, seconds, lights, pairs, .. } =
        method.prepare(&Stage::new(&trace))?.render(&view, 0)?;
    let direct = view.gbuffer.direct_irradiance(&trace);
    let stats = RenderStats { seconds, pairs_evaluated: pairs, lights };
    Ok(Rendering { gbuffer: view.gbuffer, direct, indirect, stats })
}

/// The distance from the reference that was asked for, if any.
fn compared(args: &RenderArgs, rendering: &Rendering) -> Result<Option<Metrics>, Box<dyn Error>> {
    let Some(path) = &args.compare else { return Ok(None) };
    let (width, height, truth) = read_irradiance(path)?;
    if (width, height) != args.size {
        let (w, h) = args.size;
        return Err(
            format!("{}: {width} x {height} pixels, but the picture has {w} x {h}", path.display()).into()
        );
    }
    let hit: Vec<bool> = rendering.gbuffer.points.iter().map(Option::is_some).collect();
    let comparison =
        Comparison { width: width as usize, image: &rendering.indirect, truth: &truth, hit: &hit };
    let metrics = compare_shown(&comparison);
    Ok(Some(metrics.ok_or_else(|| format!("{}: black, so nothing can be relative to it", path.display()))?))
}

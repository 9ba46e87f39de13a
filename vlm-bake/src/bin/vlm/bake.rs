//! `vlm bake`: a glTF in, the same glTF with its Virtual Light Meshes out.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use vlm_bake::bake::{Bake, bake};
use vlm_bake::flags::positive;
use vlm_bake::grid::GridOptions;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::picture::write_png;
use vlm_bake::progress::Progress;
use vlm_bake::render::{Method, RenderOptions, render};
use vlm_bake::report::Report;
use vlm_bake::report_html::{Subjects, report_html};
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_format::{GltfFile, OutputFile, WriteOptions, write_file, write_vlm_with};

use crate::error::CliError;
use crate::input::{is_pipe, open};
use crate::output::{check_folder, deliver, print, target};
use crate::progress::Bars;

/// Size of the preview: small enough to take seconds without a GPU.
const PREVIEW_SIZE: [u32; 2] = [640, 480];

/// Bake Virtual Light Meshes into a glTF file.
#[derive(Args)]
pub struct BakeArgs {
    /// glTF file (.glb or .gltf), or - for standard input (.glb)
    input: PathBuf,
    /// File to write (.glb or .gltf), or - for standard output (.glb)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// What the bake costs and gives
    #[arg(long, value_enum, default_value = "game")]
    preset: PresetArg,
    /// Number of lights for the whole scene [default: by preset and number of triangles]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    lights: Option<u32>,
    /// Edge of the grid's coarsest cells in metres [default: a 16th of the scene]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    cell: Option<f32>,
    /// About how many probes the grid has, within limits of their spacing; 0 for no grid [default: by preset and lights]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    probes: Option<u32>,
    /// Directions traced from each probe; more have less noise [default: by preset]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    rays: Option<u32>,
    /// Most near lights of a probe, whose form factor every pixel evaluates; 0 for the fastest frame [default: by preset]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=4096))]
    near: Option<u32>,
    /// Compress the lights and the grid, without loss: a third smaller, and only readers that know this compression read them
    #[arg(long)]
    compress: bool,
    /// Write what was made as JSON
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Write a page with pictures, tables and the worst places, to be looked at in a browser
    #[arg(long, value_name = "FILE.html")]
    report_html: Option<PathBuf>,
    /// Render a picture lit by the baked lights, from the file's first camera
    #[arg(long, value_name = "FILE.png")]
    preview: Option<PathBuf>,
}

/// Presets by name.
#[derive(Clone, Copy, ValueEnum)]
enum PresetArg {
    /// A quick look: 5 % of the triangles as lights (120 to 4,000), 4 samples each
    Draft,
    /// For shipping: 20 % of the triangles (460 to 16,000), 4 samples each
    Game,
    /// For stills: 80 % of the triangles (1,840 to 64,000), 16 samples each
    Quality,
}

impl From<PresetArg> for Preset {
    fn from(preset: PresetArg) -> Self {
        match preset {
            PresetArg::Draft => Self::Draft,
            PresetArg::Game => Self::Game,
            PresetArg::Quality => Self::Quality,
        }
    }
}

/// Runs the command.
///
/// # Errors
/// Whatever keeps the file from being baked; then nothing was written.
pub fn run(args: &BakeArgs) -> Result<(), CliError> {
    let bars = Bars::new();
    let target = target(&args.output)?;
    let named = [Some(&args.output), args.report.as_ref(), args.report_html.as_ref(), args.preview.as_ref()];
    named.into_iter().flatten().try_for_each(|path| check_folder(path))?;

    bars.begin("read", 1);
    let file = open(&args.input)?;
    let scene = load_scene(&file, &bars)?;
    let mut baked =
        bake(&scene, &options(args, &scene), &bars).map_err(|error| CliError::check(file.name(), error))?;

    bars.begin("write", 1);
    let outputs = write_vlm_with(&file, &baked.asset, &target, &WriteOptions { compress: args.compress })?;
    baked.report.hash = hash(&outputs);
    deliver(&args.output, &outputs)?;
    if let Some(path) = &args.report {
        write_report(path, &baked.report)?;
    }
    if let Some(path) = &args.report_html {
        bars.begin("page", 1);
        write_page(path, args, &scene, &baked, &outputs)?;
    }
    let preview = args.preview.as_deref().map(|path| preview(path, &scene, &baked, &bars)).transpose()?;
    drop(bars);
    summarize(args, &baked.report, preview.as_deref())
}

fn load_scene(file: &GltfFile, bars: &Bars) -> Result<Scene, CliError> {
    let on_texture = |done: usize, total: usize| {
        if done == 1 {
            bars.begin("textures", total as u64);
        }
        bars.advance(1);
    };
    Ok(load(file, &LoadOptions { on_texture: Some(&on_texture), ..LoadOptions::default() })?)
}

fn options(args: &BakeArgs, scene: &Scene) -> BakeOptions {
    let mut options = BakeOptions::preset(args.preset.into(), scene.triangles.len());
    options.lights = args.lights.unwrap_or(options.lights);
    options.grid = GridOptions {
        probes: args.probes.unwrap_or(options.grid.probes),
        rays: args.rays.unwrap_or(options.grid.rays),
        near: args.near.unwrap_or(options.grid.near),
        cell_size: args.cell,
    };
    options
}

/// BLAKE3 of everything written, in the order of writing.
fn hash(outputs: &[OutputFile]) -> String {
    let mut hasher = blake3::Hasher::new();
    for output in outputs {
        hasher.update(&output.bytes);
    }
    hasher.finalize().to_hex().to_string()
}

fn write_report(path: &Path, report: &Report) -> Result<(), CliError> {
    let broken = |e: &dyn std::fmt::Display| {
        CliError::usage(format!("{}: the report was not written: {e}", path.display()))
    };
    let json = serde_json::to_string_pretty(report).map_err(|e| broken(&e))?;
    Ok(write_file(path, (json + "\n").as_bytes())?)
}

/// Writes the page of `--report-html`; it is named for the input.
fn write_page(
    path: &Path,
    args: &BakeArgs,
    scene: &Scene,
    bake: &Bake,
    outputs: &[OutputFile],
) -> Result<(), CliError> {
    let title = if is_pipe(&args.input) { None } else { args.input.file_name() };
    let title = title.map_or_else(|| "standard input".into(), |name| name.to_string_lossy());
    let file_bytes = outputs.iter().map(|output| output.bytes.len() as u64).sum();
    let written = if args.compress { reopen(args, outputs)? } else { None };
    let page = report_html(&Subjects { title: &title, scene, bake, file_bytes, written: written.as_ref() })
        .map_err(|e| CliError::usage(format!("{}: the page was not written: {e}", path.display())))?;
    Ok(write_file(path, page.as_bytes())?)
}

/// The main file of an output, as it was written.
fn reopen(args: &BakeArgs, outputs: &[OutputFile]) -> Result<Option<GltfFile>, CliError> {
    // What a pipe refers to lies beside the input.
    let beside = if is_pipe(&args.output) { &args.input } else { &args.output };
    let open = |file: &OutputFile| {
        GltfFile::from_slice(&file.bytes, &args.output.display().to_string(), beside.parent())
    };
    Ok(outputs.first().map(open).transpose()?)
}

/// Renders the preview; returns lines that say what it shows.
fn preview(path: &Path, scene: &Scene, baked: &Bake, bars: &Bars) -> Result<String, CliError> {
    let mut scene = scene.clone();
    let notes = scene.add_defaults_for_view();
    let camera = scene.camera(None)?;
    let [width, height] = PREVIEW_SIZE;
    let options = RenderOptions { width, height, method: Method::Vlm, ..RenderOptions::default() };
    let rendering = render(&scene, Some(&baked.asset), &camera, &options, bars)?;
    let exposure = write_png(&rendering, path, None)?;
    let mut lines = vec![format!(
        "picture   {}  (camera {}, radiance in nt times {exposure:.4})",
        path.display(),
        camera.name
    )];
    lines.extend(notes.iter().map(|note| format!("note      {note}")));
    Ok(lines.join("\n"))
}

/// The closing lines: what was made, in numbers. On stdout, or on stderr where stdout carries the file.
fn summarize(args: &BakeArgs, report: &Report, preview: Option<&str>) -> Result<(), CliError> {
    let mut lines = vec![format!("baked     {}", args.output.display())];
    lines.push(format!(
        "lights    {} of {} asked, for {} visible triangles; decimation error {}",
        report.lights,
        report.asked_lights,
        report.visible_triangles,
        metres(report.decimation.error_m)
    ));
    if !report.missed_because.is_empty() {
        lines.push(format!("          budget missed: {}", report.missed_because));
    }
    lines.push(format!(
        "clearance {} of {} surface points violated; lights lie {} deep on average, {} required",
        report.clearance.violations,
        report.clearance.samples,
        metres(report.offset.mean_m),
        metres(report.clearance.required_m)
    ));
    let share = 100.0 * report.area.tagged_m2.max(0.0) / report.area.lights_m2.max(f64::MIN_POSITIVE);
    lines.push(format!("tags      {} ({share:.1} % of the lights' area)", report.tags.len()));
    lines.push(format!(
        "grid      {} probes in {} cells; {} near lights, {} far; {:.1} kB",
        report.grid.probes,
        report.grid.leaves,
        report.grid.near_entries,
        report.grid.far_entries,
        report.grid.bytes as f64 / 1e3
    ));
    lines.push(format!("time      {:.2} s", report.seconds.values().sum::<f64>()));
    lines.extend(report.notes.iter().map(|note| format!("note      {note}")));
    lines.extend(preview.filter(|line| !line.is_empty()).map(str::to_owned));
    if !is_pipe(&args.output) {
        return print(&lines);
    }
    lines.iter().for_each(|line| eprintln!("{line}"));
    Ok(())
}

/// A length with a unit that suits it.
fn metres(length: f64) -> String {
    if length < 1e-2 { format!("{:.2} mm", length * 1e3) } else { format!("{length:.3} m") }
}

//! `vlm bake`: a glTF in, the same glTF with its Virtual Light Meshes out.

use std::path::{Path, PathBuf};

use clap::Args;
use vlm_bake::bake::Bake;
use vlm_bake::job::{Made, make};
use vlm_bake::memory::Memory;
use vlm_bake::picture::write_png;
use vlm_bake::progress::Progress;
use vlm_bake::render::{Method, RenderOptions, render};
use vlm_bake::report::Report;
use vlm_bake::report_html::{Subjects, report_html};
use vlm_bake::scene::Scene;
use vlm_bake::settings::BakeSettings;
use vlm_format::{GltfFile, OutputFile, write_file, write_sidecar};

use crate::batch::{self, Asked, BatchArgs};
use crate::error::CliError;
use crate::input::{is_pipe, open};
use crate::output::{check_folder, deliver, folder_of, print, target, write_json};
use crate::progress::Bars;
use crate::settings::SettingsArgs;

/// Size of the preview: small enough to take seconds without a GPU.
const PREVIEW_SIZE: [u32; 2] = [640, 480];

/// Bake Virtual Light Meshes into glTF files.
#[derive(Args)]
pub struct BakeArgs {
    /// glTF files (.glb or .gltf), folders of them, globs, or - for standard input (.glb)
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// File to write (.glb or .gltf), or - for standard output (.glb)
    #[arg(short, long, value_name = "FILE", conflicts_with = "out_dir", required_unless_present = "out_dir")]
    output: Option<PathBuf>,
    #[command(flatten)]
    settings: SettingsArgs,
    /// Also write the Virtual Light Meshes alone, for `vlm relink`
    #[arg(long, value_name = "FILE.glb", conflicts_with = "out_dir")]
    sidecar: Option<PathBuf>,
    /// Write what was made as JSON
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Write a page with pictures, tables and the worst places, to be looked at in a browser
    #[arg(long, value_name = "FILE.html", conflicts_with = "out_dir")]
    report_html: Option<PathBuf>,
    /// Render a picture lit by the baked lights, from the file's first camera
    #[arg(long, value_name = "FILE.png", conflicts_with = "out_dir")]
    preview: Option<PathBuf>,
    /// Exit with code 1 if a light is not behind its surface, and no tag keeps it from what it would light
    #[arg(long)]
    fail_on_violation: bool,
    #[command(flatten)]
    batch: BatchArgs,
}

/// Runs the command.
///
/// # Errors
/// Whatever keeps a file from being baked; then nothing was written for it.
pub fn run(args: &BakeArgs) -> Result<(), CliError> {
    let BakeArgs { inputs, settings, report, fail_on_violation, batch, .. } = args;
    if let Some(out_dir) = &batch.out_dir {
        let asked = Asked { inputs, out_dir, settings, report: report.as_deref() };
        return batch::run(&asked, batch, *fail_on_violation);
    }
    let (Some(output), [input]) = (&args.output, inputs.as_slice()) else {
        return Err(CliError::usage(format!(
            "--output takes one file, but {} are given; use --out-dir DIR for several",
            inputs.len()
        )));
    };
    if let Some(flag) = batch.first_in_use() {
        return Err(CliError::usage(format!(
            "{flag} is for several files; use --out-dir DIR in place of --output"
        )));
    }
    if input.is_dir() {
        return Err(CliError::usage(format!(
            "{}: is a folder; use --out-dir DIR to bake what is in it",
            input.display()
        )));
    }
    bake_one(&One { args, input, output })
}

/// A bake of one file.
struct One<'a> {
    args: &'a BakeArgs,
    input: &'a Path,
    output: &'a Path,
}

fn bake_one(one: &One) -> Result<(), CliError> {
    let (args, bars) = (one.args, Bars::new());
    let target = target(one.output)?;
    let named = [&args.sidecar, &args.report, &args.report_html, &args.preview];
    named.into_iter().filter_map(|path| path.as_deref()).chain([one.output]).try_for_each(check_folder)?;
    let settings = one.settings()?;

    bars.begin("read", 1);
    let file = open(one.input)?;
    let Made { scene, bake, outputs } = make(&file, &settings, &target, &mut Memory::default(), &bars)?;
    deliver(one.output, &outputs)?;
    if let Some(path) = &args.sidecar {
        write_file(path, &write_sidecar(&file, &bake.asset)?)?;
    }
    if let Some(path) = &args.report {
        write_json(path, &bake.report)?;
    }
    if let Some(path) = &args.report_html {
        bars.begin("page", 1);
        let is_compressed = settings.compress == Some(true);
        one.write_page(path, is_compressed, &scene, &bake, &outputs)?;
    }
    let preview = args.preview.as_deref().map(|path| preview(path, &scene, &bake, &bars)).transpose()?;
    drop(bars);
    summarize(one.output, &bake.report, preview.as_deref())?;
    match bake.report.clearance.violations {
        violations if violations > 0 && args.fail_on_violation => Err(CliError::check(
            file.name(),
            format!(
                "{violations} points are lit by lights in front of their surface; see `vlm check --geometry`"
            ),
        )),
        _ => Ok(()),
    }
}

impl One<'_> {
    /// What is asked for; a pipe belongs to no project but that of the folder in which it runs.
    fn settings(&self) -> Result<BakeSettings, CliError> {
        let folder = if is_pipe(self.input) { Path::new(".") } else { folder_of(self.input) };
        Ok(self.args.settings.wishes(folder)?.of(self.input))
    }

    /// Writes the page of `--report-html`; it is named for the input.
    fn write_page(
        &self,
        path: &Path,
        is_compressed: bool,
        scene: &Scene,
        bake: &Bake,
        outputs: &[OutputFile],
    ) -> Result<(), CliError> {
        let title = if is_pipe(self.input) { None } else { self.input.file_name() };
        let title = title.map_or_else(|| "standard input".into(), |name| name.to_string_lossy());
        let file_bytes = outputs.iter().map(|output| output.bytes.len() as u64).sum();
        let written = if is_compressed { self.reopen(outputs)? } else { None };
        let page =
            report_html(&Subjects { title: &title, scene, bake, file_bytes, written: written.as_ref() })
                .map_err(|e| CliError::usage(format!("{}: the page was not written: {e}", path.display())))?;
        Ok(write_file(path, page.as_bytes())?)
    }

    /// The main file of the output, as it was written.
    fn reopen(&self, outputs: &[OutputFile]) -> Result<Option<GltfFile>, CliError> {
        // What a pipe refers to lies beside the input.
        let beside = if is_pipe(self.output) { self.input } else { self.output };
        let name = self.output.display().to_string();
        let open = |file: &OutputFile| GltfFile::from_slice(&file.bytes, &name, beside.parent());
        Ok(outputs.first().map(open).transpose()?)
    }
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
fn summarize(output: &Path, report: &Report, preview: Option<&str>) -> Result<(), CliError> {
    let mut lines = vec![format!("baked     {}", output.display())];
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
    if !is_pipe(output) {
        return print(&lines);
    }
    lines.iter().for_each(|line| eprintln!("{line}"));
    Ok(())
}

/// A length with a unit that suits it.
fn metres(length: f64) -> String {
    if length < 1e-2 { format!("{:.2} mm", length * 1e3) } else { format!("{length:.3} m") }
}

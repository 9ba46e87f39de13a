//! `vlm diff`: what changed between two bakes.

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;
use vlm_bake::diff::{Amount, Change, Diff, ObjectDiff, Side, TagsDiff, diff};
use vlm_bake::scene::{LoadOptions, load};
use vlm_bake::verify::{ClearanceReport, verify_asset};
use vlm_format::{Code, GltfFile, Issue, VlmAsset, read_vlm_unchecked};

use crate::error::CliError;
use crate::input::open;
use crate::output::{print, print_json};

/// Flags of `vlm diff`.
#[derive(Args)]
pub struct DiffArgs {
    /// The bake before: a glTF file (.glb or .gltf), or - for standard input (.glb)
    before: PathBuf,
    /// The bake after
    after: PathBuf,
    /// Also measure how well the lights of both lie behind their surface
    #[arg(long)]
    clearance: bool,
    /// Report as JSON
    #[arg(long)]
    json: bool,
}

/// The report.
#[derive(Serialize, JsonSchema)]
pub struct DiffReport {
    /// The file before and the one after.
    files: [String; 2],
    #[serde(flatten)]
    diff: Diff,
    /// Of both files, where asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    clearance: Option<[ClearanceReport; 2]>,
}

/// Runs the command: as `diff` does, it succeeds where there is no difference, and fails with 1 where there is one. Stale files may be
/// compared.
///
/// # Errors
/// [`CliError::Quiet`] if the files differ; [`CliError::Usage`] if one cannot be read or has no Virtual Light Mesh.
pub fn run(args: &DiffArgs) -> Result<(), CliError> {
    let report = compare(args).map_err(|error| CliError::usage(error.to_string()))?;
    let printed = if args.json { print_json(&report) } else { print(&report.lines()) };
    printed?;
    if report.diff.same { Ok(()) } else { Err(CliError::Quiet) }
}

fn compare(args: &DiffArgs) -> Result<DiffReport, CliError> {
    let (a, b) = (read(&args.before)?, read(&args.after)?);
    let clearance =
        args.clearance.then(|| Ok::<_, CliError>([clearance(&a)?, clearance(&b)?])).transpose()?;
    let files = [a.0.name().to_owned(), b.0.name().to_owned()];
    Ok(DiffReport { files, diff: diff(&Side::new(&a.0, a.1), &Side::new(&b.0, b.1)), clearance })
}

fn read(path: &Path) -> Result<(GltfFile, VlmAsset), CliError> {
    let file = open(path)?;
    match read_vlm_unchecked(&file)? {
        Some(asset) => Ok((file, asset)),
        None => {
            Err(Issue::error(Code::NoVlm, "/extensions", Code::NoVlm.meaning()).in_file(file.name()).into())
        }
    }
}

fn clearance((file, asset): &(GltfFile, VlmAsset)) -> Result<ClearanceReport, CliError> {
    Ok(verify_asset(&load(file, &LoadOptions::default())?, asset).report())
}

impl DiffReport {
    fn lines(&self) -> Vec<String> {
        let [before, after] = &self.files;
        let mut lines = Vec::new();
        if self.diff.same {
            lines.push(format!("same      {before} and {after} hold the same lights"));
        } else {
            lines.extend(self.diff.settings.iter().map(|change| format!("settings  {}", arrow(change))));
            lines.extend(self.diff.objects.iter().map(|object| format!("object    {}", sentence(object))));
            lines.extend(tags(&self.diff.tags));
            lines.extend(self.grid());
            lines.push(power(&self.diff.reflected_m2));
        }
        if let Some([a, b]) = &self.clearance {
            lines.push(format!(
                "clearance {} of {} surface points violated, now {} of {}; worst {}, now {}",
                a.violations,
                a.samples,
                b.violations,
                b.samples,
                millimetres(a.worst_m),
                millimetres(b.worst_m)
            ));
        }
        lines
    }

    fn grid(&self) -> Option<String> {
        let grid = self.diff.grid.as_ref()?;
        let numbers: Vec<String> = grid.numbers.iter().map(arrow).collect();
        let text =
            if numbers.is_empty() { String::from("same size, other light") } else { numbers.join(", ") };
        Some(format!("grid      {text}"))
    }
}

fn arrow(change: &Change<impl std::fmt::Display>) -> String {
    format!("{} {} -> {}", change.name, change.from, change.to)
}

/// What an artist wants to know of an object.
fn sentence(object: &ObjectDiff) -> String {
    let mut parts = Vec::new();
    let [before, after] = object.lights;
    match (before, after) {
        (0, _) => parts.push(format!("new, with {}", lights(after))),
        (_, 0) => parts.push(format!("gone, with its {}", lights(before))),
        _ => {
            let mut part = |count: u32, what: &str| {
                if count > 0 {
                    parts.push(format!("{} {what}", lights(count)));
                }
            };
            let Amount { max, mean, .. } = object.moved;
            part(
                object.moved.count,
                &format!("moved by up to {}, {} on average", millimetres(max), millimetres(mean)),
            );
            part(object.reshaped, "reshaped");
            part(object.recoloured.count, &format!("recoloured by up to {:.3}", object.recoloured.max));
            part(object.emission.count, &format!("emit otherwise, by up to {:.3} lx", object.emission.max));
            part(object.added, "added");
            part(object.removed, "removed");
            part(object.retagged, "with another tag");
            part(object.resampled, "with other samples");
        }
    }
    if object.authored {
        parts.push(String::from("derived before and authored now, or the other way round"));
    }
    if object.reordered {
        parts.push(String::from("lights in another order"));
    }
    format!("`{}`: {}", object.object, parts.join(", "))
}

fn lights(count: u32) -> String {
    format!("{count} light{}", if count == 1 { "" } else { "s" })
}

fn tags(tags: &TagsDiff) -> Option<String> {
    let TagsDiff { nodes, primitives, primitives_by_triangle } = tags;
    (*tags != TagsDiff::default()).then(|| {
        format!(
            "tags      differ on {nodes} nodes, {primitives} primitives, and by triangle on {primitives_by_triangle}"
        )
    })
}

fn power(reflected: &Change<[f64; 3]>) -> String {
    let mean = |rgb: &[f64; 3]| rgb.iter().sum::<f64>() / 3.0;
    let (from, to) = (mean(&reflected.from), mean(&reflected.to));
    let percent = 100.0 * (to / from.max(f64::MIN_POSITIVE) - 1.0);
    let share =
        if percent.abs() < 0.005 { String::from(", the same") } else { format!(" ({percent:+.2} %)") };
    format!("power     the lights reflect as {from:.3} m2 of white, now {to:.3}{share}")
}

fn millimetres(metres: f64) -> String {
    if metres < 1.0 { format!("{:.3} mm", metres * 1e3) } else { format!("{metres:.3} m") }
}

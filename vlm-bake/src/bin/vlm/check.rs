//! `vlm check`: is the file valid, and does its Virtual Light Mesh still fit what it was made from?

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Value, json};
use vlm_bake::scene::Scene;
use vlm_format::{Error, read_vlm};

use crate::error::CliError;
use crate::geometry::{Proof, prove, source};
use crate::input::open_checked;
use crate::output::{print, print_json};

/// Flags of `vlm check`.
#[derive(Args)]
pub struct CheckArgs {
    /// glTF files (.glb or .gltf), or - for standard input (.glb)
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Also prove that the lights lie behind the surface of this file, from which they were baked
    #[arg(long, value_name = "SOURCE")]
    geometry: Option<PathBuf>,
    /// Report as JSON
    #[arg(long)]
    json: bool,
}

/// What was found in one file.
#[derive(Serialize, JsonSchema)]
pub struct Finding {
    file: String,
    ok: bool,
    lights: usize,
    /// `{ code, severity, pointer, message }` each.
    #[schemars(with = "Vec<IssueShape>")]
    issues: Vec<Value>,
    /// One line with remedy that sums the issues up; empty if there are none.
    summary: String,
    /// The proof that the lights lie behind their surface, where it was asked for and could be had.
    #[serde(skip_serializing_if = "Option::is_none")]
    geometry: Option<Proof>,
}

/// The shape of an issue in the report.
#[derive(JsonSchema)]
#[schemars(rename = "Issue")]
#[expect(dead_code, reason = "only its schema is used")]
struct IssueShape {
    /// Which rule was broken, such as `STALE` or `NO_VLM`.
    code: String,
    /// `error` or `warning`.
    severity: String,
    /// JSON pointer, or the id of the VLM.
    pointer: String,
    /// What is wrong there.
    message: String,
}

/// Runs the command.
///
/// # Errors
/// If a file cannot be read, or any file failed.
pub fn run(args: &CheckArgs) -> Result<(), CliError> {
    let source = args.geometry.as_deref().map(source).transpose()?;
    let findings =
        args.files.iter().map(|path| check(path, source.as_ref())).collect::<Result<Vec<_>, _>>()?;
    if args.json {
        print_json(&findings)?;
    } else {
        print(&findings.iter().flat_map(lines).collect::<Vec<_>>())?;
    }
    let failed: Vec<&Finding> = findings.iter().filter(|finding| !finding.ok).collect();
    match failed.as_slice() {
        [] => Ok(()),
        [only] => Err(CliError::Check(only.summary.clone())),
        [first, ..] => {
            let (failed, all) = (failed.len(), findings.len());
            Err(CliError::Check(format!("{failed} of {all} files failed; the first: {}", first.summary)))
        }
    }
}

fn lines(finding: &Finding) -> Vec<String> {
    if !finding.ok {
        let mut lines = vec![format!("FAILED    {}: {} issues", finding.file, finding.issues.len())];
        lines.extend(finding.geometry.iter().flat_map(Proof::lines));
        return lines;
    }
    let proof = finding.geometry.as_ref().map_or_else(String::new, |proof| {
        format!(
            ", all behind their surface ({} points; {} lights fail and are tagged)",
            proof.clearance.samples, proof.tagged_lights
        )
    });
    vec![format!("ok        {}: {} lights{proof}", finding.file, finding.lights)]
}

/// # Errors
/// If the file cannot be read at all.
fn check(path: &Path, source: Option<&Scene>) -> Result<Finding, CliError> {
    let result = open_checked(path).and_then(|file| Ok((read_vlm(&file)?, file)));
    let file = path.display().to_string();
    let bare =
        Finding { file, ok: false, lights: 0, issues: Vec::new(), summary: String::new(), geometry: None };
    match result {
        Ok((Some(asset), file)) => {
            let geometry = source.map(|source| prove(file.name(), &asset, source)).transpose()?;
            let issues = geometry.as_ref().map_or_else(Vec::new, Proof::issues);
            let summary = geometry.as_ref().and_then(|proof| proof.summary(file.name())).unwrap_or_default();
            Ok(Finding {
                ok: issues.is_empty(),
                lights: asset.triangles.len(),
                issues,
                summary,
                geometry,
                ..bare
            })
        }
        // Tools that drop what they do not know are why one checks at the end of a pipeline.
        Ok((None, file)) => {
            let issue = json!({
                "code": "NO_VLM", "severity": "error", "pointer": "/extensions",
                "message": "the file has no Virtual Light Mesh",
            });
            let summary = format!(
                "{}: /extensions: the file has no Virtual Light Mesh [NO_VLM]; bake it, as the last step after every other \
                 tool",
                file.name()
            );
            Ok(Finding { issues: vec![issue], summary, ..bare })
        }
        Err(error @ Error::Io { .. }) => Err(error.into()),
        Err(error) => Ok(Finding { issues: issues(&error), summary: error.to_string(), ..bare }),
    }
}

/// Every problem, in one form whatever its kind.
fn issues(error: &Error) -> Vec<Value> {
    match error {
        Error::Invalid { issues, .. } | Error::Asset { issues } => {
            issues.iter().map(|issue| json!(issue)).collect()
        }
        Error::Stale { stale, .. } => stale
            .iter()
            .map(|s| json!({ "code": "STALE", "severity": "error", "pointer": s.vlm, "message": s.reason }))
            .collect(),
        other => {
            vec![json!({ "code": "IO", "severity": "error", "pointer": "", "message": other.to_string() })]
        }
    }
}

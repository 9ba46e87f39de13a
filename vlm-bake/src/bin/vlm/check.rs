//! `vlm check`: is the file valid, and does its Virtual Light Mesh still fit what it was made from?

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;
use serde_json::{Value, json};
use vlm_format::{Error, GltfFile, read_vlm};

use crate::error::CliError;
use crate::input::open_checked;
use crate::output::{print, print_json};

/// Flags of `vlm check`.
#[derive(Args)]
pub struct CheckArgs {
    /// glTF files (.glb or .gltf), or - for standard input (.glb)
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Report as JSON
    #[arg(long)]
    json: bool,
}

/// What was found in one file.
#[derive(Serialize)]
struct Finding {
    file: String,
    ok: bool,
    lights: usize,
    /// `{ code, severity, pointer, message }` each.
    issues: Vec<Value>,
    /// One line with remedy that sums the issues up; empty if there are none.
    summary: String,
}

/// Runs the command.
///
/// # Errors
/// If a file cannot be read, or any file failed.
pub fn run(args: &CheckArgs) -> Result<(), CliError> {
    let findings = args.files.iter().map(|path| check(path)).collect::<Result<Vec<_>, _>>()?;
    if args.json {
        print_json(&findings)?;
    } else {
        print(&findings.iter().map(line).collect::<Vec<_>>())?;
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

fn line(finding: &Finding) -> String {
    if finding.ok {
        return format!("ok        {}: {} lights", finding.file, finding.lights);
    }
    format!("FAILED    {}: {} issues", finding.file, finding.issues.len())
}

/// # Errors
/// If the file cannot be read at all.
fn check(path: &Path) -> Result<Finding, CliError> {
    let result = open_checked(path).and_then(|file| Ok((lights(&file)?, file)));
    let name = path.display().to_string();
    match result {
        Ok((Some(lights), _)) => {
            Ok(Finding { file: name, ok: true, lights, issues: Vec::new(), summary: String::new() })
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
            Ok(Finding { file: name, ok: false, lights: 0, issues: vec![issue], summary })
        }
        Err(error @ Error::Io { .. }) => Err(error.into()),
        Err(error) => Ok(Finding {
            file: name,
            ok: false,
            lights: 0,
            issues: issues(&error),
            summary: error.to_string(),
        }),
    }
}

fn lights(file: &GltfFile) -> Result<Option<usize>, Error> {
    Ok(read_vlm(file)?.map(|asset| asset.triangles.len()))
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

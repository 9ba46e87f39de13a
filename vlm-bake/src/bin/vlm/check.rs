//! `vlm check`: is the file valid, and does its Virtual Light Mesh still fit what it was made from?

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;
use vlm_bake::scene::Scene;
use vlm_format::{Code, GltfFile, Issue, read_vlm};

use crate::error::CliError;
use crate::files::gltf_files;
use crate::geometry::{Proof, prove, source};
use crate::input::open_checked;
use crate::output::{print, print_json};
use crate::problem::Problem;
use crate::sarif::sarif;

/// Problems of a file that the text report spells out; `--json` has all.
const SPELT_OUT: usize = 10;

/// Flags of `vlm check`.
#[derive(Args)]
pub struct CheckArgs {
    /// glTF files, folders (every .glb and .gltf below them), globs, or - for standard input (.glb)
    #[arg(required = true, value_name = "FILE|FOLDER")]
    paths: Vec<PathBuf>,
    /// Also prove that the lights lie behind the surface of this file, from which they were baked
    #[arg(long, value_name = "SOURCE")]
    geometry: Option<PathBuf>,
    /// Report as JSON
    #[arg(long)]
    json: bool,
    /// Report as SARIF 2.1.0, for code scanning in CI
    #[arg(long, conflicts_with = "json")]
    sarif: bool,
}

/// What was found in one file.
#[derive(Serialize, JsonSchema)]
pub struct Finding {
    /// The path, as it was named or found.
    pub file: String,
    /// True if there is no error; there may be warnings.
    ok: bool,
    lights: usize,
    /// Errors and warnings: `{ code, severity, pointer, message }` each, with `vlm` where something is stale.
    #[schemars(with = "Vec<IssueShape>")]
    pub issues: Vec<Problem>,
    /// One line with remedy that sums the errors up; empty if there are none.
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
    /// JSON pointer into the file; empty for the file as a whole.
    pointer: String,
    /// What is wrong there.
    message: String,
    /// What is stale: the id of a VLM, `grid`, or `asset` for what all share.
    #[schemars(skip_serializing_if = "Option::is_none")]
    vlm: Option<String>,
    /// Number of the light that is not behind its surface.
    #[schemars(skip_serializing_if = "Option::is_none")]
    light: Option<u32>,
    /// Path of the node of that light.
    #[schemars(skip_serializing_if = "Option::is_none")]
    object: Option<String>,
    /// By how much that light would have to move, metres.
    #[schemars(skip_serializing_if = "Option::is_none")]
    depth_m: Option<f64>,
    /// Where that light is worst, metres, world space.
    #[schemars(skip_serializing_if = "Option::is_none")]
    place: Option<[f64; 3]>,
}

/// Runs the command.
///
/// # Errors
/// [`CliError::Check`] if any file failed; [`CliError::Usage`] if none could be read.
pub fn run(args: &CheckArgs) -> Result<(), CliError> {
    let files = gltf_files(&args.paths)?;
    let source = args.geometry.as_deref().map(source).transpose()?;
    let findings: Vec<Finding> = files.iter().map(|path| check(path, source.as_ref())).collect();
    if args.sarif {
        print_json(&sarif(&findings))?;
    } else if args.json {
        print_json(&findings)?;
    } else {
        print(&findings.iter().flat_map(Finding::lines).collect::<Vec<_>>())?;
    }
    verdict(&findings)
}

fn verdict(findings: &[Finding]) -> Result<(), CliError> {
    let failed: Vec<&Finding> = findings.iter().filter(|finding| !finding.ok).collect();
    let message = match failed.as_slice() {
        [] => return Ok(()),
        [only] => only.summary.clone(),
        [first, ..] => {
            format!("{} of {} files failed; the first: {}", failed.len(), findings.len(), first.summary)
        }
    };
    // Where nothing could be read, nothing was checked.
    let unread = findings.iter().all(|finding| finding.issues.iter().any(|p| p.issue.code == Code::Io));
    Err(if unread { CliError::usage(message) } else { CliError::Check(message) })
}

fn check(path: &Path, source: Option<&Scene>) -> Finding {
    let name = path.display().to_string();
    match open_checked(path) {
        Ok(file) => check_opened(&file, source),
        Err(error) => Finding::failed(&name, Problem::all_of(&error), error.to_string()),
    }
}

fn check_opened(file: &GltfFile, source: Option<&Scene>) -> Finding {
    let name = file.name();
    let mut finding = match read_vlm(file) {
        Ok(Some(asset)) => {
            let mut found = Finding { lights: asset.triangles.len(), ..Finding::passed(name) };
            match source.map(|source| prove(&asset, source)).transpose() {
                Ok(proof) => found.add(proof),
                Err(issue) => return Finding::of(file, issue),
            }
            found
        }
        // Tools that drop what they do not know are why one checks at the end of a pipeline.
        Ok(None) => {
            return Finding::of(file, Issue::error(Code::NoVlm, "/extensions", Code::NoVlm.meaning()));
        }
        Err(error) => Finding::failed(name, Problem::all_of(&error), error.to_string()),
    };
    finding.issues.extend(file.warnings().iter().cloned().map(Problem::from));
    finding
}

impl Finding {
    fn passed(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            ok: true,
            lights: 0,
            issues: Vec::new(),
            summary: String::new(),
            geometry: None,
        }
    }

    fn failed(file: &str, issues: Vec<Problem>, summary: String) -> Self {
        Self { ok: false, issues, summary, ..Self::passed(file) }
    }

    /// A file that opens, with one error.
    fn of(file: &GltfFile, issue: Issue) -> Self {
        let summary = format!("{}: {issue}", file.name());
        let warnings = file.warnings().iter().cloned();
        let issues = std::iter::once(issue).chain(warnings).map(Problem::from).collect();
        Self::failed(file.name(), issues, summary)
    }

    fn add(&mut self, proof: Option<Proof>) {
        let Some(proof) = proof else { return };
        self.issues = proof.problems();
        self.ok = self.issues.is_empty();
        self.summary = proof.summary(&self.file).unwrap_or_default();
        self.geometry = Some(proof);
    }

    fn lines(&self) -> Vec<String> {
        let errors = self.issues.iter().filter(|problem| problem.is_error()).count();
        let warnings = self.issues.len() - errors;
        let proof = self.geometry.as_ref().filter(|_| self.ok).map_or_else(String::new, Proof::sentence);
        let and_warnings =
            if warnings > 0 { format!(", {}", counted(warnings, "warning")) } else { String::new() };
        let head = if self.ok {
            format!("ok        {}: {} lights{proof}{and_warnings}", self.file, self.lights)
        } else {
            format!("FAILED    {}: {}{and_warnings}", self.file, counted(errors, "error"))
        };
        let mut lines = vec![head];
        lines.extend(self.issues.iter().take(SPELT_OUT).map(|problem| format!("  {}", problem.line())));
        if self.issues.len() > SPELT_OUT {
            lines.push(format!("  and {} more; --json lists all", self.issues.len() - SPELT_OUT));
        }
        lines
    }
}

fn counted(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

//! `vlm check --geometry SOURCE`: do the lights lie behind the surface of their source?

use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Value, json};
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_bake::verify::{ClearanceReport, Finding, FindingKind, verify_asset};
use vlm_format::VlmAsset;

use crate::error::CliError;
use crate::input::open;

/// Findings that the text report spells out; the JSON report has all.
const SPELT_OUT: usize = 10;

/// The proof of one file.
#[derive(Serialize, JsonSchema)]
pub struct Proof {
    /// The proof in figures.
    #[serde(flatten)]
    pub clearance: ClearanceReport,
    /// Lights that would fail if no tag kept them from what they would light.
    pub tagged_lights: usize,
    /// The lights that fail, the deepest first.
    #[serde(skip)]
    pub failing: Vec<Finding>,
}

/// Loads the source.
///
/// # Errors
/// If it cannot be read.
pub fn source(path: &Path) -> Result<Scene, CliError> {
    Ok(load(&open(path)?, &LoadOptions::default())?)
}

/// Proves an asset on the surface of its source.
///
/// # Errors
/// [`CliError::Check`] if the source lacks a node that bears lights.
pub fn prove(file: &str, asset: &VlmAsset, source: &Scene) -> Result<Proof, CliError> {
    if let Some(vlm) = asset.vlms.iter().find(|vlm| source.objects.iter().all(|o| o.node != vlm.node)) {
        return Err(CliError::check(
            file,
            format!(
                "node {} bears the lights `{}`, but the source has no geometry there; name the file that was baked, or \
                 bake again",
                vlm.node, vlm.id
            ),
        ));
    }
    let verification = verify_asset(source, asset);
    let mut failing: Vec<Finding> = verification.untagged().cloned().collect();
    failing.sort_by(|a, b| b.depth_m.total_cmp(&a.depth_m).then(a.light.cmp(&b.light)));
    let tagged_lights = verification.findings.len() - failing.len();
    Ok(Proof { clearance: verification.report(), tagged_lights, failing })
}

impl Proof {
    /// The findings in the form of the format's issues.
    pub fn issues(&self) -> Vec<Value> {
        self.failing.iter().map(issue).collect()
    }

    /// Lines below the file's own.
    pub fn lines(&self) -> Vec<String> {
        let mut lines: Vec<String> = self
            .failing
            .iter()
            .take(SPELT_OUT)
            .map(|finding| format!("          {}", sentence(finding)))
            .collect();
        if self.failing.len() > SPELT_OUT {
            lines.push(format!("          and {} more; --json lists all", self.failing.len() - SPELT_OUT));
        }
        lines
    }

    /// One line with remedy; `None` if nothing failed.
    pub fn summary(&self, file: &str) -> Option<String> {
        let worst = self.failing.first()?;
        Some(format!(
            "{file}: {} lights are not behind their surface; the worst: {}; bake again, or tag its object with \
             `extras.vlm.tag`",
            self.failing.len(),
            sentence(worst)
        ))
    }
}

fn code(kind: FindingKind) -> &'static str {
    match kind {
        FindingKind::LightsItself => "LIGHTS_ITSELF",
        FindingKind::PokesOut => "POKES_OUT",
        FindingKind::TooThin => "TOO_THIN",
    }
}

fn issue(finding: &Finding) -> Value {
    json!({
        "code": code(finding.kind),
        "severity": "error",
        "pointer": "/extensions/VLM_virtual_light_mesh/lights",
        "message": sentence(finding),
        "light": finding.light,
        "object": finding.object,
        "depth_m": finding.depth_m,
        "place": finding.place.to_array(),
    })
}

fn sentence(finding: &Finding) -> String {
    let does = match finding.kind {
        FindingKind::LightsItself => {
            format!("lights {} points of the surface for which it stands", finding.points)
        }
        FindingKind::PokesOut => "comes out of it".to_owned(),
        FindingKind::TooThin => "is longer than 100 times its height".to_owned(),
    };
    let by = match finding.kind {
        FindingKind::TooThin => String::new(),
        _ => format!(", by {:.3} mm", finding.depth_m * 1e3),
    };
    let [x, y, z] = finding.place.to_array();
    format!(
        "light {} of `{}` {does}{by}, at ({x:.3}, {y:.3}, {z:.3}) [{}]",
        finding.light,
        finding.object,
        code(finding.kind)
    )
}

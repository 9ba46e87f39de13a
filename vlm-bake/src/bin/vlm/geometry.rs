//! `vlm check --geometry SOURCE`: do the lights lie behind the surface of their source?

use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_bake::verify::{ClearanceReport, Finding, FindingKind, verify_asset};
use vlm_format::{Code, EXTENSION, Issue, VlmAsset};

use crate::error::CliError;
use crate::input::open;
use crate::problem::{LightPlace, Problem};

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
/// [`Code::NotInSource`] if the source lacks a node that bears lights.
pub fn prove(asset: &VlmAsset, source: &Scene) -> Result<Proof, Issue> {
    let lacks = |node: u32| source.objects.iter().all(|object| object.node != node);
    if let Some((i, vlm)) = asset.vlms.iter().enumerate().find(|(_, vlm)| lacks(vlm.node)) {
        let message =
            format!("node {} bears the lights `{}`, but the source has no geometry there", vlm.node, vlm.id);
        return Err(Issue::error(Code::NotInSource, format!("/extensions/{EXTENSION}/vlms/{i}"), message));
    }
    let verification = verify_asset(source, asset);
    let mut failing: Vec<Finding> = verification.untagged().cloned().collect();
    failing.sort_by(|a, b| b.depth_m.total_cmp(&a.depth_m).then(a.light.cmp(&b.light)));
    let tagged_lights = verification.findings.len() - failing.len();
    Ok(Proof { clearance: verification.report(), tagged_lights, failing })
}

impl Proof {
    /// The lights that fail, the deepest first.
    pub fn problems(&self) -> Vec<Problem> {
        self.failing.iter().map(problem).collect()
    }

    /// What was proved, to stand behind the number of lights.
    pub fn sentence(&self) -> String {
        format!(
            ", all behind their surface ({} points; {} lights fail and are tagged)",
            self.clearance.samples, self.tagged_lights
        )
    }

    /// One line with remedy; `None` if nothing failed.
    pub fn summary(&self, file: &str) -> Option<String> {
        let worst = self.failing.first()?;
        Some(format!(
            "{file}: {} lights are not behind their surface; the worst: {} [{}]; {}",
            self.failing.len(),
            sentence(worst),
            code(worst.kind),
            code(worst.kind).remedy()
        ))
    }
}

fn code(kind: FindingKind) -> Code {
    match kind {
        FindingKind::LightsItself => Code::LightsItself,
        FindingKind::PokesOut => Code::PokesOut,
        FindingKind::TooThin => Code::TooThin,
    }
}

fn problem(finding: &Finding) -> Problem {
    let pointer = format!("/extensions/{EXTENSION}/lights");
    let light = LightPlace {
        light: finding.light,
        object: finding.object.clone(),
        depth_m: finding.depth_m,
        place: finding.place.to_array(),
    };
    Problem { light: Some(light), ..Issue::error(code(finding.kind), pointer, sentence(finding)).into() }
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
    format!("light {} of `{}` {does}{by}, at ({x:.3}, {y:.3}, {z:.3})", finding.light, finding.object)
}

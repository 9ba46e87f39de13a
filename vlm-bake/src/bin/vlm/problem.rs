//! A problem of a file in one form, whatever found it: what `vlm check` reports as JSON and as SARIF.

use serde::Serialize;
use vlm_format::{Code, Error, Issue, Severity};

/// A problem, with what its kind adds.
#[derive(Clone, Debug, Serialize)]
pub struct Problem {
    /// Code, severity, JSON pointer and message.
    #[serde(flatten)]
    pub issue: Issue,
    /// What is stale: the id of a VLM, `grid`, or `asset` for what all VLMs share.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vlm: Option<String>,
    /// The light that is not behind its surface.
    #[serde(flatten)]
    pub light: Option<LightPlace>,
}

/// Where a light fails.
#[derive(Clone, Debug, Serialize)]
pub struct LightPlace {
    /// Number of the light.
    pub light: u32,
    /// Path of its node.
    pub object: String,
    /// By how much it would have to move, metres.
    pub depth_m: f64,
    /// Where it is worst, metres, world space.
    pub place: [f64; 3],
}

impl Problem {
    /// Whether the file fails for it.
    pub fn is_error(&self) -> bool {
        self.issue.severity == Severity::Error
    }

    /// Every problem that an error holds.
    pub fn all_of(error: &Error) -> Vec<Self> {
        match error {
            Error::Invalid { issues, .. } | Error::Asset { issues } => {
                issues.iter().cloned().map(Self::from).collect()
            }
            Error::Stale { stale, .. } => stale
                .iter()
                .map(|stale| Self {
                    vlm: Some(stale.vlm.clone()),
                    ..Issue::error(Code::Stale, &*stale.pointer, &*stale.reason).into()
                })
                .collect(),
            Error::Io { action, source, .. } => {
                vec![Issue::error(Code::Io, "", format!("cannot {action}: {source}")).into()]
            }
            other => vec![Issue::error(Code::Io, "", other.to_string()).into()],
        }
    }

    /// One line: place, what is wrong and the code.
    pub fn line(&self) -> String {
        let Issue { code, severity, pointer, message } = &self.issue;
        let place = if pointer.is_empty() { String::new() } else { format!("{pointer}: ") };
        format!("{:<10}{place}{message} [{code}]", severity.as_str())
    }
}

impl From<Issue> for Problem {
    fn from(issue: Issue) -> Self {
        Self { issue, vlm: None, light: None }
    }
}

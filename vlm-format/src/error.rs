//! What can go wrong with a file: each problem has a stable code, a place, a cause and a remedy.

use std::fmt;
use std::io;
use std::path::PathBuf;

use serde::Serialize;

pub use crate::code::{Code, Severity};

/// Why a file was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder could not be read or written.
    #[error("{}: cannot {action}: {source}; {}", path.display(), io_remedy(source))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried: `read`, `write` and so on.
        action: &'static str,
        /// The operating system's answer.
        source: io::Error,
    },
    /// The file breaks rules that this library relies on.
    #[error("{file}: {}", summary(issues))]
    Invalid {
        /// Name of the file, as the caller gave it.
        file: String,
        /// All problems found, in the order of the checks; at least one.
        issues: Vec<Issue>,
    },
    /// The Virtual Light Meshes no longer belong to the rest of the file.
    #[error("{file}: {}", stale_summary(stale))]
    Stale {
        /// Name of the file, as the caller gave it.
        file: String,
        /// What is stale, and why; at least one.
        stale: Vec<Stale>,
    },
    /// The asset to be written breaks its own rules: a fault of the tool that made it.
    #[error("the Virtual Light Mesh is not valid: {}", summary(issues))]
    Asset {
        /// All problems found; at least one.
        issues: Vec<Issue>,
    },
}

/// A part of the extension that no longer fits the file around it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Stale {
    /// The id of the VLM, or `grid`, or `asset` for what all VLMs share.
    pub vlm: String,
    /// RFC 6901 JSON pointer of what is stale: the VLM in the extension, an array, the grid, or the node that refers to them.
    pub pointer: String,
    /// What changed since the bake, for the user to read.
    pub reason: String,
}

/// One problem of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Issue {
    /// Which rule was broken.
    pub code: Code,
    /// Whether the file is refused for it.
    pub severity: Severity,
    /// RFC 6901 JSON pointer of the offending value; empty for the file as a whole.
    pub pointer: String,
    /// What is wrong there.
    pub message: String,
}

impl Issue {
    /// A problem for which the file is refused.
    pub fn error(code: Code, pointer: impl Into<String>, message: impl Into<String>) -> Self {
        Self { code, severity: Severity::Error, pointer: pointer.into(), message: message.into() }
    }

    /// A problem that can be lived with.
    pub fn warning(code: Code, pointer: impl Into<String>, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, pointer, message) }
    }

    /// An error about `file` with this as its only problem.
    pub fn in_file(self, file: &str) -> Error {
        Error::Invalid { file: file.to_owned(), issues: vec![self] }
    }
}

impl fmt::Display for Issue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.pointer.is_empty() {
            write!(f, "{}: ", self.pointer)?;
        }
        write!(f, "{} [{}]; {}", self.message, self.code.as_str(), self.code.remedy())
    }
}

fn summary(issues: &[Issue]) -> String {
    let errors = issues.iter().filter(|issue| issue.severity == Severity::Error).count();
    match issues.iter().find(|issue| issue.severity == Severity::Error).or(issues.first()) {
        Some(first) if errors > 1 => format!("{first} (and {} more)", errors - 1),
        Some(first) => first.to_string(),
        None => String::from("no problem recorded"),
    }
}

fn stale_summary(stale: &[Stale]) -> String {
    // What one tool did to a file often shows in every array; the first few tell what it was.
    const SHOWN: usize = 3;
    let each: Vec<String> =
        stale.iter().take(SHOWN).map(|stale| format!("`{}`: {}", stale.vlm, stale.reason)).collect();
    let more = match stale.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!(" (and {more} more)"),
    };
    format!(
        "the Virtual Light Mesh is stale: {}{more}; bake again, as the last step after every other tool",
        each.join("; ")
    )
}

fn io_remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "check the path: the file or its folder does not exist",
        io::ErrorKind::PermissionDenied => "check the permissions of the file and its folder",
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "free some disk space; nothing was written"
        }
        io::ErrorKind::IsADirectory => "name a file, not a folder",
        io::ErrorKind::NotADirectory => "check the path: one of its folders is a file",
        io::ErrorKind::ReadOnlyFilesystem => "write to another folder",
        _ => "check the file, its folder and the disk",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_names_file_place_cause_and_remedy() {
        let issue = Issue::error(Code::NodeCycle, "/nodes/3", "the node is its own ancestor");
        let text = issue.in_file("loop.gltf").to_string();
        for part in ["loop.gltf", "/nodes/3", "own ancestor", "NODE_CYCLE", "make the node hierarchy a tree"]
        {
            assert!(text.contains(part), "{part} is missing in: {text}");
        }
    }
}

//! Checks of a glTF file's JSON and of the bytes it refers to, before anything follows its indices.
//!
//! `shape` compares types and indices with the tables of `tables` and `extension`, `rules` checks what tables cannot say
//! (hierarchy, extensions), `layout` compares offsets and counts with the bytes that are there.

mod shape;
mod tables;
mod extension;
pub(crate) mod rules;
pub(crate) mod layout;

use serde_json::Value;

use crate::error::{Code, Error, Issue, Severity};

/// More problems than this, of one severity, say nothing new, and a hostile file could list millions.
const MAX_ISSUES: usize = 200;

/// The problems found so far.
#[derive(Debug, Default)]
pub(crate) struct Report {
    issues: Vec<Issue>,
}

impl Report {
    fn push(&mut self, issue: Issue) {
        // Each severity has its own limit, so that many warnings cannot hide an error.
        let alike = self.issues.iter().filter(|other| other.severity == issue.severity).count();
        if alike < MAX_ISSUES {
            self.issues.push(issue);
        }
    }

    fn error(&mut self, code: Code, pointer: impl Into<String>, message: impl Into<String>) {
        self.push(Issue::error(code, pointer, message));
    }

    fn warning(&mut self, code: Code, pointer: impl Into<String>, message: impl Into<String>) {
        self.push(Issue::warning(code, pointer, message));
    }

    /// True if the file has to be refused.
    pub(crate) fn has_errors(&self) -> bool {
        self.issues.iter().any(|issue| issue.severity == Severity::Error)
    }

    /// Turns the report into an error about `file` if the file has to be refused.
    pub(crate) fn refuse(&self, file: &str) -> Result<(), Error> {
        if !self.has_errors() {
            return Ok(());
        }
        Err(Error::Invalid { file: file.to_owned(), issues: self.issues.clone() })
    }

    /// All problems, in the order in which they were found.
    pub(crate) fn into_issues(self) -> Vec<Issue> {
        self.issues
    }
}

/// Checks all that the JSON alone can tell. Each stage relies on the ones before it.
pub(crate) fn check_json(root: &Value) -> Report {
    let mut report = Report::default();
    let stages: [fn(&Value, &mut Report); 4] = [
        rules::version,
        rules::extensions,
        |root, report| shape::compare(root, tables::GLTF, report),
        rules::structure,
    ];
    for stage in stages {
        stage(root, &mut report);
        if report.has_errors() {
            break;
        }
    }
    report
}

/// Checks the shape of our own extension: its root object, and its objects in nodes and primitives.
pub(crate) fn check_extension(root: &Value) -> Report {
    let mut report = Report::default();
    shape::compare(root, extension::EXTENSION, &mut report);
    report
}

/// The elements of a root array; none if it is absent.
pub(crate) fn array<'a>(root: &'a Value, pointer: &str) -> &'a [Value] {
    root.pointer(pointer).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// A whole number property; `None` if absent or of another type.
pub(crate) fn count(value: &Value, key: &str) -> Option<u64> {
    value.get(key).and_then(Value::as_u64)
}

/// An index property; `None` if absent.
pub(crate) fn index(value: &Value, key: &str) -> Option<usize> {
    count(value, key).and_then(|index| usize::try_from(index).ok())
}

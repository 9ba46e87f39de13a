//! `vlm check --sarif`: findings in the form that code scanning reads.
//!
//! OASIS, *Static Analysis Results Interchange Format (SARIF) Version 2.1.0*, 2020; sections are named below. The structs are our own:
//! the crate `serde-sarif` generates hundreds of types at build time, and few are needed.

use std::path::{Component, Path, PathBuf};

use serde::Serialize;
use vlm_format::{Code, Issue, Severity};

use crate::check::Finding;
use crate::input::is_pipe;
use crate::problem::Problem;

/// A log of one run (section 3.13).
#[derive(Serialize)]
pub struct Sarif {
    #[serde(rename = "$schema")]
    schema: &'static str,
    version: &'static str,
    runs: [Run; 1],
}

/// Section 3.14.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Run {
    tool: Tool,
    /// Columns are not given, but the property has no default that suits all.
    column_kind: &'static str,
    results: Vec<ResultObject>,
}

#[derive(Serialize)]
struct Tool {
    driver: Driver,
}

/// Section 3.19.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Driver {
    name: &'static str,
    version: &'static str,
    semantic_version: &'static str,
    rules: Vec<Rule>,
}

/// A code of the catalogue (section 3.49).
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Rule {
    id: &'static str,
    short_description: Text,
    help: Text,
    default_configuration: Configuration,
}

#[derive(Serialize)]
struct Configuration {
    level: &'static str,
}

#[derive(Serialize)]
struct Text {
    text: String,
}

/// Section 3.27.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct ResultObject {
    rule_id: &'static str,
    rule_index: usize,
    level: &'static str,
    message: Text,
    locations: [Location; 1],
    partial_fingerprints: Fingerprints,
}

/// Tells results apart that have the same rule and line: else code scanning would take them for one.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Fingerprints {
    primary_location_line_hash: String,
}

/// Section 3.28.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Location {
    physical_location: PhysicalLocation,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    logical_locations: Vec<LogicalLocation>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct PhysicalLocation {
    artifact_location: ArtifactLocation,
    region: Region,
}

#[derive(Serialize)]
struct ArtifactLocation {
    uri: String,
}

/// A .glb has no lines: the first stands for the file.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Region {
    start_line: u32,
}

/// The JSON pointer (section 3.33).
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct LogicalLocation {
    name: String,
    fully_qualified_name: String,
    kind: &'static str,
}

/// The report of a check.
pub fn sarif(findings: &[Finding]) -> Sarif {
    let here = std::env::current_dir().unwrap_or_default();
    let results = findings.iter().flat_map(|finding| {
        let uri = uri(&finding.file, &here);
        finding.issues.iter().map(move |problem| result(problem, &uri))
    });
    let driver = Driver {
        name: "vlm",
        version: env!("CARGO_PKG_VERSION"),
        semantic_version: env!("CARGO_PKG_VERSION"),
        rules: Code::ALL.iter().map(|&code| rule(code)).collect(),
    };
    Sarif {
        schema: "https://json.schemastore.org/sarif-2.1.0.json",
        version: "2.1.0",
        runs: [Run { tool: Tool { driver }, column_kind: "unicodeCodePoints", results: results.collect() }],
    }
}

fn rule(code: Code) -> Rule {
    let worst = code.severities().first().copied().unwrap_or(Severity::Error);
    Rule {
        id: code.as_str(),
        short_description: Text { text: sentence(code.meaning()) },
        help: Text { text: sentence(code.remedy()) },
        default_configuration: Configuration { level: worst.as_str() },
    }
}

fn result(problem: &Problem, uri: &str) -> ResultObject {
    let Issue { code, severity, pointer, message } = &problem.issue;
    let name = pointer.rsplit('/').next().unwrap_or_default().replace("~1", "/").replace("~0", "~");
    let logical = LogicalLocation { name, fully_qualified_name: pointer.clone(), kind: "value" };
    let hash = blake3::hash(format!("{code}\n{uri}\n{pointer}\n{message}").as_bytes()).to_hex();
    ResultObject {
        rule_id: code.as_str(),
        rule_index: Code::ALL.iter().position(|known| known == code).unwrap_or_default(),
        level: severity.as_str(),
        message: Text { text: format!("{}; {}.", message, code.remedy()) },
        locations: [Location {
            physical_location: PhysicalLocation {
                artifact_location: ArtifactLocation { uri: uri.to_owned() },
                region: Region { start_line: 1 },
            },
            logical_locations: if pointer.is_empty() { Vec::new() } else { vec![logical] },
        }],
        partial_fingerprints: Fingerprints { primary_location_line_hash: format!("{}:1", &hash[..16]) },
    }
}

/// A capital at the beginning and a full stop at the end.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| format!("{}{}.", first.to_uppercase(), letters.as_str())).unwrap_or_default()
}

/// The URI of a file: relative to the working directory if it lies there, as code scanning asks, else absolute.
fn uri(file: &str, here: &Path) -> String {
    if is_pipe(Path::new(file)) || file == "standard input" {
        return String::from("standard-input");
    }
    let whole = plain(&here.join(file));
    match whole.strip_prefix(here) {
        Ok(relative) => encode(relative),
        Err(_) => format!("file://{}{}", if whole.has_root() { "" } else { "/" }, encode(&whole)),
    }
}

/// Without `.` and `..`, as the path reads: links are not followed.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => drop(plain.pop()),
            part => plain.push(part),
        }
    }
    plain
}

/// Percent-encodes the parts of a path (RFC 3986, section 3.3; `:` could be taken for a scheme).
fn encode(path: &Path) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~!$&'()*+,;=@/".contains(&byte);
    let text = path.to_string_lossy().replace('\\', "/");
    text.bytes()
        .map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_relative_where_they_can_be() {
        let here = Path::new("/home/artist/game");
        for (file, expected) in [
            ("a.glb", "a.glb"),
            ("./models/a b#1.glb", "models/a%20b%231.glb"),
            ("models/../räume/x.gltf", "r%C3%A4ume/x.gltf"),
            ("/home/artist/game/c:d.glb", "c%3Ad.glb"),
            ("../other/a.glb", "file:///home/artist/other/a.glb"),
            ("-", "standard-input"),
        ] {
            assert_eq!(uri(file, here), expected, "{file}");
        }
    }
}

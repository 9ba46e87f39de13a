//! The Khronos validator (npm package `gltf-validator`).

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// True if the node modules are there. Without them the tests are ignored, or fail where `VLM_REQUIRE_NPM=1` promises
/// that they are.
///
/// # Panics
/// If they are promised and absent.
#[must_use]
pub fn has_validator() -> bool {
    let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("js/node_modules/gltf-validator").is_dir();
    let required = std::env::var("VLM_REQUIRE_NPM").is_ok_and(|value| value == "1");
    assert!(found || !required, "tests/js has no node_modules although VLM_REQUIRE_NPM=1");
    found
}

/// The validator's report on each file.
///
/// # Panics
/// If it cannot be run.
#[must_use]
pub fn validate(files: &[PathBuf]) -> Vec<Value> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("js/validate.mjs");
    let output = Command::new("node").arg(script).args(files).output();
    let output = output.unwrap_or_else(|error| panic!("node: {error}"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}"))
}

/// The errors among a report's messages.
#[must_use]
pub fn errors(report: &Value) -> Vec<&Value> {
    let messages = report["messages"].as_array().map_or(&[][..], Vec::as_slice);
    messages.iter().filter(|message| message["severity"] == 0).collect()
}

//! Running programs, and baked files to run them on.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program.
pub const VLM: &str = env!("CARGO_BIN_EXE_vlm");

/// A path of the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// The npm packages of the tests; fails with a remedy where they were promised and are not there.
pub fn npm() -> PathBuf {
    let modules = repository("tests/js/node_modules");
    assert!(modules.is_dir(), "tests/js has no node_modules: run `npm ci --prefix tests/js`");
    modules
}

/// Runs `vlm` in a folder.
pub fn vlm(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(VLM).current_dir(folder).args(arguments).output().unwrap()
}

/// What a program said, both streams, for messages.
pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&[output.stdout.as_slice(), &output.stderr].concat()).into_owned()
}

/// Bakes an asset of the repository into a folder, small and fast.
pub fn bake(asset: &str, folder: &Path, name: &str) {
    let input = repository("assets").join(asset);
    let flags = ["--preset", "draft", "--lights", "120", "--probes", "500"];
    let arguments = [&["bake", input.to_str().unwrap(), "-o", name], flags.as_slice()].concat();
    let output = vlm(folder, &arguments);
    assert!(output.status.success(), "{}", said(&output));
}

/// The code of the first issue that `vlm check` finds; `None` if it finds the file good.
pub fn check(folder: &Path, name: &str) -> Option<String> {
    let output = vlm(folder, &["check", name, "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let issue = report[0]["issues"].get(0)?;
    Some(issue["code"].as_str().unwrap().to_owned())
}

//! `gltfpack -si 0.1` as a process.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// The version in PATH, or why there is none.
pub fn version(program: &str) -> Result<String, String> {
    let said = Command::new(program).arg("-v").output();
    let output = said.map_err(|_| "not installed".to_owned())?;
    let text = String::from_utf8_lossy(&output.stdout);
    text.lines()
        .next()
        .map(|line| line.trim().to_owned())
        .ok_or_else(|| "does not tell its version".to_owned())
}

/// Seconds that it takes to simplify a file to a tenth of its triangles, or why it did not.
pub fn seconds(program: &str, input: &Path, output: &Path) -> Result<f64, String> {
    let mut command = Command::new(program);
    command.arg("-i").arg(input).arg("-o").arg(output).args(["-si", "0.1"]);
    let start = Instant::now();
    let done = command.output().map_err(|error| error.to_string())?;
    let seconds = start.elapsed().as_secs_f64();
    if done.status.success() && output.exists() {
        return Ok(seconds);
    }
    let text = String::from_utf8_lossy(&done.stderr);
    Err(text.lines().next().unwrap_or("failed without a word").to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_there_is_not_installed() {
        assert_eq!(version("no-such-program-anywhere"), Err("not installed".to_owned()));
    }

    #[test]
    fn a_program_that_writes_nothing_gives_no_time() {
        let folder = tempfile::tempdir().unwrap();
        // `true` succeeds and writes nothing.
        assert!(seconds("true", Path::new("none.glb"), &folder.path().join("out.glb")).is_err());
    }
}

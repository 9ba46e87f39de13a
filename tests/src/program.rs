//! The program `vlm`, for tests that run it as a user does.

use std::path::PathBuf;
use std::process::{Command, Stdio};

/// Builds `vlm` in the profile of this test, where it is not there or old, and returns its path.
///
/// A test of one package has no way to say that it needs the program of another.
///
/// # Panics
/// If it cannot be built.
#[must_use]
pub fn vlm() -> PathBuf {
    // A test lies in `target/PROFILE/deps`.
    let test = std::env::current_exe().unwrap_or_default();
    let folder = test.ancestors().nth(2).map(PathBuf::from).unwrap_or_default();
    let profile = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let profile = if profile == "debug" { vec![] } else { vec!["--profile", profile.as_str()] };
    // A test of the program's own package needs it; built as tests are, it shares all that these share.
    let built = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["test", "--quiet", "--workspace", "--locked", "--no-run", "--test", "cli"])
        .args(profile)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .status();
    assert!(built.is_ok_and(|status| status.success()), "vlm cannot be built");
    folder.join(format!("vlm{}", std::env::consts::EXE_SUFFIX))
}

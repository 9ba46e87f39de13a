//! The committed scenes are what their generator makes, and the README's hashes are theirs.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;

#[test]
fn committed_scenes_are_what_the_generator_makes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets");
    let readme = std::fs::read_to_string(folder.join("README.md")).unwrap();
    for (name, bytes) in vlm_tests::cornell::all() {
        let committed = std::fs::read(folder.join(name)).unwrap();
        assert_eq!(committed, bytes, "{name}: run `cargo run -p vlm-tests --bin make-assets`");
        let row = readme.lines().find(|line| line.starts_with(&format!("| {name} "))).unwrap();
        assert!(row.contains(&blake3::hash(&bytes).to_hex().to_string()), "{name}: stale hash in the README");
    }
}

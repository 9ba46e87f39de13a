//! Gives the program a number that changes with its sources, for caches of what it made, and finds out whether the tests' npm packages are
//! here, so that a test which needs them reads "ignored" without, never "ok".

use std::env;
use std::fs;
use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};

/// Everything that decides which bytes a bake makes, relative to this package.
const SOURCES: [&str; 5] = ["src", "../vlm-format/src", "../shaders/src", "../Cargo.lock", "Cargo.toml"];

fn main() {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let mut hasher = DefaultHasher::new();
    for source in SOURCES {
        let path = root.join(source);
        if path.exists() {
            println!("cargo::rerun-if-changed={}", path.display());
        }
        add(&path, &mut hasher);
    }
    println!("cargo::rustc-env=VLM_BUILD={:016x}", hasher.finish());
    println!("cargo::rerun-if-changed=build.rs");
    find_npm(&root);
}

/// The packages of `tests/js`; where `VLM_REQUIRE_NPM=1` promises them, their absence fails the tests instead of hiding them.
fn find_npm(root: &Path) {
    let modules = root.join("../tests/js/node_modules/.package-lock.json");
    let promised = env::var_os("VLM_REQUIRE_NPM").is_some_and(|value| value == "1");
    println!("cargo::rerun-if-changed={}", modules.display());
    println!("cargo::rerun-if-env-changed=VLM_REQUIRE_NPM");
    println!("cargo::rustc-check-cfg=cfg(has_npm)");
    if promised || modules.exists() {
        println!("cargo::rustc-cfg=has_npm");
    }
}

fn add(path: &Path, hasher: &mut DefaultHasher) {
    let Ok(entries) = fs::read_dir(path) else {
        hasher.write(&fs::read(path).unwrap_or_default());
        return;
    };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        hasher.write(path.file_name().unwrap_or_default().as_encoded_bytes());
        add(&path, hasher);
    }
}

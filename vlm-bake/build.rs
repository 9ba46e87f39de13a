//! Gives the program a number that changes with its sources, for caches of what it made.

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

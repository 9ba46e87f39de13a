//! Finds out what this machine has, so that a test which needs something else reads "ignored", never "ok".

use std::env;
use std::path::{Path, PathBuf};

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let assets = env::var_os("VLM_ASSETS").map_or_else(|| root.join("../shared/assets"), PathBuf::from);
    let validator = root.join("tests/js/node_modules/gltf-validator");
    println!("cargo::rerun-if-env-changed=VLM_ASSETS");
    println!("cargo::rustc-env=VLM_ASSETS_FOLDER={}", assets.display());
    for (name, needed) in [
        ("has_scenes", assets.join("scenes/sponza.glb")),
        ("has_corpus", assets.join("corpus/CORE.txt")),
        ("has_validator", validator),
    ] {
        println!("cargo::rustc-check-cfg=cfg({name})");
        println!("cargo::rerun-if-changed={}", needed.display());
        if needed.exists() {
            println!("cargo::rustc-cfg={name}");
        }
    }
}

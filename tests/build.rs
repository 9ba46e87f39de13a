//! Finds out what this machine has, so that a test which needs something else reads "ignored", never "ok".

use std::env;
use std::path::{Path, PathBuf};

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let assets = env::var_os("VLM_ASSETS").map_or_else(|| root.join("../shared/assets"), PathBuf::from);
    let validator = root.join("tests/js/node_modules/gltf-validator");
    println!("cargo::rerun-if-env-changed=VLM_ASSETS");
    println!("cargo::rustc-env=VLM_ASSETS_FOLDER={}", assets.display());
    find_vulkan();
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

/// A Vulkan driver's manifest is there, or `VLM_REQUIRE_GPU` promises one.
fn find_vulkan() {
    println!("cargo::rustc-check-cfg=cfg(has_vulkan)");
    let folders = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"];
    let promised = ["VLM_REQUIRE_GPU", "VK_ICD_FILENAMES", "VK_DRIVER_FILES"].map(|name| {
        println!("cargo::rerun-if-env-changed={name}");
        env::var_os(name).is_some()
    });
    let found = folders.iter().any(|folder| {
        println!("cargo::rerun-if-changed={folder}");
        Path::new(folder).read_dir().is_ok_and(|mut entries| entries.next().is_some())
    });
    if found || promised.contains(&true) {
        println!("cargo::rustc-cfg=has_vulkan");
    }
}

//! Finds out what this machine has, so that a test which needs something else reads "ignored", never "ok".

use std::env;
use std::path::{Path, PathBuf};

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let assets = env::var_os("VLM_ASSETS").map_or_else(|| root.join("../shared/assets"), PathBuf::from);
    let validator = root.join("tests/js/node_modules/gltf-validator");
    // Where the validator is promised, its absence fails the tests instead of hiding them.
    let promised = env::var_os("VLM_REQUIRE_NPM").is_some_and(|value| value == "1");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=VLM_ASSETS");
    println!("cargo::rerun-if-env-changed=VLM_REQUIRE_NPM");
    println!("cargo::rustc-env=VLM_ASSETS_FOLDER={}", assets.display());
    find_python(&root);
    find_vulkan();
    for (name, needed, promised) in [
        ("has_scenes", assets.join("scenes/sponza.glb"), false),
        ("has_corpus", assets.join("corpus/CORE.txt"), false),
        ("has_validator", validator, promised),
    ] {
        println!("cargo::rustc-check-cfg=cfg({name})");
        println!("cargo::rerun-if-changed={}", needed.display());
        if promised || needed.exists() {
            println!("cargo::rustc-cfg={name}");
        }
    }
}

/// The virtual environment with the packages of `python/requirements.txt`, which `tests/run` makes; or
/// `VLM_REQUIRE_PYTHON=1` promises one. `VLM_PYTHON` may name another interpreter that has them.
fn find_python(root: &Path) {
    let python =
        env::var_os("VLM_PYTHON").map_or_else(|| root.join("target/python/bin/python"), PathBuf::from);
    let promised = env::var_os("VLM_REQUIRE_PYTHON").is_some_and(|value| value == "1");
    println!("cargo::rerun-if-env-changed=VLM_PYTHON");
    println!("cargo::rerun-if-env-changed=VLM_REQUIRE_PYTHON");
    println!("cargo::rerun-if-changed={}", python.display());
    println!("cargo::rustc-env=VLM_PYTHON={}", python.display());
    println!("cargo::rustc-check-cfg=cfg(has_python)");
    if promised || python.exists() {
        println!("cargo::rustc-cfg=has_python");
    }
}

/// A Vulkan driver's manifest is there, or `VLM_REQUIRE_GPU=1` promises one.
fn find_vulkan() {
    println!("cargo::rustc-check-cfg=cfg(has_vulkan)");
    let named = ["VK_ICD_FILENAMES", "VK_DRIVER_FILES"].map(|name| {
        println!("cargo::rerun-if-env-changed={name}");
        env::var_os(name).is_some()
    });
    println!("cargo::rerun-if-env-changed=VLM_REQUIRE_GPU");
    let promised = env::var_os("VLM_REQUIRE_GPU").is_some_and(|value| value == "1");
    let found = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"].iter().any(|folder| {
        println!("cargo::rerun-if-changed={folder}");
        Path::new(folder).read_dir().is_ok_and(|mut entries| entries.next().is_some())
    });
    if promised || found || named.contains(&true) {
        println!("cargo::rustc-cfg=has_vulkan");
    }
}

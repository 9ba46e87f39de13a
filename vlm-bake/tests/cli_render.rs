//! `vlm render` as a user or a script meets it.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use vlm_bake::picture::read_irradiance;

fn vlm(arguments: &[&str]) -> Output {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets");
    Command::new(env!("CARGO_BIN_EXE_vlm"))
        .current_dir(assets)
        .arg("render")
        .args(arguments)
        .output()
        .unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn the_report_has_the_keys_that_others_read() {
    let folder = tempfile::tempdir().unwrap();
    let (png, exr) = (folder.path().join("p.png"), folder.path().join("e.exr"));
    let files = ["--out", png.to_str().unwrap(), "--irradiance", exr.to_str().unwrap()];
    let reference = ["cornell.glb", "--size", "24x16", "--method", "reference", "--spp", "4", "--json"];
    let output = vlm(&[&reference[..], &files].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(stderr(&output), "", "silent in a pipe");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let keys: Vec<&String> = report.as_object().unwrap().keys().collect();
    assert_eq!(keys, ["camera", "width", "height", "method", "seconds", "pairs_evaluated", "lights"]);
    assert_eq!((&report["method"], &report["width"]), (&"reference".into(), &24.into()));
    assert!(report["seconds"]["inject"].is_number() && report["seconds"]["gather"].is_number());
    let (width, height, irradiance) = read_irradiance(&exr).unwrap();
    assert_eq!((width, height), (24, 16));
    assert_eq!(irradiance[0], glam::Vec3::ZERO, "nothing is hit beside the box");
    assert!(irradiance[24 * 8 + 12].min_element() > 0.0);
    assert!(png.exists());
}

#[test]
fn what_cannot_run_exits_with_2_and_says_why() {
    let cases: [(&[&str], &str); 5] = [
        (&["nowhere.glb"], "nowhere.glb"),
        (&["cornell.glb", "--camera", "roof", "--method", "direct"], "`camera`"),
        (&["cornell.glb", "--size", "0x5"], "WIDTHxHEIGHT"),
        (&["cornell.glb", "--size", "99999x99999", "--method", "direct"], "99999"),
        (&["cornell.glb", "--size", "8x8", "--method", "direct", "--out", "no/folder/p.png"], "folder"),
    ];
    for (arguments, expected) in cases {
        let output = vlm(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(expected), "{arguments:?}: {}", stderr(&output));
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn a_file_without_lights_fails_the_check() {
    let output = vlm(&["cornell.glb", "--method", "brute"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("bake"), "{}", stderr(&output));
    let not_gltf = vlm(&["README.md"]);
    assert_eq!(not_gltf.status.code(), Some(1), "{}", stderr(&not_gltf));
}

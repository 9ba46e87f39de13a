//! `vlm-bench clearance` from flags to files, on the project's own scenes.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::process::Command;

use vlm_tests::clearance_bench::Row;

#[test]
fn a_small_run_writes_a_row_per_scene_and_budget() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("clearance");
    let assets = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets");
    let done = Command::new(env!("CARGO_BIN_EXE_vlm-bench"))
        .args(["clearance", assets, "no-such-file.glb", "--budgets", "50,0", "--out", out.to_str().unwrap()])
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert!(String::from_utf8_lossy(&done.stderr).contains("left out: no-such-file.glb"));
    let mut raw = csv::Reader::from_path(out.join("raw.csv")).unwrap();
    let rows: Vec<Row> = raw.deserialize().collect::<Result<_, _>>().unwrap();
    assert_eq!(rows.len(), 4);
    for row in &rows {
        assert!(row.points >= 200_000 && row.lights > 0 && row.mean_offset_m >= row.clearance_m, "{row:?}");
        assert_eq!((row.violations, row.objects_off), (0, 0), "{row:?}");
    }
    let table = std::fs::read_to_string(out.join("table.md")).unwrap();
    assert!(rows.iter().all(|row| table.contains(&row.scene)), "{table}");
}

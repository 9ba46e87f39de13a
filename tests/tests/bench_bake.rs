//! `vlm-bench bake` from flags to files, in a small run. Counts are checked, never seconds.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

fn bake(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vlm-bench")).arg("bake").args(args).output().unwrap()
}

/// Lines of `raw.csv` by column.
fn rows(folder: &Path) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(folder.join("raw.csv")).unwrap();
    reader.deserialize().collect::<Result<_, _>>().unwrap()
}

/// A run of two sizes and the Cornell box with `gltfpack` of that name.
fn run(folder: &Path, gltfpack: &str) -> (Vec<BTreeMap<String, String>>, String) {
    let what = ["--triangles", "1000,3000", "--scenes", "cornell", "--preset", "draft", "--repeats", "2"];
    let done = bake(&[&what[..], &["--gltfpack", gltfpack, "--out", folder.to_str().unwrap()]].concat());
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let table = std::fs::read_to_string(folder.join("table.md")).unwrap();
    assert_eq!(table, String::from_utf8(done.stdout).unwrap());
    (rows(folder), table)
}

#[test]
fn a_small_run_writes_rows_a_table_and_figures() {
    let folder = tempfile::tempdir().unwrap();
    let (rows, table) = run(folder.path(), "no-such-program-anywhere");
    assert_eq!(rows.len(), 3 * 2, "inputs, repeats");
    let number = |row: &BTreeMap<String, String>, column: &str| row[column].parse::<f64>().unwrap();
    for row in &rows {
        assert_eq!(row["tool"], "vlm");
        // Every stage of the bake has a time, and the whole is no shorter than its parts.
        let stages = ["patches", "decimate", "mend", "samples", "authored", "tag", "grid"];
        let sum: f64 = stages.iter().map(|stage| number(row, &format!("seconds_{stage}"))).sum();
        assert!(sum > 0.0 && sum <= number(row, "seconds_bake"));
        assert!(number(row, "seconds_bake") < number(row, "seconds_process"));
        assert!(number(row, "lights") >= 80.0, "{row:?}");
        if cfg!(target_os = "linux") {
            let peak = number(row, "peak_bytes");
            assert!((2e6..2e9).contains(&peak), "{peak}");
        }
    }
    let triangles = |input: &str| -> Vec<f64> {
        rows.iter().filter(|row| row["input"] == input).map(|row| number(row, "triangles")).collect()
    };
    assert_eq!(triangles("cornell"), [34.0, 34.0]);
    for asked in [1_000.0, 3_000.0] {
        let near = triangles("room").into_iter().filter(|made| (made / asked - 1.0f64).abs() < 0.1);
        assert_eq!(near.count(), 2, "{asked}");
    }
    // The same input gives the same lights in every repeat.
    let lights =
        |input: &str| rows.iter().filter(|r| r["input"] == input).map(|r| &r["lights"]).collect::<Vec<_>>();
    assert!(lights("cornell").windows(2).all(|pair| pair[0] == pair[1]));

    assert!(table.contains("| not installed |") && table.contains("**exponent**"), "{table}");
    assert!(!table.contains("80,000 triangles on"), "there are not two such rooms");
    for file in ["bake_seconds.svg", "bake_seconds.png", "bake_memory.svg", "bake_memory.png"] {
        assert!(folder.path().join(file).exists(), "{file}");
    }
}

/// A program that takes the place of `gltfpack`: it says a version, and copies its input, or fails.
#[cfg(unix)]
fn stand_in(folder: &Path, name: &str, last_line: &str) -> String {
    use std::os::unix::fs::PermissionsExt;
    let path = folder.join(name);
    let script = format!("#!/bin/sh\nif [ \"$1\" = -v ]; then echo 'stand-in 1.0'; exit; fi\n{last_line}\n");
    std::fs::write(&path, script).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
#[cfg(unix)]
fn the_other_tool_runs_on_the_same_files() {
    let folder = tempfile::tempdir().unwrap();
    let copies = stand_in(folder.path(), "copies", "[ \"$5 $6\" = '-si 0.1' ] && cp \"$2\" \"$4\"");
    let (rows, table) = run(folder.path(), &copies);
    assert_eq!(rows.iter().filter(|row| row["tool"] == "gltfpack").count(), 3 * 2);
    assert!(table.contains("stand-in 1.0") && !table.contains("not installed"), "{table}");

    let fails = stand_in(folder.path(), "fails", "exit 3");
    let (rows, table) = run(folder.path(), &fails);
    assert_eq!(rows.iter().filter(|row| row["tool"] == "gltfpack").count(), 0, "the negative control");
    assert!(table.contains("| failed |"), "{table}");
}

#[test]
fn what_is_wrong_is_said_and_nothing_is_printed() {
    for (args, expected) in [
        (&["--triangles", "1000", "--scenes", "nowhere"][..], "`nowhere`"),
        (&["--triangles", "7"], "--triangles"),
        (&["--preset", "best"], "--preset"),
    ] {
        let done = bake(args);
        assert_eq!(done.status.code(), Some(2));
        let message = String::from_utf8_lossy(&done.stderr);
        assert!(message.contains(expected) && done.stdout.is_empty(), "{message}");
    }
}

//! `vlm-bench grid` from flags to files, in a small run. Counts are checked, never seconds.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::path::Path;
use std::process::{Command, Output};

use vlm_tests::grid_bench::row::Row;

fn grid(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vlm-bench")).arg("grid").args(args).output().unwrap()
}

fn rows(folder: &Path) -> Vec<Row> {
    let mut reader = csv::Reader::from_path(folder.join("raw.csv")).unwrap();
    reader.deserialize().collect::<Result<_, _>>().unwrap()
}

#[test]
fn a_small_run_writes_rows_a_table_and_figures() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("runs/grid");
    let sizes = ["--scenes", "room,cornell", "--lights", "150,400", "--cells", "4,8", "--surface", "1000"];
    let done = grid(&[&sizes[..], &["--repeats", "2", "--out", out.to_str().unwrap()]].concat());
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));

    let rows = rows(&out);
    assert_eq!(rows.len(), 2 * 2 * 2 * 3 * 2, "scenes, lights, cells, builds, repeats");
    for row in &rows {
        assert!(row.entries > 0 && row.stored_cells > 0 && row.stored_cells <= row.cells, "{row:?}");
        let words = row.bytes / 4;
        match row.builder.as_str() {
            // A number and the start of its list for each stored cell, one start more, and the lists.
            "scatter" | "scatter to surface" => {
                assert_eq!(words, 2 * row.stored_cells + 1 + row.entries);
                assert!(0 < row.tests && row.tests < row.lights * row.cells);
            }
            // Padded lists.
            "thesis" => {
                assert_eq!((words, row.stored_cells), (128 * row.cells, row.cells));
                assert_eq!(row.tests, row.lights * row.cells);
            }
            other => panic!("{other}"),
        }
    }
    let entries = |builder: &str, cells: u32| {
        let of = rows.iter().filter(|r| r.builder == builder && r.cells_per_axis == cells);
        of.map(|row| row.entries).sum::<u64>()
    };
    assert!(entries("scatter", 8) > entries("scatter", 4), "finer cells hold more entries");

    let table = std::fs::read_to_string(out.join("table.md")).unwrap();
    assert_eq!(table, String::from_utf8(done.stdout).unwrap());
    assert!(table.contains("## room") && table.contains("## cornell") && !table.contains("not run"));
    for file in ["room_grid.svg", "room_grid.png", "cornell_grid.svg", "cornell_grid.png"] {
        assert!(out.join(file).exists(), "{file}");
    }
}

#[test]
fn what_is_wrong_is_said_and_nothing_is_printed() {
    for (args, expected) in [
        (&["--scenes", "nowhere"][..], "`nowhere`: besides `room`, there are "),
        (&["--cells", "0"], "--cells"),
        (&["--lights", "many"], "--lights"),
        (&["--range", "NaN"], "--range"),
        (&["--limit", "0"], "--limit"),
    ] {
        let done = grid(args);
        assert_eq!(done.status.code(), Some(2));
        let message = String::from_utf8_lossy(&done.stderr);
        assert!(!message.contains("ignored"), "{message}");
        assert!(message.contains(expected) && done.stdout.is_empty(), "{message}");
    }
}

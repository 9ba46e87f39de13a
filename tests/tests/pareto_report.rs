//! A run's folder becomes its summary, figures and contact sheets; what is wrong with it is named.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use image::{Rgb, Rgb32FImage};
use vlm_tests::pareto::report;
use vlm_tests::pareto::row::Row;

/// Knob, seconds, factor on the truth.
type Setting = (&'static str, f64, f32);

/// Settings of each method.
const METHODS: &[(&str, &[Setting])] = &[
    ("direct", &[("", 0.0, 0.0)]),
    ("thesis", &[("range=1.5", 0.002, 0.3), ("range=4.5", 0.006, 0.7), ("range=8", 0.02, 0.8)]),
    ("vlm", &[("preset=draft lights=116", 0.003, 0.75), ("preset=game lights=464", 0.01, 0.9)]),
];

fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for camera in ["left", "far end"] {
        for (method, settings) in METHODS {
            for (knob, seconds, factor) in *settings {
                for repeat in 0..3u32 {
                    rows.push(Row {
                        scene: "made up/hall".to_owned(),
                        camera: camera.to_owned(),
                        width: 16,
                        height: 8,
                        method: (*method).to_owned(),
                        knob: (*knob).to_owned(),
                        backend: "cpu".to_owned(),
                        device: "none".to_owned(),
                        repeat,
                        seconds_gather: seconds * (1.0 + 0.1 * f64::from(repeat)),
                        relative_rmse: f64::from(1.0 - factor),
                        algorithm_rmse: (*method == "thesis").then_some(0.1),
                        truth_suffices: true,
                        ..Row::default()
                    });
                }
            }
        }
    }
    rows
}

fn write_picture(path: &Path, factor: f32, (width, height): (u32, u32)) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let pixel = |x: u32, y: u32| Rgb([x as f32, y as f32, 1.0].map(|channel| (channel + 1.0) * factor));
    Rgb32FImage::from_fn(width, height, pixel).save(path).unwrap();
}

fn write_rows(folder: &Path, rows: &[Row]) {
    let mut csv = csv::Writer::from_path(folder.join("raw.csv")).unwrap();
    rows.iter().for_each(|row| csv.serialize(row).unwrap());
    csv.flush().unwrap();
}

fn run_folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_rows(folder.path(), &rows());
    for camera in ["left", "far_end"] {
        let images = folder.path().join("images/made_up-hall").join(camera);
        write_picture(&images.join("truth.exr"), 1.0, (16, 8));
        for (method, settings) in METHODS {
            for (knob, _, factor) in *settings {
                let name = format!("{method} {knob}").trim().replace(' ', "_");
                write_picture(&images.join(format!("{name}.exr")), *factor, (16, 8));
            }
        }
    }
    folder
}

/// The files that the report adds, with their bytes.
fn written(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_file());
    let named = files
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(&path).unwrap()));
    named.filter(|(name, _)| name != "raw.csv").collect()
}

fn complaint(folder: &Path) -> String {
    report(folder).unwrap_err().to_string()
}

#[test]
fn a_run_gets_its_summary_figures_and_sheets_and_the_same_ones_again() {
    let folder = run_folder();
    report(folder.path()).unwrap();
    let first = written(folder.path());
    let names: Vec<&str> = first.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "made_up-hall_far_end_sheet.png",
            "made_up-hall_left_sheet.png",
            "made_up-hall_pareto.png",
            "made_up-hall_pareto.svg",
            "made_up-hall_split.png",
            "made_up-hall_split.svg",
            "summary.md",
        ]
    );
    let summary = String::from_utf8(first["summary.md"].clone()).unwrap();
    for link in summary.split("](").skip(1).map(|rest| rest.split(')').next().unwrap()) {
        assert!(names.contains(&link), "{link}");
    }
    report(folder.path()).unwrap();
    assert_eq!(written(folder.path()), first);
}

#[test]
fn the_figures_follow_the_rows() {
    let folder = run_folder();
    report(folder.path()).unwrap();
    let before = written(folder.path());
    let mut rows = rows();
    rows.iter_mut().filter(|row| row.method == "vlm").for_each(|row| row.relative_rmse *= 1.3);
    write_rows(folder.path(), &rows);
    report(folder.path()).unwrap();
    let after = written(folder.path());
    let changed = |name: &str| before[name] != after[name];
    assert!(
        changed("made_up-hall_pareto.svg") && changed("made_up-hall_pareto.png") && changed("summary.md")
    );
}

#[test]
fn without_pictures_there_are_no_sheets_and_the_rest_is_there() {
    let folder = run_folder();
    fs::remove_dir_all(folder.path().join("images")).unwrap();
    report(folder.path()).unwrap();
    assert_eq!(written(folder.path()).len(), 5);
    let summary = fs::read_to_string(folder.path().join("summary.md")).unwrap();
    assert!(!summary.contains("sheet.png"), "{summary}");
    assert_eq!(summary.matches("Contact sheet not kept.").count(), 2, "{summary}");
}

#[test]
fn sheets_outlive_their_pictures_and_only_those_that_are_there_are_shown() {
    let folder = run_folder();
    report(folder.path()).unwrap();
    fs::remove_dir_all(folder.path().join("images")).unwrap();
    fs::remove_file(folder.path().join("made_up-hall_left_sheet.png")).unwrap();
    report(folder.path()).unwrap();
    let summary = fs::read_to_string(folder.path().join("summary.md")).unwrap();
    assert!(summary.contains("(made_up-hall_far_end_sheet.png)"), "{summary}");
    assert!(!summary.contains("left_sheet.png"), "{summary}");
    assert_eq!(summary.matches("Contact sheet not kept.").count(), 1, "{summary}");
}

#[test]
fn a_missing_or_odd_picture_is_named() {
    let folder = run_folder();
    let images = folder.path().join("images/made_up-hall/left");
    write_picture(&images.join("direct.exr"), 0.0, (8, 8));
    let message = complaint(folder.path());
    assert!(
        message.contains("direct.exr") && message.contains("(8, 8)") && message.contains("repeat"),
        "{message}"
    );
    fs::remove_file(images.join("truth.exr")).unwrap();
    let message = complaint(folder.path());
    assert!(message.contains("truth.exr") && message.contains("repeat the run"), "{message}");
}

#[test]
fn rows_that_cannot_be_are_named_by_line() {
    let folder = run_folder();
    let with = |change: &dyn Fn(&mut Vec<Row>)| {
        let mut rows = rows();
        change(&mut rows);
        write_rows(folder.path(), &rows);
        complaint(folder.path())
    };
    assert!(with(&|rows| rows[4].relative_rmse = f64::NAN).contains("line 6: relative_rmse is NaN"));
    assert!(with(&|rows| rows[0].seconds_gather = -1.0).contains("line 2: seconds_gather is -1"));
    assert!(with(&|rows| rows[4] = rows[3].clone()).contains("line 6: the same sample as line 5"));
    let written = fs::read_to_string(folder.path().join("raw.csv")).unwrap();
    fs::write(folder.path().join("raw.csv"), written.replacen(",cpu,none,0,", ",cpu,none,many,", 1)).unwrap();
    let number = complaint(folder.path());
    assert!(number.contains("line 2: repeat: invalid digit"), "{number}");
    fs::write(folder.path().join("raw.csv"), "scene,camera\na,b\n").unwrap();
    assert!(complaint(folder.path()).contains("raw.csv"));
    fs::write(folder.path().join("raw.csv"), "").unwrap();
    let empty = complaint(folder.path());
    assert!(empty.contains("no samples") && empty.contains("vlm-bench pareto"), "{empty}");
    fs::remove_file(folder.path().join("raw.csv")).unwrap();
    assert!(complaint(folder.path()).contains("raw.csv"));
}

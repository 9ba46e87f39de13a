//! A guard against regressions that cannot flake: counts and errors of every method in the Cornell box, no seconds.
//!
//! `VLM_UPDATE_EXPECTED=1 cargo test -p vlm-tests --test guard` writes the expectations anew; look at the difference
//! before you commit it.
//!
//! Counts (lights, pairs, rays, bytes) must be equal. They follow from IEEE arithmetic in a fixed order, and random directions
//! come from a sine and cosine of our own choice, so they are the same on every x86-64 processor, with any number of
//! threads, in every profile. A build for another instruction set (`-C target-cpu`) may fuse multiplications and
//! additions and is not covered.
//!
//! Errors may differ by [`TOLERANCE`]. The truth draws its directions with the system's sine and cosine, whose last bit is
//! not the same everywhere; then a ray in some hundred thousand meets another triangle, and a pixel's mean of 256
//! directions moves by less than a hundredth. Over the picture that is below `1e-4` of the error. A change of method
//! moves errors by more than `1e-3` or is not worth a guard.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use vlm_tests::method::Backend;
use vlm_tests::pareto::report::read_rows;
use vlm_tests::pareto::row::Row;
use vlm_tests::pareto::run::{RunOptions, run};
use vlm_tests::truth::Spp;

/// Allowed change of an error, relative.
const TOLERANCE: f64 = 1e-3;

/// Allowed change of an error, absolute: the algorithm error of exact methods is rounding, some 1e-6.
const ROUNDING: f64 = 1e-5;

/// What is guarded of a row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Expected {
    method: String,
    knob: String,
    repeat: u32,
    lights: u32,
    pairs: u64,
    rays: u64,
    bytes: u64,
    relative_rmse: f64,
    rel_mse: f64,
    signed_energy: f64,
    p99: f64,
    largest_jump: f64,
    frame_change: f64,
    algorithm_rmse: Option<f64>,
    truth_noise: f64,
}

impl From<&Row> for Expected {
    fn from(row: &Row) -> Self {
        Self {
            method: row.method.clone(),
            knob: row.knob.clone(),
            repeat: row.repeat,
            lights: row.lights,
            pairs: row.pairs,
            rays: row.rays,
            bytes: row.bytes,
            relative_rmse: row.relative_rmse,
            rel_mse: row.rel_mse,
            signed_energy: row.signed_energy,
            p99: row.p99,
            largest_jump: row.largest_jump,
            frame_change: row.frame_change,
            algorithm_rmse: row.algorithm_rmse,
            truth_noise: row.truth_noise,
        }
    }
}

impl Expected {
    fn counts(&self) -> [u64; 4] {
        [u64::from(self.lights), self.pairs, self.rays, self.bytes]
    }

    fn errors(&self) -> [(&'static str, f64); 8] {
        [
            ("relative_rmse", self.relative_rmse),
            ("rel_mse", self.rel_mse),
            ("signed_energy", self.signed_energy),
            ("p99", self.p99),
            ("largest_jump", self.largest_jump),
            ("frame_change", self.frame_change),
            ("algorithm_rmse", self.algorithm_rmse.unwrap_or(-1.0)),
            ("truth_noise", self.truth_noise),
        ]
    }

    /// Errors to six digits, so that a refresh changes only what changed.
    fn rounded(&self) -> Self {
        let round = |x: f64| format!("{x:.5e}").parse().unwrap();
        Self {
            relative_rmse: round(self.relative_rmse),
            rel_mse: round(self.rel_mse),
            signed_energy: round(self.signed_energy),
            p99: round(self.p99),
            largest_jump: round(self.largest_jump),
            frame_change: round(self.frame_change),
            algorithm_rmse: self.algorithm_rmse.map(round),
            truth_noise: round(self.truth_noise),
            ..self.clone()
        }
    }

    fn name(&self) -> String {
        format!("{} {} repeat {}", self.method, self.knob, self.repeat)
    }
}

/// Everything in which a run differs from what is expected.
fn differences(found: &[Expected], expected: &[Expected]) -> Vec<String> {
    let names = |rows: &[Expected]| rows.iter().map(Expected::name).collect::<Vec<_>>();
    if names(found) != names(expected) {
        return vec![format!("methods or settings: {:?}, expected {:?}", names(found), names(expected))];
    }
    let mut differences = Vec::new();
    for (found, expected) in found.iter().zip(expected) {
        let name = found.name();
        if found.counts() != expected.counts() {
            let (found, expected) = (found.counts(), expected.counts());
            differences.push(format!("{name}: lights, pairs, rays, bytes {found:?}, expected {expected:?}"));
        }
        for ((metric, found), (_, expected)) in found.errors().into_iter().zip(expected.errors()) {
            // NaN fails this comparison.
            let is_close = (found - expected).abs() <= TOLERANCE * expected.abs() + ROUNDING;
            if !is_close {
                differences.push(format!("{name}: {metric} {found}, expected {expected}"));
            }
        }
    }
    differences
}

fn expectations() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("expected/cornell.csv")
}

fn read_expectations() -> Vec<Expected> {
    csv::Reader::from_path(expectations()).unwrap().deserialize().collect::<Result<_, _>>().unwrap()
}

#[test]
fn counts_and_errors_are_as_expected() {
    let folder = tempfile::tempdir().unwrap();
    let options = RunOptions {
        scenes: vec!["cornell".to_owned()],
        out: folder.path().join("run"),
        size: Some((32, 32)),
        repeats: 2,
        backend: Backend::Cpu,
        methods: None,
        cache: folder.path().join("truth"),
        spp: Spp { first: 256, most: 256 },
    };
    let outcome = run(&options, &|_| ()).unwrap();
    assert!(outcome.refused.is_empty(), "{:?}", outcome.refused);
    assert_eq!(read_rows(&options.out.join("raw.csv")).unwrap(), outcome.rows, "raw.csv holds every row");
    let pictures = options.out.join("images/cornell/camera");
    assert!(pictures.join("truth.exr").exists() && pictures.join("direct.exr").exists());

    let found: Vec<Expected> = outcome.rows.iter().map(Expected::from).collect();
    if std::env::var_os("VLM_UPDATE_EXPECTED").is_some_and(|value| value == "1") {
        let mut writer = csv::Writer::from_path(expectations()).unwrap();
        found.iter().for_each(|row| writer.serialize(row.rounded()).unwrap());
        writer.flush().unwrap();
    }
    let differences = differences(&found, &read_expectations());
    assert!(differences.is_empty(), "{}", differences.join("\n"));
}

#[test]
fn the_guard_sees_every_kind_of_change() {
    let expected = read_expectations();
    assert!(expected.len() > 50);
    assert!(differences(&expected, &expected).is_empty());
    let changes: [fn(&mut Expected); 11] = [
        |row| row.lights += 1,
        |row| row.pairs += 1,
        |row| row.rays += 1,
        |row| row.bytes += 1,
        |row| row.relative_rmse *= 1.002,
        |row| row.signed_energy += 0.003,
        |row| row.largest_jump *= 0.99,
        |row| row.frame_change += 1e-4,
        |row| row.algorithm_rmse = None,
        |row| row.truth_noise = f64::NAN,
        |row| row.knob.push('x'),
    ];
    // A row with lights, so that every number of it is above 0.
    let row = expected.iter().position(|row| row.method == "thesis").unwrap();
    for (number, change) in changes.into_iter().enumerate() {
        let mut changed = expected.clone();
        change(&mut changed[row]);
        assert_eq!(differences(&changed, &expected).len(), 1, "change {number}");
    }
    assert!(!differences(&expected[1..], &expected).is_empty(), "a row is missing");
}

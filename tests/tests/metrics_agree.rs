//! The metrics agree with an independent evaluation: numpy, and the package `flip-evaluator` (tests/metrics_check.py).

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::path::{Path, PathBuf};
use std::process::Command;

use glam::Vec3;
use image::{Rgb, Rgb32FImage};
use serde_json::Value;
use vlm_tests::metrics::{Comparison, compare_shown, frame_change};

const WIDTH: usize = 96;
const HEIGHT: usize = 64;
/// How far a metric may be from the independent one.
const TOLERANCE: f64 = 1e-4;

/// The interpreter that has the packages. Without it the tests are ignored, or fail where `VLM_REQUIRE_PYTHON=1` promises
/// that it is there.
fn python() -> Option<PathBuf> {
    let python = PathBuf::from(env!("VLM_PYTHON"));
    let required = std::env::var("VLM_REQUIRE_PYTHON").is_ok_and(|value| value == "1");
    assert!(python.is_file() || !required, "`{}` is absent although VLM_REQUIRE_PYTHON=1", python.display());
    python.is_file().then_some(python)
}

/// Two pictures with smooth shades, edges, a bright spot, deep shadow and pixels without surface.
struct Pair {
    image: Vec<Vec3>,
    truth: Vec<Vec3>,
    hit: Vec<bool>,
}

fn scene() -> Pair {
    let pixel = |i: usize| {
        let (x, y) = ((i % WIDTH) as f32 / WIDTH as f32, (i / WIDTH) as f32 / HEIGHT as f32);
        let stripes = if (i / 7 + i / WIDTH).is_multiple_of(3) { 1.0 } else { 0.4 };
        Vec3::new(40.0 * x + 2.0, 25.0 * (1.0 - y), 30.0 * x * y + 0.5) * stripes
    };
    let mut truth: Vec<Vec3> = (0..WIDTH * HEIGHT).map(pixel).collect();
    truth[WIDTH * 9 + 40] = Vec3::new(900.0, 700.0, 500.0);
    truth[WIDTH * 30..WIDTH * 32].fill(Vec3::splat(1e-3));
    let hit: Vec<bool> = (0..truth.len()).map(|i| i % WIDTH > 5 || i / WIDTH > 20).collect();
    // What does not count holds nonsense in one of them.
    let mut image = truth.clone();
    image.iter_mut().zip(&hit).filter(|(_, hit)| !**hit).for_each(|(pixel, _)| *pixel = Vec3::splat(77.0));
    Pair { image, truth, hit }
}

impl Pair {
    /// Changes what counts of the image.
    fn changed(mut self, change: impl Fn(&[Vec3], usize) -> Vec3) -> Self {
        let before = self.image.clone();
        for i in (0..before.len()).filter(|&i| self.hit[i]) {
            self.image[i] = change(&before, i);
        }
        self
    }

    fn ours(&self) -> Value {
        let Self { image, truth, hit } = self;
        let metrics = compare_shown(&Comparison { width: WIDTH, image, truth, hit }).unwrap();
        let mut value = serde_json::to_value(metrics).unwrap();
        value["frame_change"] = frame_change(truth, image, truth, hit).unwrap().into();
        value
    }

    fn theirs(&self, python: &Path) -> Value {
        let folder = tempfile::tempdir().unwrap();
        let hit: Vec<Vec3> = self.hit.iter().map(|&hit| Vec3::splat(f32::from(u8::from(hit)))).collect();
        let files = [("image", &self.image), ("truth", &self.truth), ("hit", &hit)].map(|(name, pixels)| {
            let path = folder.path().join(name).with_extension("exr");
            let picture = Rgb32FImage::from_fn(WIDTH as u32, HEIGHT as u32, |x, y| {
                Rgb(pixels[y as usize * WIDTH + x as usize].to_array())
            });
            picture.save(&path).unwrap();
            path
        });
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("metrics_check.py");
        let output = Command::new(python).arg(script).args(files).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    }
}

/// Names of the metrics that differ by more than the tolerance, times values above 1.
fn differences(ours: &Value, theirs: &Value) -> Vec<String> {
    let (ours, theirs) = (ours.as_object().unwrap(), theirs.as_object().unwrap());
    assert!(
        ours.len() == theirs.len() && ours.keys().all(|key| theirs.contains_key(key)),
        "{ours:?} {theirs:?}"
    );
    let differ = |key: &&String| {
        let (a, b) = (ours[*key].as_f64().unwrap(), theirs[*key].as_f64().unwrap());
        (a - b).abs() > TOLERANCE * b.abs().max(1.0)
    };
    ours.keys().filter(differ).cloned().collect()
}

#[test]
#[cfg_attr(not(has_python), ignore = "target/python has no numpy, OpenEXR and flip-evaluator: run tests/run")]
fn every_metric_agrees_with_numpy_and_flip_evaluator() {
    let Some(python) = python() else { return };
    let pairs = [
        ("itself", scene()),
        ("scaled", scene().changed(|image, i| image[i] * 1.05)),
        ("shifted", scene().changed(|image, i| image[i.saturating_sub(1)])),
        ("swapped", scene().changed(|image, i| Vec3::new(image[i].z, image[i].y, image[i].x))),
        ("dark", scene().changed(|image, i| image[i] * 0.1)),
        ("spotted", scene().changed(|image, i| image[i] + if i == 3000 { 2000.0 } else { 0.0 })),
        ("noisy", scene().changed(|image, i| image[i] * (0.5 + (i * 37 % 101) as f32 / 100.0))),
    ];
    for (name, pair) in pairs {
        let (ours, theirs) = (pair.ours(), pair.theirs(&python));
        assert_eq!(differences(&ours, &theirs), Vec::<String>::new(), "{name}:\n{ours}\n{theirs}");
    }
}

#[test]
#[cfg_attr(not(has_python), ignore = "target/python has no numpy, OpenEXR and flip-evaluator: run tests/run")]
fn the_comparison_sees_other_pictures() {
    let Some(python) = python() else { return };
    let ours = scene().changed(|image, i| image[i] * 1.05).ours();
    let theirs = scene().changed(|image, i| image[i] * 1.052).theirs(&python);
    let differing = differences(&ours, &theirs);
    for metric in ["relative_rmse", "signed_energy", "flip", "frame_change", "p99", "largest_jump"] {
        assert!(differing.iter().any(|name| name == metric), "{metric}: {differing:?}");
    }
}

#[test]
fn what_was_done_to_the_picture_is_what_the_metrics_read() {
    let itself = scene().ours();
    assert_eq!((itself["relative_rmse"].as_f64(), itself["flip"].as_f64()), (Some(0.0), Some(0.0)));
    let scaled = scene().changed(|image, i| image[i] * 1.05).ours();
    assert!((scaled["relative_rmse"].as_f64().unwrap() - 0.05).abs() < 1e-6, "{scaled}");
    let shifted = scene().changed(|image, i| image[i.saturating_sub(1)]).ours();
    let swapped = scene().changed(|image, i| Vec3::new(image[i].z, image[i].y, image[i].x)).ours();
    for seen in [shifted, swapped] {
        assert!(seen["relative_rmse"].as_f64() > Some(0.1) && seen["flip"].as_f64() > Some(0.02), "{seen}");
    }
}

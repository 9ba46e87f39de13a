//! A bake that is cancelled stops soon, whatever it is at, and says so.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use vlm_bake::bake::{Bake, BakeError, bake};
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Progress;
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_format::GltfFile;

/// Cancels itself at some point, and counts what happens afterwards.
#[derive(Default)]
struct Impatient {
    /// The stage at whose beginning it is cancelled.
    at_stage: Option<&'static str>,
    /// Steps of the stage `transport` after which it is.
    after_rows: Option<u64>,
    /// How often it may be asked before it is.
    after_questions: Option<u64>,
    cancelled: AtomicBool,
    stages: Mutex<Vec<&'static str>>,
    rows: AtomicU64,
    questions: AtomicU64,
    steps_afterwards: AtomicU64,
    stages_afterwards: AtomicU64,
}

impl Progress for Impatient {
    fn begin(&self, stage: &'static str, _length: u64) {
        self.stages.lock().unwrap().push(stage);
        self.stages_afterwards.fetch_add(u64::from(self.cancelled.load(Ordering::SeqCst)), Ordering::SeqCst);
        if self.at_stage == Some(stage) {
            self.cancelled.store(true, Ordering::SeqCst);
        }
    }

    fn advance(&self, steps: u64) {
        if self.cancelled.load(Ordering::SeqCst) {
            self.steps_afterwards.fetch_add(steps, Ordering::SeqCst);
        }
        if self.stages.lock().unwrap().last() == Some(&"transport") {
            let rows = self.rows.fetch_add(steps, Ordering::SeqCst) + steps;
            if self.after_rows.is_some_and(|most| rows >= most) {
                self.cancelled.store(true, Ordering::SeqCst);
            }
        }
    }

    fn is_cancelled(&self) -> bool {
        let asked = self.questions.fetch_add(1, Ordering::SeqCst);
        if self.after_questions.is_some_and(|most| asked >= most) {
            self.cancelled.store(true, Ordering::SeqCst);
        }
        self.cancelled.load(Ordering::SeqCst)
    }
}

fn cornell() -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb");
    load(&GltfFile::open(&path).unwrap(), &LoadOptions::default()).unwrap()
}

fn try_bake(scene: &Scene, progress: &Impatient) -> Result<Bake, BakeError> {
    let mut options = BakeOptions::preset(Preset::Draft, scene.triangles.len());
    options.lights = 120;
    bake(scene, &options, progress)
}

/// Rows that other threads may have begun when one cancels.
fn threads() -> u64 {
    std::thread::available_parallelism().map_or(64, |n| 2 * n.get() as u64)
}

#[test]
fn at_every_stage() {
    let scene = cornell();
    let whole = Impatient::default();
    assert!(try_bake(&scene, &whole).unwrap().asset.grid.is_some(), "nobody cancelled");
    let stages = whole.stages.into_inner().unwrap();
    assert!(stages.len() >= 9 && stages.contains(&"transport") && stages.contains(&"mend"), "{stages:?}");
    for (number, &stage) in stages.iter().enumerate() {
        let progress = Impatient { at_stage: Some(stage), ..Impatient::default() };
        let result = try_bake(&scene, &progress);
        assert_eq!(result.err(), Some(BakeError::Cancelled), "{stage}");
        assert_eq!(progress.stages.lock().unwrap()[..], stages[..=number], "{stage}");
        assert_eq!(progress.steps_afterwards.load(Ordering::SeqCst), 0, "{stage}");
        assert_eq!(progress.stages_afterwards.load(Ordering::SeqCst), 0, "{stage}");
    }
}

#[test]
fn amid_the_rows() {
    let scene = cornell();
    let progress = Impatient { after_rows: Some(20), ..Impatient::default() };
    assert_eq!(try_bake(&scene, &progress).err(), Some(BakeError::Cancelled));
    let more = progress.steps_afterwards.load(Ordering::SeqCst);
    assert!(more <= threads(), "{more} rows were begun afterwards");
}

/// Whichever question it answers first with yes, also those within a stage.
#[test]
fn at_any_question() {
    let scene = cornell();
    let whole = Impatient::default();
    assert!(try_bake(&scene, &whole).is_ok());
    let all = whole.questions.load(Ordering::SeqCst);
    assert!(all > 100, "{all} questions");
    let mut most = 0;
    while most < all {
        let progress = Impatient { after_questions: Some(most), ..Impatient::default() };
        assert_eq!(try_bake(&scene, &progress).err(), Some(BakeError::Cancelled), "question {most} of {all}");
        most += 1 + most / 2;
    }
    let progress = Impatient { after_questions: Some(all), ..Impatient::default() };
    assert!(try_bake(&scene, &progress).is_ok(), "nobody asked so often");
}

//! Every method must prove that it computes light, and the proof can fail.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::Vec3;
use vlm_bake::options::Preset;
use vlm_tests::method::{Cost, Method, MethodError, Picture, Prepared, Stage, View};
use vlm_tests::methods::{ALL, ddgi::Ddgi, instant_radiosity::InstantRadiosity, thesis::Thesis, vlm::Vlm};
use vlm_tests::proof::{Refusal, check, known_scenes, mean_irradiance, prove_method};
use vlm_tests::thesis::ThesisOptions;

/// A method whose pictures are changed.
struct Changed<'a> {
    method: &'a dyn Method,
    change: fn(Vec3) -> Vec3,
    gives_indirect_light: bool,
}

struct ChangedPrepared {
    prepared: Box<dyn Prepared>,
    change: fn(Vec3) -> Vec3,
}

impl Method for Changed<'_> {
    fn name(&self) -> &'static str {
        self.method.name()
    }

    fn knob(&self) -> String {
        self.method.knob()
    }

    fn gives_indirect_light(&self) -> bool {
        self.gives_indirect_light
    }

    fn prepare(&self, stage: &Stage<'_>) -> Result<Box<dyn Prepared>, MethodError> {
        Ok(Box::new(ChangedPrepared { prepared: self.method.prepare(stage)?, change: self.change }))
    }
}

impl Prepared for ChangedPrepared {
    fn render(&self, view: &View<'_>, frame: u32) -> Result<Picture, MethodError> {
        let picture = self.prepared.render(view, frame)?;
        Ok(Picture { indirect: picture.indirect.into_iter().map(self.change).collect(), ..picture })
    }

    fn cost(&self) -> Cost {
        self.prepared.cost()
    }
}

/// What a wrong method may do to every pixel: twice the widest tolerance too bright, channels swapped, black, a little
/// light where there is none, not a number.
const CHANGES: [fn(Vec3) -> Vec3; 5] =
    [|e| e * 1.11, |e| Vec3::new(e.z, e.y, e.x), |_| Vec3::ZERO, |e| e + Vec3::splat(1e-3), |e| e * f32::NAN];

#[test]
fn every_method_gives_the_known_answers_and_would_fail_with_others() {
    for entry in &ALL {
        let method = (entry.proof)();
        let scenes = known_scenes();
        let found = scenes.each_ref().map(|known| mean_irradiance(&*method, known).unwrap());
        let check_all = |change: fn(Vec3) -> Vec3| {
            let mut pairs = scenes.iter().zip(found);
            pairs.try_for_each(|(known, found)| check(&*method, known, change(found), entry.tolerance))
        };
        for (known, found) in scenes.iter().zip(found) {
            println!("{}: {}: {found}, known {}", entry.name, known.name, known.irradiance);
        }
        assert_eq!(check_all(|e| e), Ok(()), "{}", entry.name);
        for (number, change) in CHANGES.into_iter().enumerate().filter(|_| method.gives_indirect_light()) {
            let refusal = check_all(change);
            assert!(matches!(refusal, Err(Refusal::Wrong { .. })), "{} {number}: {refusal:?}", entry.name);
        }
    }
}

#[test]
fn the_proof_of_a_whole_method_refuses_a_changed_one() {
    let method = Vlm { preset: Preset::Game, lights: 1000, probes: 1.0 };
    assert_eq!(prove_method(&method, 0.03), Ok(()));
    for change in CHANGES {
        let changed = Changed { method: &method, change, gives_indirect_light: true };
        assert!(prove_method(&changed, 0.03).is_err());
    }
}

#[test]
fn only_a_method_that_says_so_may_give_nothing() {
    let direct = ALL.iter().find(|entry| entry.name == "direct").unwrap();
    let method = (direct.proof)();
    let silent = Changed { method: &*method, change: |e| e, gives_indirect_light: true };
    assert!(prove_method(&silent, 0.5).is_err());
    let glowing = Changed { method: &*method, change: |_| Vec3::splat(1e-3), gives_indirect_light: false };
    assert!(prove_method(&glowing, 0.5).is_err(), "it claims to give no light");
}

#[test]
fn settings_that_cut_light_off_are_refused() {
    let short = ThesisOptions { range: 1.5, list: 1024, grid: 16 };
    let narrow = ThesisOptions { range: 1e4, list: 16, grid: 1 };
    for options in [short, narrow] {
        assert!(prove_method(&Thesis { lights: 4000, options }, 0.02).is_err(), "{options:?}");
    }
    assert!(prove_method(&InstantRadiosity { lights: 4096, clamp: 0.8 }, 0.02).is_err());
    assert!(prove_method(&Ddgi { cells: 1.0, rays: 512 }, 0.05).is_err());
}

#[test]
fn frames_differ_where_random_numbers_are_drawn_and_repeat_by_number() {
    for entry in &ALL {
        let known = &known_scenes()[0];
        let trace = vlm_bake::shade::TraceScene::new(&known.scene);
        let stage = Stage::new(&trace);
        let view = View::new(&trace, &known.camera, (4, 4));
        let prepared = (entry.proof)().prepare(&stage).unwrap();
        let frame = |number| prepared.render(&view, number).unwrap().indirect;
        assert_eq!(frame(3), frame(3), "{}", entry.name);
        let is_random = ["instant_radiosity", "ddgi"].contains(&entry.name);
        assert_eq!(frame(3) != frame(4), is_random, "{}", entry.name);
    }
}

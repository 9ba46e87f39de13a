//! Random meshes: after the bake, neither the baker nor the checker, which shares no code with it, finds a fault.
//!
//! The cases are the same in every run; a failing one prints its parameters, to become a named test.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::cell::RefCell;

use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use vlm_bake::bake::bake;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_tests::hard_meshes::checker::{Kind, check};
use vlm_tests::hard_meshes::{HardMesh, random};

/// Cases a property. A case takes some tenths of a second.
const CASES: u32 = 24;

/// Runs a property over the same cases every time, and fails with the parameters of all that miss it.
fn for_all<S: Strategy>(strategy: &S, property: impl Fn(&S::Value) -> Result<(), String>) {
    let config = Config { cases: CASES, failure_persistence: None, ..Config::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let missed = RefCell::new(Vec::new());
    let run = runner.run(strategy, |parameters| {
        let missing = property(&parameters).err();
        missed.borrow_mut().extend(missing.map(|why| format!("{parameters:?}: {why}")));
        Ok(())
    });
    run.unwrap();
    let missed = missed.into_inner();
    assert!(missed.is_empty(), "{} of {CASES} cases fail:\n{}", missed.len(), missed.join("\n"));
}

/// Neither the report nor the checker finds light where none may be. Flux is another matter: small budgets cannot keep it.
fn is_clear(mesh: &HardMesh, lights: u32) -> Result<(), String> {
    let scene = mesh.scene().unwrap();
    let options = BakeOptions { lights, ..BakeOptions::preset(Preset::Game, scene.triangles.len()) };
    let made = bake(&scene, &options, &Silent).unwrap();
    let verdict = check(&scene, &made.asset);
    let found: Vec<_> = verdict.by_kind().into_iter().filter(|(kind, ..)| *kind != Kind::Flux).collect();
    let one = verdict.faults.iter().find(|f| f.kind != Kind::Flux);
    let reported = made.report.clearance;
    if found.is_empty() && reported.violations == 0 {
        return Ok(());
    }
    let tagged = 100.0 * verdict.tagged_share;
    Err(format!("{found:?} of {} lights, {tagged:.1} % tagged, one is {one:?}; {reported:?}", verdict.lights))
}

fn budget() -> impl Strategy<Value = u32> {
    prop_oneof![Just(60u32), Just(300), Just(1200)]
}

#[test]
fn noisy_balls() {
    let parameters = (any::<u64>(), 0.0..0.3f64, budget());
    for_all(&parameters, |&(seed, amplitude, lights)| is_clear(&random::noisy_ball(seed, amplitude), lights));
}

#[test]
fn prisms() {
    let parameters = (any::<u64>(), 3..12u32, 0.05..0.9f64, 0.01..1.5f64, budget());
    for_all(&parameters, |&(seed, corners, least, height, lights)| {
        is_clear(&random::random_prism(seed, corners, least, height), lights)
    });
}

#[test]
fn soups() {
    let parameters = (any::<u64>(), 2..7u32, budget());
    for_all(&parameters, |&(seed, bodies, lights)| is_clear(&random::soup(seed, bodies), lights));
}

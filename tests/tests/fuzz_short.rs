//! Damaged files: whatever a byte, a number or a cut does to a file, it opens and bakes or is refused, and nothing panics.
//!
//! The same targets and mutator as in `tests/fuzz`, over a fixed random stream: what fails here fails everywhere.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use vlm_tests::fuzzing::{Draw, Parts, Reached, format_reader, mutate, of_code, places, whole_bake};

/// Files that opened are changed further, and this many of them kept for it.
const KEPT: usize = 64;

/// How many inputs came how far.
#[derive(Debug, Default, PartialEq)]
struct Counts {
    refused: usize,
    opened: usize,
    done: usize,
}

/// Feeds so many changed files to a target. What it panics at is written to a file.
fn stream(name: &str, cases: u64, target: impl Fn(&[u8]) -> Reached) -> Result<Counts, PathBuf> {
    let mut counts = Counts::default();
    let mut pool: Vec<Vec<u8>> = of_code().into_iter().map(|(_, bytes)| bytes).collect();
    let seeds = pool.len();
    let mut draw = Draw::new(1);
    for case in 0..cases {
        let input = mutate(draw.of(&pool).unwrap(), case);
        let reached =
            catch_unwind(AssertUnwindSafe(|| target(&input))).map_err(|_| keep(name, case, &input))?;
        match reached {
            Reached::Refused => counts.refused += 1,
            Reached::Opened => counts.opened += 1,
            Reached::Done => counts.done += 1,
        }
        if reached == Reached::Done && pool.len() < seeds + KEPT {
            pool.push(input);
        } else if reached == Reached::Done && draw.one_in(4) {
            let place = seeds + draw.below(KEPT);
            pool[place] = input;
        }
    }
    println!("{name}: {counts:?}");
    Ok(counts)
}

/// Writes an input for a look at it, or for `tests/fuzz`.
fn keep(name: &str, case: u64, input: &[u8]) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}_{case}"));
    std::fs::write(&path, input).unwrap();
    path
}

#[test]
fn whatever_opens_is_written_and_read_again() {
    let counts = stream("format_reader", 12_000, format_reader)
        .unwrap_or_else(|path| panic!("see {}", path.display()));
    // The damage must be neither so crude that nothing opens nor so slight that everything does.
    assert!(counts.done > 3_000 && counts.refused > 3_000, "{counts:?}");
}

#[test]
fn whatever_opens_is_baked_or_refused() {
    let counts =
        stream("whole_bake", 800, whole_bake).unwrap_or_else(|path| panic!("see {}", path.display()));
    assert!(counts.done > 200 && counts.refused > 200, "{counts:?}");
}

#[test]
fn a_panic_is_kept_with_its_input() {
    // The negative control: a target that does not stand files with more than two meshes.
    let delicate = |bytes: &[u8]| {
        let parts = Parts::of(bytes);
        assert!(
            parts.is_none_or(|parts| parts.json["meshes"].as_array().is_none_or(|meshes| meshes.len() <= 2))
        );
        Reached::Done
    };
    let path = stream("delicate", 100, delicate).unwrap_err();
    assert!(Parts::of(&std::fs::read(path).unwrap()).unwrap().json["meshes"].as_array().unwrap().len() > 2);
}

#[test]
fn every_value_in_every_place_never_panics() {
    let (_, bytes) = of_code().into_iter().find(|(name, _)| name == "room_gltf_false").unwrap();
    let json: Value = serde_json::from_slice(&bytes).unwrap();
    let pointers = places(&json);
    let values = [
        json!(0),
        json!(1),
        json!(-1),
        json!(2.5),
        json!(5121),
        json!(0xFFFF_FFFF_u32),
        json!(u64::MAX),
        json!(1e39),
        json!(null),
        json!(true),
        json!("MAT3"),
        json!("data:;base64,AAAA"),
        json!([]),
        json!({}),
        json!([0, 0, 0]),
    ];
    let mut opened = 0;
    let mut draw = Draw::new(1);
    let tries = pointers.len() * values.len();
    for pointer in &pointers {
        for value in &values {
            let mut damaged = json.clone();
            *damaged.pointer_mut(pointer).unwrap() = value.clone();
            // A second change reaches what one alone is refused for.
            if let Some(place) = damaged.pointer_mut(draw.of(&pointers).unwrap()) {
                *place = draw.of(&values).unwrap().clone();
            }
            opened += usize::from(format_reader(damaged.to_string().as_bytes()) > Reached::Refused);
        }
    }
    assert!(opened > tries / 20, "only {opened} of {tries} opened");
    println!("{opened} of {tries} opened");
}

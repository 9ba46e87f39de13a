//! Writes files to start a fuzzer from: `cargo run -p vlm-tests --bin fuzz-seeds FOLDER`. Those of the test assets count where they are.

use std::path::PathBuf;
use std::process::ExitCode;

use vlm_tests::{assets, fuzzing};

/// Larger files slow the fuzzer down, and hold no more kinds of things.
const MOST_BYTES: usize = 20_000;

fn main() -> ExitCode {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("name the folder to write to, such as tests/fuzz/corpus/format_reader");
        return ExitCode::from(2);
    };
    let mut seeds = fuzzing::of_code();
    if let Some(corpus) = assets::find("corpus") {
        seeds.extend(fuzzing::of_files(&assets::gltf_files(&corpus), MOST_BYTES));
    }
    let written = std::fs::create_dir_all(&folder)
        .and_then(|()| seeds.iter().try_for_each(|(name, bytes)| std::fs::write(folder.join(name), bytes)));
    if let Err(error) = written {
        eprintln!("{}: {error}", folder.display());
        return ExitCode::from(2);
    }
    println!("{} files in {}", seeds.len(), folder.display());
    ExitCode::SUCCESS
}

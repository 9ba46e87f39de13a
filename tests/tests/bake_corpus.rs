//! Bakes every file of the corpus, valid or not, with the program that users run: it bakes or is refused with one clear line, soon and
//! within its memory, and what was baked is valid to us and to Khronos.
//!
//! `VLM_UPDATE_EXPECTED=1 cargo test --workspace --test bake_corpus` writes the table of outcomes anew; look at the difference before you
//! commit it.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::thread;
use std::time::Duration;

use serde_json::Value;
use vlm_tests::khronos::{errors, has_validator, validate};
use vlm_tests::limited::{Finished, Limits, run};
use vlm_tests::{assets, program};

/// What a bake may take: ten seconds of two cores. The largest scenes need more, and are refused by [`FLAGS`] before that.
const LIMITS: Limits =
    Limits { processor: Duration::from_secs(20), clock: Duration::from_secs(120), memory: 1 << 30 };

/// As rough as can be, one thread each: it is the outcome that counts.
const FLAGS: [&str; 10] =
    ["--preset", "draft", "--lights", "75", "--probes", "60", "--rays", "16", "--max-vertices", "400000"];

/// Bakes at a time.
const WORKERS: usize = 2;

/// Words of advice, of which every error has one.
const ADVICE: [&str; 18] = [
    "export",
    "check",
    "give",
    "Give",
    "ask for",
    "convert",
    "decode",
    "put the",
    "make the",
    "mend",
    "bake it",
    "recompute",
    "name the",
    "pass the",
    "allow",
    "divide",
    "move the",
    "leave out",
];

/// What became of a file.
struct Outcome {
    /// Relative to the corpus.
    file: String,
    /// Without what differs from run to run.
    line: String,
    /// The file baked, if it did.
    output: Option<PathBuf>,
}

#[test]
#[cfg_attr(not(has_corpus), ignore = "the corpus is neither in VLM_ASSETS nor in ../shared/assets")]
fn every_file_bakes_or_is_refused_in_one_line() {
    let Some(corpus) = assets::find("corpus") else { return };
    let vlm = program::vlm();
    let folder = tempfile::tempdir().unwrap();
    let outcomes = bake_all(&vlm, &corpus, folder.path());
    assert!(outcomes.len() >= 234, "only {} files in the corpus", outcomes.len());
    compare(&table(&outcomes));
    let baked: Vec<(PathBuf, PathBuf)> = outcomes
        .iter()
        .filter_map(|outcome| Some((corpus.join(&outcome.file), outcome.output.clone()?)))
        .collect();
    assert!(baked.len() > 100, "only {} files baked", baked.len());
    check_all(&vlm, &baked);
    if has_validator() {
        validate_all(&baked);
    }
}

fn bake_all(vlm: &Path, corpus: &Path, folder: &Path) -> Vec<Outcome> {
    let files = assets::gltf_files(corpus);
    let next = Mutex::new(files.iter().enumerate());
    let outcomes = Mutex::new(BTreeMap::new());
    thread::scope(|scope| {
        for _ in 0..WORKERS {
            scope.spawn(|| {
                loop {
                    let Some((number, file)) = next.lock().unwrap().next() else { break };
                    let output = folder.join(number.to_string()).join("baked.glb");
                    fs::create_dir(output.parent().unwrap()).unwrap();
                    let outcome = bake(vlm, corpus, file, output);
                    outcomes.lock().unwrap().insert(number, outcome);
                }
            });
        }
    });
    outcomes.into_inner().unwrap().into_values().collect()
}

fn bake(vlm: &Path, corpus: &Path, file: &Path, output: PathBuf) -> Outcome {
    let mut command = Command::new(vlm);
    command.arg("bake").arg(file).arg("-o").arg(&output).args(FLAGS).env("RAYON_NUM_THREADS", "1");
    let finished = run(&mut command, &LIMITS).unwrap();
    assert_eq!(finished.broke, None, "{}: a limit", file.display());
    println!("{:8.2} s {:6} MB  {}", finished.processor.as_secs_f64(), finished.memory >> 20, file.display());
    let name = file.strip_prefix(corpus).unwrap().display().to_string();
    match finished.status.code() {
        Some(0) => Outcome { file: name, line: baked_line(&finished.stdout), output: Some(output) },
        Some(1) => Outcome { file: name, line: error_line(&finished, file), output: None },
        _ => panic!("{}: {}: {}", file.display(), finished.status, finished.stderr),
    }
}

/// `baked`, the number of lights and that of tags.
fn baked_line(stdout: &str) -> String {
    let number = |name: &str| {
        let line = stdout.lines().find(|line| line.starts_with(name)).unwrap();
        line.split_whitespace().nth(1).unwrap().to_owned()
    };
    format!("baked\t{} lights\t{} tags", number("lights"), number("tags"))
}

/// The error, without the name of the file.
fn error_line(finished: &Finished, file: &Path) -> String {
    let stderr = &finished.stderr;
    assert_eq!(finished.stdout, "", "{}", file.display());
    let start = format!("error: {}: ", file.display());
    let line = stderr.strip_prefix(&start).and_then(|rest| rest.strip_suffix('\n'));
    let line = line.unwrap_or_else(|| panic!("the error does not begin with the file: {stderr}"));
    assert!(!line.contains('\n'), "more than a line: {stderr}");
    assert!(ADVICE.iter().any(|advice| line.contains(advice)), "no advice in: {stderr}");
    assert!(line.len() < 500, "{} bytes: {stderr}", line.len());
    format!("error\t{line}")
}

fn table(outcomes: &[Outcome]) -> String {
    let mut table = String::new();
    for outcome in outcomes {
        writeln!(table, "{}\t{}", outcome.file, outcome.line).unwrap();
    }
    table
}

/// The table must be the committed one.
fn compare(found: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("expected/corpus.tsv");
    if std::env::var_os("VLM_UPDATE_EXPECTED").is_some_and(|value| value == "1") {
        fs::write(&path, found).unwrap();
    }
    let differences = differences(found, &fs::read_to_string(&path).unwrap());
    assert!(differences.is_empty(), "{}", differences.join("\n"));
}

/// Lines of one table that are not in the other.
fn differences(found: &str, expected: &str) -> Vec<String> {
    let missing = |from: &str, of: &str, sign: char| {
        let lines = of.lines().filter(|line| !from.lines().any(|other| other == *line));
        lines.map(|line| format!("{sign} {line}")).collect::<Vec<_>>()
    };
    let mut differences = missing(found, expected, '-');
    differences.extend(missing(expected, found, '+'));
    differences
}

fn check_all(vlm: &Path, baked: &[(PathBuf, PathBuf)]) {
    let outputs = baked.iter().map(|(_, output)| output);
    let checked = Command::new(vlm).args(["check", "--json"]).args(outputs).output().unwrap();
    assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stderr));
    let findings: Vec<Value> = serde_json::from_slice(&checked.stdout).unwrap();
    assert_eq!(findings.len(), baked.len());
    for finding in findings {
        assert!(finding["ok"] == true && finding["lights"].as_u64() > Some(0), "{finding}");
    }
}

/// Files validated by one process: it holds them all.
const BATCH: usize = 16;

/// The validator finds no error in an output that it does not find in the input.
fn validate_all(baked: &[(PathBuf, PathBuf)]) {
    for batch in baked.chunks(BATCH) {
        let files: Vec<PathBuf> =
            batch.iter().flat_map(|(input, output)| [input.clone(), output.clone()]).collect();
        let reports = validate(&files);
        for pair in reports.chunks_exact(2) {
            let new = new_errors(&pair[0], &pair[1]);
            assert!(new.is_empty(), "{}: {new:?}", pair[0]["file"]);
        }
    }
}

/// Errors of `after` that `before` has not, by code and place.
fn new_errors<'a>(before: &Value, after: &'a Value) -> Vec<&'a Value> {
    let key = |error: &Value| (error["code"].clone(), error["pointer"].clone());
    let known: Vec<_> = errors(before).into_iter().map(key).collect();
    errors(after).into_iter().filter(|error| !known.contains(&key(error))).collect()
}

#[test]
fn a_change_of_the_table_shows() {
    let table = "a\tbaked\t60 lights\t0 tags\nb\terror\tno mesh\n";
    assert!(differences(table, table).is_empty());
    assert_eq!(differences(&table.replace("60", "61"), table).len(), 2);
    assert_eq!(differences(table.split_inclusive('\n').next().unwrap(), table).len(), 1);
}

#[test]
fn an_error_that_the_input_has_not_shows() {
    let error = |code: &str, severity: u32| serde_json::json!({ "code": code, "severity": severity, "pointer": "/nodes/0" });
    let report = |messages: &[Value]| serde_json::json!({ "messages": messages });
    let before = report(&[error("A", 0), error("B", 1)]);
    assert!(new_errors(&before, &report(&[error("A", 0), error("B", 1), error("C", 1)])).is_empty());
    assert_eq!(new_errors(&before, &report(&[error("A", 0), error("B", 0)])).len(), 1);
}

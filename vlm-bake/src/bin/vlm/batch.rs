//! Many files in one run of `vlm bake`: those that are up to date are left alone, and one that fails does not stop the others.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use vlm_bake::cache::Cache;
use vlm_bake::inputs::{Input, inputs, same_file};
use vlm_bake::job::{self, Done, Effort, Job, JobError, Outcome};
use vlm_bake::memory::Memory;
use vlm_bake::progress::{Progress, Silent};

use crate::error::CliError;
use crate::output::{folder_of, print, print_json, write_json};
use crate::progress::Bars;
use crate::settings::{CacheArgs, SettingsArgs, Wishes};

/// Flags for several files.
#[derive(Args)]
pub struct BatchArgs {
    /// Folder to write into; it mirrors the inputs' folders, and is made if it is not there
    #[arg(long, value_name = "DIR")]
    pub out_dir: Option<PathBuf>,
    /// Files baked at the same time; each takes memory of its own [default: number of cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    #[command(flatten)]
    cache: CacheArgs,
    /// Say what would be baked, and why; write nothing
    #[arg(long)]
    dry_run: bool,
    /// Bake nothing: exit with code 1 if any output is neither up to date nor in the cache
    #[arg(long, conflicts_with = "dry_run")]
    fail_on_miss: bool,
    /// Report as JSON on stdout
    #[arg(long)]
    json: bool,
}

impl BatchArgs {
    /// A flag that is set and means nothing for one file.
    pub fn first_in_use(&self) -> Option<&'static str> {
        let flags = [
            (self.jobs.is_some(), "--jobs"),
            (self.dry_run, "--dry-run"),
            (self.fail_on_miss, "--fail-on-miss"),
            (self.json, "--json"),
        ];
        flags.into_iter().find(|(is_set, _)| *is_set).map(|(_, name)| name)
    }

    fn effort(&self) -> Effort {
        match (self.dry_run, self.fail_on_miss) {
            (true, _) => Effort::LookOnly,
            (_, true) => Effort::CacheOnly,
            _ => Effort::Bake,
        }
    }
}

/// What is to be baked, and how.
pub struct Asked<'a> {
    /// Files, folders and globs.
    pub inputs: &'a [PathBuf],
    /// Where their bakes go.
    pub out_dir: &'a Path,
    /// How.
    pub settings: &'a SettingsArgs,
    /// Where to write the report of the batch.
    pub report: Option<&'a Path>,
}

/// What a batch did.
#[derive(Debug, Serialize, JsonSchema)]
pub struct BatchReport {
    /// Files looked at.
    pub inputs: usize,
    /// Baked and written.
    pub baked: usize,
    /// Written from the cache.
    pub restored: usize,
    /// There already.
    pub up_to_date: usize,
    /// Neither there nor in the cache, and not to be made.
    pub missing: usize,
    /// In the cache, and not to be written.
    pub restorable: usize,
    /// Failed.
    pub failed: usize,
    /// Left out by the project's file.
    pub skipped: usize,
    /// Points of all files that are lit by lights in front of their surface.
    pub violations: u64,
    /// Seconds in all.
    pub seconds: f64,
    /// By output, ascending.
    pub files: Vec<FileReport>,
}

/// What became of one file.
#[derive(Debug, Serialize, JsonSchema)]
pub struct FileReport {
    /// The glTF file.
    pub input: PathBuf,
    /// Its bake.
    pub output: PathBuf,
    /// What became of it; null if it failed.
    pub outcome: Option<Outcome>,
    /// Why the output was not up to date.
    pub reasons: Vec<String>,
    /// Why it failed, with the remedy.
    pub error: Option<String>,
    /// Seconds.
    pub seconds: f64,
    /// The report of its bake, also where the cache had it; null where there is none.
    #[schemars(with = "Option<vlm_bake::report::Report>")]
    pub report: Value,
}

/// Bakes all inputs.
///
/// # Errors
/// If the inputs or the cache cannot be used, or anything failed that may not.
pub fn run(asked: &Asked, args: &BatchArgs, fail_on_violation: bool) -> Result<(), CliError> {
    let begun = Instant::now();
    if let Some(folder) = asked.inputs.iter().find(|input| input.is_dir() && same_file(input, asked.out_dir))
    {
        return Err(CliError::usage(format!(
            "{}: the bakes would replace their sources; name another folder with --out-dir",
            folder.display()
        )));
    }
    let wishes = asked.settings.wishes(common_folder(asked.inputs))?;
    let cache = args.cache.open(wishes.project.as_ref())?;
    let inputs =
        inputs(asked.inputs, &[asked.out_dir]).map_err(|error| CliError::usage(error.to_string()))?;
    let (jobs, skipped) = jobs(inputs, asked.out_dir, &wishes);
    let files = all(&jobs, cache.as_ref(), args);
    let report = BatchReport::new(files, skipped, begun.elapsed().as_secs_f64());
    if let Some(cache) = cache.filter(|_| args.effort() == Effort::Bake) {
        let _ = cache.prune();
    }
    if let Some(path) = asked.report {
        write_json(path, &report)?;
    }
    if args.json {
        print_json(&report)?;
    } else {
        print(&report.lines())?;
    }
    report.verdict(args, fail_on_violation)
}

/// Where the project's file is looked for: the folder of the first input, or that before its wildcards.
pub fn common_folder(inputs: &[PathBuf]) -> &Path {
    let Some(first) = inputs.first() else { return Path::new(".") };
    let folder = if first.is_dir() { first } else { folder_of(first) };
    folder.ancestors().find(|folder| folder.is_dir()).unwrap_or(Path::new("."))
}

/// The jobs, and how many inputs the project leaves out.
pub fn jobs(inputs: Vec<Input>, out_dir: &Path, wishes: &Wishes) -> (Vec<Job>, usize) {
    let all = inputs.len();
    let job = |input: Input| {
        let settings = wishes.of(&input.path);
        let output = out_dir.join(&input.relative);
        (settings.skip != Some(true)).then_some(Job { input: input.path, output, settings })
    };
    let jobs: Vec<Job> = inputs.into_iter().filter_map(job).collect();
    let skipped = all - jobs.len();
    (jobs, skipped)
}

/// Does the jobs, several at once; the order of the reports is theirs.
fn all(jobs: &[Job], cache: Option<&Cache>, args: &BatchArgs) -> Vec<FileReport> {
    let bars = Bars::new();
    bars.begin("files", jobs.len() as u64);
    in_parallel(jobs, args.jobs, |job| {
        let begun = Instant::now();
        let result = job::run(job, cache, args.effort(), &mut Memory::default(), &Silent);
        bars.advance(1);
        FileReport::new(job, result, begun.elapsed().as_secs_f64())
    })
}

/// Does something with each item, with `at_once` of them (or one per core) at the same time. Each of them may use all cores: the order is
/// that of the items.
pub fn in_parallel<T: Sync, R: Send>(
    items: &[T],
    at_once: Option<u16>,
    act: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let workers = at_once.map_or(cores, usize::from).min(items.len());
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::with_capacity(items.len())));
    let work = || {
        let take = || next.fetch_add(1, Ordering::Relaxed);
        let mut number = take();
        while let Some(item) = items.get(number) {
            let result = act(item);
            if let Ok(mut done) = done.lock() {
                done.push((number, result));
            }
            number = take();
        }
    };
    std::thread::scope(|scope| (0..workers).for_each(|_| _ = scope.spawn(work)));
    let mut done = done.into_inner().unwrap_or_default();
    done.sort_by_key(|(number, _)| *number);
    done.into_iter().map(|(_, result)| result).collect()
}

impl FileReport {
    fn new(job: &Job, result: Result<Done, JobError>, seconds: f64) -> Self {
        let (input, output) = (job.input.clone(), job.output.clone());
        let bare = Self {
            input,
            output,
            outcome: None,
            reasons: Vec::new(),
            error: None,
            seconds,
            report: Value::Null,
        };
        match result {
            Ok(done) => {
                Self { outcome: Some(done.outcome), reasons: done.reasons, report: done.report, ..bare }
            }
            Err(error) => Self { error: Some(error.to_string()), ..bare },
        }
    }

    fn violations(&self) -> u64 {
        self.report.pointer("/clearance/violations").and_then(Value::as_u64).unwrap_or(0)
    }

    /// What a person wants to know of it: nothing, if it was up to date.
    fn line(&self) -> Option<String> {
        let (input, why) = (self.input.display(), self.reasons.join("; "));
        if let Some(error) = &self.error {
            return Some(format!("FAILED      {error}"));
        }
        let (outcome, rest) = match self.outcome? {
            Outcome::UpToDate => return None,
            Outcome::Baked => {
                let lights = self.report.get("lights").and_then(Value::as_u64).unwrap_or(0);
                ("baked", format!("{lights} lights, {:.2} s; {why}", self.seconds))
            }
            Outcome::Restored => ("restored", why),
            Outcome::Restorable => ("in cache", why),
            Outcome::Missing => ("to bake", why),
        };
        Some(format!("{outcome:11} {input}  ({rest})"))
    }
}

impl BatchReport {
    fn new(files: Vec<FileReport>, skipped: usize, seconds: f64) -> Self {
        let count = |outcome| files.iter().filter(|file| file.outcome == Some(outcome)).count();
        Self {
            inputs: files.len(),
            baked: count(Outcome::Baked),
            restored: count(Outcome::Restored),
            up_to_date: count(Outcome::UpToDate),
            missing: count(Outcome::Missing),
            restorable: count(Outcome::Restorable),
            failed: files.iter().filter(|file| file.error.is_some()).count(),
            skipped,
            violations: files.iter().map(FileReport::violations).sum(),
            seconds,
            files,
        }
    }

    fn lines(&self) -> Vec<String> {
        let mut lines: Vec<String> = self.files.iter().filter_map(FileReport::line).collect();
        let parts = [
            (self.baked, "baked"),
            (self.restored, "restored from the cache"),
            (self.up_to_date, "up to date"),
            (self.restorable, "in the cache"),
            (self.missing, "to bake"),
            (self.skipped, "left out"),
            (self.failed, "failed"),
        ];
        let parts: Vec<String> = parts
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect();
        lines.push(format!("{} files    {} ({:.2} s)", self.inputs, parts.join(", "), self.seconds));
        lines
    }

    fn verdict(&self, args: &BatchArgs, fail_on_violation: bool) -> Result<(), CliError> {
        let first = |is_bad: &dyn Fn(&FileReport) -> bool| {
            self.files
                .iter()
                .find(|file| is_bad(file))
                .map(|file| file.input.display().to_string())
                .unwrap_or_default()
        };
        if let Some(error) = self.files.iter().find_map(|file| file.error.as_ref()) {
            return Err(CliError::Check(format!(
                "{} of {} files failed; the first: {error}",
                self.failed, self.inputs
            )));
        }
        if args.fail_on_miss && self.missing > 0 {
            let missing = first(&|file| file.outcome == Some(Outcome::Missing));
            return Err(CliError::Check(format!(
                "{} of {} files are not baked as they are now; the first: {missing}; bake without --fail-on-miss",
                self.missing, self.inputs
            )));
        }
        if fail_on_violation && self.violations > 0 {
            let bad = first(&|file| file.violations() > 0);
            return Err(CliError::Check(format!(
                "{} points are lit by lights in front of their surface; the first file: {bad}; see `vlm check --geometry`",
                self.violations
            )));
        }
        Ok(())
    }
}

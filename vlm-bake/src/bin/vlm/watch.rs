//! `vlm watch`: bakes files whenever they, or what they refer to, change.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant, SystemTime};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use vlm_bake::cache::Cache;
use vlm_bake::flags::positive;
use vlm_bake::follow::{Change, FollowOptions, Follower, Tree};
use vlm_bake::inputs::{inputs, is_gltf};
use vlm_bake::job::{self, Done, Effort, Job, JobError, Outcome};
use vlm_bake::memory::Memory;
use vlm_bake::progress::Progress;
use vlm_bake::references::references;

use crate::batch::{common_folder, in_parallel, jobs};
use crate::error::CliError;
use crate::output::print;
use crate::settings::{CacheArgs, SettingsArgs, Wishes};

/// So often a running bake is asked whether it is still wanted, and the watch whether it is over.
const LOOK_UP: Duration = Duration::from_millis(100);

/// A file that cannot be read may be half written: what is wrong with it is only said if it stays as it is for so long.
const SETTLES: Duration = Duration::from_millis(400);

/// A file's own time tells when it was saved, unless it is older than this: then it was copied with its time.
const RECENT: Duration = Duration::from_secs(10);

/// So many files' last bakes are remembered; each takes about as much memory as its output.
const MEMORIES: usize = 8;

/// Flags of `vlm watch`.
#[derive(Args)]
pub struct WatchArgs {
    /// glTF files, folders of them, or globs
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// Folder to write into; it mirrors the inputs' folders, and is made if it is not there
    #[arg(long, value_name = "DIR")]
    out_dir: PathBuf,
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(flatten)]
    cache: CacheArgs,
    /// Files baked at the same time [default: number of cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Look every so many seconds in place of waiting for the system to tell, which it does not on network drives
    #[arg(long, value_name = "SECONDS", num_args = 0..=1, default_missing_value = "0.5", value_parser = positive)]
    poll: Option<f32>,
    /// Run this in a shell after every file that was written; VLM_INPUT and VLM_OUTPUT name it
    #[arg(long, value_name = "CMD")]
    exec: Option<String>,
    /// One JSON object a line in place of text
    #[arg(long)]
    json: bool,
}

/// What happened to one file.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct WatchEvent {
    /// The glTF file.
    pub input: PathBuf,
    /// Its bake.
    pub output: PathBuf,
    /// What became of it; null if it failed, or was deleted.
    pub outcome: Option<Outcome>,
    /// From the save to the written file; from the start of the watch for files that changed before.
    pub seconds: f64,
    /// Why it was done.
    pub reasons: Vec<String>,
    /// Stages of the bake that ran, with their seconds.
    pub stages: BTreeMap<String, f64>,
    /// Stages that found everything as it was.
    pub reused: Vec<String>,
    /// Why it failed, with the remedy; the last good bake stays.
    pub error: Option<String>,
}

/// Runs the command until Ctrl-C.
///
/// # Errors
/// If the files cannot be followed, or the project's file or the cache not be used when the watch begins.
pub fn run(args: &WatchArgs) -> Result<(), CliError> {
    let over = Arc::new(AtomicBool::new(false));
    let handler = over.clone();
    ctrlc::set_handler(move || handler.store(true, Ordering::Relaxed))
        .map_err(|error| CliError::usage(format!("Ctrl-C cannot be caught: {error}")))?;
    let mut watch = Watch::new(args, &over)?;
    let mut next = watch.begin()?;
    while !over.load(Ordering::Relaxed) {
        next = match next.or_else(|| watch.follower.wait(LOOK_UP)) {
            Some(change) => watch.answer(&change)?,
            None => None,
        };
    }
    eprintln!("stopped");
    Ok(())
}

struct Watch<'a> {
    args: &'a WatchArgs,
    over: &'a AtomicBool,
    follower: Follower,
    wishes: Wishes,
    cache: Option<Cache>,
    memories: Mutex<Memories>,
}

/// What files' last bakes found, the last used first.
#[derive(Default)]
struct Memories(Vec<(PathBuf, Memory)>);

impl Memories {
    fn take(&mut self, file: &Path) -> Memory {
        let found = self.0.iter().position(|(of, _)| of == file);
        found.map_or_else(Memory::default, |at| self.0.remove(at).1)
    }

    fn keep(&mut self, file: &Path, memory: Memory) {
        self.0.insert(0, (file.to_owned(), memory));
        self.0.truncate(MEMORIES);
    }
}

/// Ends bakes that nobody wants any more.
struct Cancel<'a> {
    over: &'a AtomicBool,
    outdated: &'a AtomicBool,
}

impl Progress for Cancel<'_> {
    fn begin(&self, _stage: &'static str, _length: u64) {}
    fn advance(&self, _steps: u64) {}
    fn is_cancelled(&self) -> bool {
        self.over.load(Ordering::Relaxed) || self.outdated.load(Ordering::Relaxed)
    }
}

impl<'a> Watch<'a> {
    fn new(args: &'a WatchArgs, over: &'a AtomicBool) -> Result<Self, CliError> {
        let options = match args.poll {
            Some(seconds) => FollowOptions {
                events: false,
                look_every: Duration::from_secs_f32(seconds),
                ..FollowOptions::default()
            },
            None => FollowOptions::default(),
        };
        let follower = Follower::new(options).map_err(|error| CliError::usage(error.to_string()))?;
        let wishes = args.settings.wishes(common_folder(&args.paths))?;
        let cache = args.cache.open(wishes.project.as_ref())?;
        Ok(Self { args, over, follower, wishes, cache, memories: Mutex::default() })
    }

    /// Follows everything, and bakes what is not up to date; returns what changed meanwhile.
    fn begin(&mut self) -> Result<Option<Change>, CliError> {
        let folders = self.args.paths.iter().filter(|path| path.is_dir());
        let except = vec![self.args.out_dir.clone()];
        let trees = folders.map(|folder| Tree { folder: folder.clone(), except: except.clone() });
        self.follower.follow_trees(trees.collect());
        let jobs = self.jobs().map_err(CliError::usage)?;
        let files = jobs.len();
        self.follow(&jobs);
        let next = self.bake(&jobs, Instant::now(), None)?;
        if !self.args.json {
            eprintln!("watching  {files} files; Ctrl-C stops");
        }
        Ok(next)
    }

    /// All files that are there now.
    fn jobs(&self) -> Result<Vec<Job>, String> {
        let found = inputs(&self.args.paths, &[&self.args.out_dir]).map_err(|error| error.to_string())?;
        Ok(jobs(found, &self.args.out_dir, &self.wishes).0)
    }

    /// Followed before it is read, so that what changes from here on shows.
    fn follow(&mut self, jobs: &[Job]) {
        let of_jobs = jobs.iter().flat_map(|job| references(&job.input));
        let named = self.args.paths.iter().filter(|path| !path.is_dir()).cloned();
        self.follower.follow(of_jobs.chain(named).chain(self.project_files()));
    }

    /// The project's file, or the places where one may come.
    fn project_files(&self) -> Vec<PathBuf> {
        match &self.wishes.project {
            Some(project) => vec![project.path.clone()],
            None => self.args.settings.places_of_project(common_folder(&self.args.paths)),
        }
    }

    /// Bakes what a change concerns; returns what changed meanwhile.
    fn answer(&mut self, change: &Change) -> Result<Option<Change>, CliError> {
        let is_of_all = self.project_files().iter().any(|file| change.files.contains(file));
        if is_of_all {
            match self.args.settings.wishes(common_folder(&self.args.paths)) {
                Ok(wishes) => self.wishes = wishes,
                Err(error) => eprintln!("error: {error}"),
            }
        }
        // A folder without files is no error: some may come.
        let jobs = self.jobs().unwrap_or_default();
        self.say_gone(&jobs, change)?;
        self.follow(&jobs);
        let concerned = jobs.into_iter().filter(|job| is_of_all || concerns(change, job));
        self.bake(&concerned.collect::<Vec<_>>(), change.began, Some(change))
    }

    /// Bakes some files; what fails is only said once it stays as it is. Returns what changed meanwhile.
    fn bake(
        &mut self,
        jobs: &[Job],
        began: Instant,
        change: Option<&Change>,
    ) -> Result<Option<Change>, CliError> {
        if jobs.is_empty() {
            return Ok(None);
        }
        let clock = SaveClock { began, saved: saved_at(change) };
        let (results, mut next) = self.bake_and_listen(jobs, &clock);
        let failed = jobs.iter().zip(results).filter_map(|(job, result)| match result {
            Ok(()) => None,
            Err(Failure::Job(error)) => Some(Ok((job, error))),
            Err(Failure::Report(error)) => Some(Err(error)),
        });
        let failed = failed.collect::<Result<Vec<(&Job, JobError)>, CliError>>()?;
        if self.over.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let (cancelled, failed): (Vec<_>, Vec<_>) =
            failed.into_iter().partition(|(_, error)| error.is_cancelled());
        if next.is_none() && !failed.is_empty() {
            next = self.follower.wait(SETTLES);
        }
        for (job, error) in
            failed.iter().filter(|(job, _)| next.as_ref().is_none_or(|next| !concerns(next, job)))
        {
            let event =
                WatchEvent { error: Some(error.to_string()), ..WatchEvent::new(job, clock.seconds()) };
            event.say(self.args.json)?;
        }
        let again = cancelled.into_iter().map(|(job, _)| job.input.clone());
        Ok(merged(next, again.collect()))
    }

    /// Bakes on threads of their own, and ends that as soon as one of the files changes again. Returns what changed meanwhile.
    fn bake_and_listen(
        &mut self,
        jobs: &[Job],
        clock: &SaveClock,
    ) -> (Vec<Result<(), Failure>>, Option<Change>) {
        let outdated = AtomicBool::new(false);
        let cancel = Cancel { over: self.over, outdated: &outdated };
        let baker =
            Baker { args: self.args, cache: self.cache.as_ref(), memories: &self.memories, cancel, clock };
        let follower = &mut self.follower;
        std::thread::scope(|scope| {
            let baking = scope.spawn(|| in_parallel(jobs, baker.args.jobs, |job| baker.bake(job)));
            let mut news: Option<Change> = None;
            while !baking.is_finished() {
                if let Some(change) = follower.wait(LOOK_UP) {
                    outdated.fetch_or(jobs.iter().any(|job| concerns(&change, job)), Ordering::Relaxed);
                    let began = change.began;
                    news = merged(news, change.files).map(|news| Change { began, ..news });
                }
            }
            (baking.join().unwrap_or_default(), news)
        })
    }

    /// Says which inputs are gone.
    fn say_gone(&self, jobs: &[Job], change: &Change) -> Result<(), CliError> {
        let is_gone =
            |file: &&PathBuf| is_gltf(file) && !file.exists() && jobs.iter().all(|job| job.input != **file);
        let lines: Vec<String> = change
            .files
            .iter()
            .filter(is_gone)
            .map(|file| format!("gone        {}  (its last bake stays)", file.display()))
            .collect();
        if self.args.json { Ok(()) } else { print(&lines) }
    }
}

/// True if a job reads one of the files that changed.
fn concerns(change: &Change, job: &Job) -> bool {
    references(&job.input).iter().any(|file| change.files.contains(file))
}

/// More files that changed; `None` without any.
fn merged(change: Option<Change>, more: Vec<PathBuf>) -> Option<Change> {
    let began = change.as_ref().map_or_else(Instant::now, |change| change.began);
    let mut files = change.map_or_else(Vec::new, |change| change.files);
    files.extend(more);
    (!files.is_empty()).then_some(Change { files, began })
}

/// Since when users wait.
struct SaveClock {
    began: Instant,
    saved: Option<SystemTime>,
}

impl SaveClock {
    fn seconds(&self) -> f64 {
        let since = self.saved.and_then(|saved| SystemTime::now().duration_since(saved).ok());
        since.unwrap_or_else(|| self.began.elapsed()).as_secs_f64()
    }
}

/// When the newest of the changed files was saved, if its time can be believed.
fn saved_at(change: Option<&Change>) -> Option<SystemTime> {
    let times = change?.files.iter().filter_map(|file| std::fs::metadata(file).ok()?.modified().ok());
    let newest = times.max()?;
    newest.elapsed().is_ok_and(|age| age < RECENT).then_some(newest)
}

/// What bakes of one round share.
struct Baker<'a> {
    args: &'a WatchArgs,
    cache: Option<&'a Cache>,
    memories: &'a Mutex<Memories>,
    cancel: Cancel<'a>,
    clock: &'a SaveClock,
}

/// Why a file has no new bake.
enum Failure {
    Job(JobError),
    /// It has, but nobody could be told.
    Report(CliError),
}

impl Baker<'_> {
    fn bake(&self, job: &Job) -> Result<(), Failure> {
        let mut memory = self.memories.lock().map(|mut all| all.take(&job.input)).unwrap_or_default();
        let result = job::run(job, self.cache, Effort::Bake, &mut memory, &self.cancel);
        if let Ok(mut all) = self.memories.lock() {
            all.keep(&job.input, memory);
        }
        let done = result.map_err(Failure::Job)?;
        if done.outcome == Outcome::UpToDate {
            return Ok(());
        }
        let event = WatchEvent::new(job, self.clock.seconds()).of(&done);
        event.say(self.args.json).map_err(Failure::Report)?;
        if let Some(command) = &self.args.exec {
            execute(command, job);
        }
        Ok(())
    }
}

impl WatchEvent {
    fn new(job: &Job, seconds: f64) -> Self {
        let (input, output) = (job.input.clone(), job.output.clone());
        let (reasons, reused, stages) = Default::default();
        Self { input, output, outcome: None, seconds, reasons, stages, reused, error: None }
    }

    fn of(mut self, done: &Done) -> Self {
        self.outcome = Some(done.outcome);
        self.reasons.clone_from(&done.reasons);
        if done.outcome == Outcome::Baked {
            let of_report = |key: &str| done.report.get(key).cloned().unwrap_or(Value::Null);
            self.stages = serde_json::from_value(of_report("seconds")).unwrap_or_default();
            self.reused = serde_json::from_value(of_report("reused")).unwrap_or_default();
        }
        self
    }

    fn say(&self, json: bool) -> Result<(), CliError> {
        if json {
            let line = serde_json::to_string(self);
            return print(&[
                line.map_err(|error| CliError::usage(format!("the report cannot be JSON: {error}")))?
            ]);
        }
        print(&[self.line()])
    }

    fn line(&self) -> String {
        if let Some(error) = &self.error {
            return format!("FAILED      {error} (the last good bake stays)");
        }
        let what = if self.outcome == Some(Outcome::Restored) { "restored" } else { "baked" };
        let mut notes = self.reasons.join("; ");
        if !self.reused.is_empty() {
            notes += &format!("; as before: {}", self.reused.join(", "));
        }
        format!("{what:11} {}  {:.3} s  ({notes})", self.output.display(), self.seconds)
    }
}

/// Runs the user's command; that it fails is said, and no reason to stop.
fn execute(command: &str, job: &Job) {
    let (shell, flag) = if cfg!(windows) { ("cmd", "/C") } else { ("sh", "-c") };
    let mut child = Command::new(shell);
    child.args([flag, command]).env("VLM_INPUT", &job.input).env("VLM_OUTPUT", &job.output);
    match child.status() {
        Ok(status) if status.success() => {}
        Ok(status) => eprintln!("exec      `{command}`: {status}"),
        Err(error) => eprintln!("exec      `{command}`: {error}"),
    }
}

//! `vlm watch`: bakes files whenever they, or what they refer to, change.

use std::collections::{BTreeMap, BTreeSet};
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
use vlm_bake::inputs::inputs;
use vlm_bake::job::{self, Effort, Job, JobError, Outcome};
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
    watch.begin()?;
    while !over.load(Ordering::Relaxed) {
        if let Some(change) = watch.follower.wait(LOOK_UP) {
            watch.answer(&change)?;
        }
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

    /// Follows everything, and bakes what is not up to date.
    fn begin(&mut self) -> Result<(), CliError> {
        let folders = self.args.paths.iter().filter(|path| path.is_dir());
        let except = vec![self.args.out_dir.clone()];
        let trees = folders.map(|folder| Tree { folder: folder.clone(), except: except.clone() });
        self.follower.follow_trees(trees.collect());
        let jobs = self.jobs().map_err(CliError::usage)?;
        self.follow(&jobs);
        self.bake(jobs, Instant::now(), None)?;
        if !self.args.json {
            let files = self.jobs().map_or(0, |jobs| jobs.len());
            eprintln!("watching  {files} files; Ctrl-C stops");
        }
        Ok(())
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
        self.follower.follow(of_jobs.chain(named).chain(self.project_file()));
    }

    fn project_file(&self) -> Option<PathBuf> {
        self.wishes.project.as_ref().map(|project| project.path.clone())
    }

    /// Bakes what a change concerns.
    fn answer(&mut self, change: &Change) -> Result<(), CliError> {
        let files: BTreeSet<PathBuf> = change.files.iter().cloned().collect();
        let mut all = false;
        if self.project_file().is_some_and(|file| files.contains(&file)) {
            match self.args.settings.wishes(common_folder(&self.args.paths)) {
                Ok(wishes) => (self.wishes, all) = (wishes, true),
                Err(error) => eprintln!("error: {error}"),
            }
        }
        // A folder without files is no error: some may come.
        let jobs = self.jobs().unwrap_or_default();
        self.say_gone(&jobs, &files)?;
        self.follow(&jobs);
        let concerned = |job: &Job| all || references(&job.input).iter().any(|file| files.contains(file));
        self.bake(jobs.into_iter().filter(concerned).collect(), change.began, Some(change))
    }

    /// Bakes some files; what fails is only said once it stays as it is.
    fn bake(&mut self, jobs: Vec<Job>, began: Instant, change: Option<&Change>) -> Result<(), CliError> {
        if jobs.is_empty() {
            return Ok(());
        }
        let outdated = AtomicBool::new(false);
        let cancel = Cancel { over: self.over, outdated: &outdated };
        let (args, cache, memories) = (self.args, self.cache.as_ref(), &self.memories);
        let saved = saved_at(change);
        let one = |job: &Job| {
            let mut memory = memories.lock().map(|mut all| all.take(&job.input)).unwrap_or_default();
            let result = job::run(job, cache, Effort::Bake, &mut memory, &cancel);
            if let Ok(mut all) = memories.lock() {
                all.keep(&job.input, memory);
            }
            let since = saved.and_then(|saved| SystemTime::now().duration_since(saved).ok());
            let seconds = since.unwrap_or_else(|| began.elapsed()).as_secs_f64();
            match result {
                Ok(done) => say_done(args, job, &done, seconds).map(|()| None),
                Err(error) => Ok(Some(error)),
            }
        };
        let (results, news) = std::thread::scope(|scope| {
            let baking = scope.spawn(|| in_parallel(&jobs, args.jobs, one));
            let mut news: Option<Change> = None;
            while !baking.is_finished() {
                if let Some(change) = self.follower.wait(LOOK_UP) {
                    let concerns =
                        |job: &Job| references(&job.input).iter().any(|f| change.files.contains(f));
                    outdated.fetch_or(jobs.iter().any(concerns), Ordering::Relaxed);
                    let files = news.map_or_else(Vec::new, |news| news.files);
                    news = Some(Change { files: [files, change.files].concat(), began: change.began });
                }
            }
            (baking.join().unwrap_or_default(), news)
        });
        let mut failed = Vec::new();
        let mut cancelled = Vec::new();
        for (job, result) in jobs.into_iter().zip(results) {
            match result? {
                Some(error) if error.is_cancelled() => cancelled.extend(references(&job.input)),
                Some(error) => failed.push((job, error)),
                None => {}
            }
        }
        if self.over.load(Ordering::Relaxed) {
            return Ok(());
        }
        let mut next = news;
        if next.is_none() && !failed.is_empty() {
            next = self.follower.wait(SETTLES);
        }
        if next.is_none() || !cancelled.is_empty() {
            let files =
                cancelled.into_iter().chain(next.into_iter().flat_map(|next| next.files)).collect::<Vec<_>>();
            next = (!files.is_empty()).then_some(Change { files, began: Instant::now() });
        }
        let is_asked_again = |job: &Job| {
            next.as_ref()
                .is_some_and(|next| references(&job.input).iter().any(|file| next.files.contains(file)))
        };
        for (job, error) in failed.iter().filter(|(job, _)| !is_asked_again(job)) {
            say_failed(args, job, error, began.elapsed().as_secs_f64())?;
        }
        next.map_or(Ok(()), |next| self.answer(&next))
    }

    /// Says which files are gone.
    fn say_gone(&self, jobs: &[Job], files: &BTreeSet<PathBuf>) -> Result<(), CliError> {
        let is_input = |file: &&PathBuf| vlm_bake::inputs::is_gltf(file) && !file.exists();
        for file in files.iter().filter(is_input).filter(|file| jobs.iter().all(|job| job.input != **file)) {
            if self.args.json {
                continue;
            }
            print(&[format!("gone        {}  (its last bake stays)", file.display())])?;
        }
        Ok(())
    }
}

/// When the newest of the changed files was saved, if its time can be believed.
fn saved_at(change: Option<&Change>) -> Option<SystemTime> {
    let times = change?.files.iter().filter_map(|file| std::fs::metadata(file).ok()?.modified().ok());
    let newest = times.max()?;
    newest.elapsed().is_ok_and(|age| age < RECENT).then_some(newest)
}

fn say_done(args: &WatchArgs, job: &Job, done: &job::Done, seconds: f64) -> Result<(), CliError> {
    let mut event = WatchEvent::new(job, seconds);
    event.outcome = Some(done.outcome);
    event.reasons.clone_from(&done.reasons);
    if done.outcome == Outcome::Baked {
        let of_report = |key: &str| done.report.get(key).cloned().unwrap_or(Value::Null);
        event.stages = serde_json::from_value(of_report("seconds")).unwrap_or_default();
        event.reused = serde_json::from_value(of_report("reused")).unwrap_or_default();
    }
    if done.outcome != Outcome::UpToDate {
        event.say(args.json)?;
        args.exec.as_ref().map_or(Ok(()), |command| execute(command, job))?;
    }
    Ok(())
}

fn say_failed(args: &WatchArgs, job: &Job, error: &JobError, seconds: f64) -> Result<(), CliError> {
    let event = WatchEvent { error: Some(error.to_string()), ..WatchEvent::new(job, seconds) };
    event.say(args.json)
}

impl WatchEvent {
    fn new(job: &Job, seconds: f64) -> Self {
        let (input, output) = (job.input.clone(), job.output.clone());
        let (reasons, reused, stages) = Default::default();
        Self { input, output, outcome: None, seconds, reasons, stages, reused, error: None }
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
fn execute(command: &str, job: &Job) -> Result<(), CliError> {
    let (shell, flag) = if cfg!(windows) { ("cmd", "/C") } else { ("sh", "-c") };
    let status = Command::new(shell)
        .args([flag, command])
        .env("VLM_INPUT", &job.input)
        .env("VLM_OUTPUT", &job.output)
        .status();
    match status {
        Ok(status) if status.success() => {}
        Ok(status) => eprintln!("exec      `{command}`: {status}"),
        Err(error) => eprintln!("exec      `{command}`: {error}"),
    }
    Ok(())
}

//! One file of a batch or a watch: from what went into it to files on disk, by the cache where that knows them.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::Value;
use vlm_format::{GltfFile, OutputFile, Target, WriteOptions, write_atomic, write_vlm_with};

use crate::bake::{Bake, BakeError, rebake};
use crate::cache::{Cache, CacheError, Entry};
use crate::inputs::same_file;
use crate::memory::Memory;
use crate::progress::Progress;
use crate::recipe::Recipe;
use crate::scene::{self, LoadOptions, Scene, load};
use crate::settings::BakeSettings;

/// A file that changes while it is baked is baked again at most so often.
const TRIES: usize = 3;

/// A file to bake.
#[derive(Clone, Debug)]
pub struct Job {
    /// The glTF file.
    pub input: PathBuf,
    /// Where its bake goes; folders above it are made.
    pub output: PathBuf,
    /// What is asked for.
    pub settings: BakeSettings,
}

/// What may be done to have an output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Effort {
    /// Whatever it takes.
    #[default]
    Bake,
    /// Only what the cache holds is written.
    CacheOnly,
    /// Nothing is written at all.
    LookOnly,
}

/// What became of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It was baked and written.
    Baked,
    /// The cache had it, and it was written.
    Restored,
    /// It was there already.
    UpToDate,
    /// It is not there, nor in the cache, and was not to be made.
    Missing,
    /// The cache has it, and nothing was to be written.
    Restorable,
}

/// A finished job.
#[derive(Clone, Debug)]
pub struct Done {
    /// What became of it.
    pub outcome: Outcome,
    /// Why the output was not up to date.
    pub reasons: Vec<String>,
    /// What went into it.
    pub recipe: Recipe,
    /// The bake's report as JSON; null where there is none.
    pub report: Value,
    /// How long it took.
    pub seconds: f64,
}

/// Why a job failed. Then its output is as it was.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// The input cannot be read, or the output not written.
    #[error(transparent)]
    File(#[from] vlm_format::Error),
    /// There is no scene in it.
    #[error(transparent)]
    Scene(#[from] scene::Error),
    /// Nothing can be made of it.
    #[error("{}: {error}", file.display())]
    Bake {
        /// The input.
        file: PathBuf,
        /// What the bake says.
        error: BakeError,
    },
    /// What was made breaks a rule of the format.
    #[error(
        "{}: {issue}: what was baked is not valid, which is a fault of this tool; please report it, with the file",
        file.display()
    )]
    Fault {
        /// The input.
        file: PathBuf,
        /// The first rule that was broken, and where.
        issue: String,
    },
    /// The cache cannot be used.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The output would take the place of its input.
    #[error("{}: its bake would replace it; name another output folder", file.display())]
    OverSource {
        /// The input.
        file: PathBuf,
    },
    /// Somebody keeps writing the input.
    #[error("{}: it changes faster than it can be baked; try again when it is written", file.display())]
    Unsteady {
        /// The input.
        file: PathBuf,
    },
}

impl JobError {
    /// True if nobody is to blame but the caller: the bake was cancelled.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        matches!(self, Self::Bake { error: BakeError::Cancelled, .. })
    }
}

/// A bake that was not written yet.
pub struct Made {
    /// The visible scene.
    pub scene: Scene,
    /// Its lights; the report has the hash of the files.
    pub bake: Bake,
    /// The files of the output, the main one first.
    pub outputs: Vec<OutputFile>,
}

/// Bakes a file that is open.
///
/// # Errors
/// As [`run`], but for those of the cache and the disk.
pub fn make(
    file: &GltfFile,
    settings: &BakeSettings,
    target: &Target,
    memory: &mut Memory,
    progress: &dyn Progress,
) -> Result<Made, JobError> {
    let on_texture = |done: usize, total: usize| {
        if done == 1 {
            progress.begin("textures", total as u64);
        }
        progress.advance(1);
    };
    let limits = LoadOptions { on_texture: Some(&on_texture), ..settings.load_options() };
    let scene = load(file, &limits)?;
    let refuse = |error| JobError::Bake { file: PathBuf::from(file.name()), error };
    let options = settings.options(scene.triangles.len());
    let mut bake = rebake(&scene, &options, memory, progress).map_err(refuse)?;
    progress.begin("write", 1);
    let store = WriteOptions { compress: settings.compress.unwrap_or(false) };
    let outputs =
        write_vlm_with(file, &bake.asset, target, &store).map_err(|error| unwritten(file, error))?;
    bake.report.hash = hash(&outputs);
    Ok(Made { scene, bake, outputs })
}

/// What the baker made is checked as it is written.
fn unwritten(file: &GltfFile, error: vlm_format::Error) -> JobError {
    match error {
        vlm_format::Error::Asset { issues } => {
            let issue = issues
                .into_iter()
                .next()
                .map_or_else(String::new, |i| format!("{}: {}", i.pointer, i.message));
            JobError::Fault { file: PathBuf::from(file.name()), issue }
        }
        other => other.into(),
    }
}

/// BLAKE3 of everything written, in the order of writing.
fn hash(outputs: &[OutputFile]) -> String {
    let mut hasher = blake3::Hasher::new();
    for output in outputs {
        hasher.update(&output.bytes);
    }
    hasher.finalize().to_hex().to_string()
}

/// Does a job, by the cache where there is one and it knows the result. `memory` is that of earlier bakes of the same file.
///
/// # Errors
/// [`JobError`] says why the output is as it was.
pub fn run(
    job: &Job,
    cache: Option<&Cache>,
    effort: Effort,
    memory: &mut Memory,
    progress: &dyn Progress,
) -> Result<Done, JobError> {
    if same_file(&job.input, &job.output) {
        return Err(JobError::OverSource { file: job.input.clone() });
    }
    let begun = Instant::now();
    for _ in 0..TRIES {
        let recipe = recipe(job)?;
        let attempt = Attempt { job, cache, effort, key: recipe.key(), recipe: &recipe };
        if let Some((outcome, reasons, report)) = attempt.run(memory, progress)? {
            let seconds = begun.elapsed().as_secs_f64();
            return Ok(Done { outcome, reasons, recipe, report, seconds });
        }
    }
    Err(JobError::Unsteady { file: job.input.clone() })
}

fn recipe(job: &Job) -> Result<Recipe, JobError> {
    let unreadable = |source| vlm_format::Error::Io { path: job.input.clone(), action: "read", source };
    Ok(Recipe::of(&job.input, &job.output, &job.settings).map_err(unreadable)?)
}

/// One try at a job.
struct Attempt<'a> {
    job: &'a Job,
    cache: Option<&'a Cache>,
    effort: Effort,
    recipe: &'a Recipe,
    key: String,
}

/// Outcome, why the output was not up to date, and the bake's report.
type Result3 = (Outcome, Vec<String>, Value);

impl Attempt<'_> {
    /// `None` if the input changed meanwhile.
    fn run(&self, memory: &mut Memory, progress: &dyn Progress) -> Result<Option<Result3>, JobError> {
        // Whoever comes second finds what the first one made.
        let makes = self.effort == Effort::Bake;
        let _claim = self.cache.filter(|_| makes).map(|cache| cache.claim(&self.key)).transpose()?;
        let known = self.cache.and_then(|cache| cache.entry(&self.key));
        if let Some(entry) = &known
            && entry.files.iter().all(|file| file.is_in(self.folder()))
        {
            self.remember()?;
            return Ok(Some((Outcome::UpToDate, Vec::new(), entry.report.clone())));
        }
        let reasons = self.reasons(known.as_ref());
        match (&known, self.effort) {
            (Some(entry), Effort::LookOnly) => {
                return Ok(Some((Outcome::Restorable, reasons, entry.report.clone())));
            }
            (Some(entry), _) if self.restore(entry)? => {
                return Ok(Some((Outcome::Restored, reasons, entry.report.clone())));
            }
            (_, Effort::CacheOnly | Effort::LookOnly) => {
                return Ok(Some((Outcome::Missing, reasons, Value::Null)));
            }
            _ => {}
        }
        Ok(self.bake(memory, progress)?.map(|report| (Outcome::Baked, reasons, report)))
    }

    /// Writes what the cache holds; false if that is not whole.
    fn restore(&self, entry: &Entry) -> Result<bool, JobError> {
        let source = self.job.input.parent().unwrap_or(Path::new(""));
        let Some(files) = self.cache.and_then(|cache| cache.read(&self.key, entry, source)) else {
            return Ok(false);
        };
        self.deliver(&files)?;
        Ok(true)
    }

    /// Bakes and writes; `None` if the input changed meanwhile, and nothing was written.
    fn bake(&self, memory: &mut Memory, progress: &dyn Progress) -> Result<Option<Value>, JobError> {
        progress.begin("read", 1);
        let target = Target::from_path(&self.job.output)?;
        let file = GltfFile::open(&self.job.input)?;
        let made = make(&file, &self.job.settings, &target, memory, progress)?;
        if recipe(self.job)? != *self.recipe {
            return Ok(None);
        }
        let report = serde_json::to_value(&made.bake.report).unwrap_or_default();
        if let Some(cache) = self.cache {
            cache.keep(&self.key, &made.outputs, &report)?;
        }
        self.deliver(&made.outputs)?;
        Ok(Some(report))
    }

    fn deliver(&self, files: &[OutputFile]) -> Result<(), JobError> {
        let folder = self.folder();
        let unmade =
            |source| vlm_format::Error::Io { path: folder.to_owned(), action: "make the folder", source };
        std::fs::create_dir_all(folder).map_err(unmade)?;
        write_atomic(files, folder)?;
        self.remember()
    }

    fn remember(&self) -> Result<(), JobError> {
        match self.cache {
            Some(cache) if self.effort != Effort::LookOnly => {
                Ok(cache.remember(&self.job.output, self.recipe)?)
            }
            _ => Ok(()),
        }
    }

    /// Why the output is not up to date.
    fn reasons(&self, known: Option<&Entry>) -> Vec<String> {
        let Some(cache) = self.cache else { return vec!["there is no cache".to_owned()] };
        let Some(before) = cache.last_recipe(&self.job.output) else {
            return vec!["it was not baked before".to_owned()];
        };
        let mut reasons = self.recipe.changes_since(&before);
        if reasons.is_empty() {
            let missing = known.iter().flat_map(|entry| &entry.files);
            let altered = missing.filter(|file| !file.is_in(self.folder()));
            reasons.extend(altered.map(|file| {
                let state =
                    if self.folder().join(&file.path).exists() { "was altered" } else { "is missing" };
                format!("{} {state}", file.path.display())
            }));
        }
        if known.is_none() && reasons.is_empty() {
            reasons.push("the cache holds it no longer".to_owned());
        }
        reasons
    }

    fn folder(&self) -> &Path {
        self.job.output.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
    }
}

//! A run: every method at every setting, from every camera of every scene, several times over.
//!
//! Repeats are interleaved and their order varies, so that a machine that slows down or warms up does so for all.

use std::fs;
use std::path::{Path, PathBuf};

use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_bake::shade::TraceScene;
use vlm_format::GltfFile;

use super::judge::Judge;
use super::row::Row;
use super::scene;
use crate::method::{Backend, Cost, Method, MethodError, Picture, Prepared, Stage, View};
use crate::methods::{Entry, all};
use crate::proof::{Refusal, prove};
use crate::random;
use crate::truth::{Spp, TruthError, Truths};

/// What to run.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Names, as [`scene::file`] knows them.
    pub scenes: Vec<String>,
    /// The run's folder.
    pub out: PathBuf,
    /// Pixels; `None` for each scene's own.
    pub size: Option<(u32, u32)>,
    /// At least 2: the change from frame to frame needs two. More give steadier medians; time grows in proportion.
    pub repeats: u32,
    /// Where all methods run.
    pub backend: Backend,
    /// Names of methods; `None` for all.
    pub methods: Option<Vec<String>>,
    /// Folder of the truth's cache.
    pub cache: PathBuf,
    /// Directions per pixel of the truth.
    pub spp: Spp,
}

/// What came of it.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Everything in `raw.csv`.
    pub rows: Vec<Row>,
    /// Methods that failed their proof and were left out.
    pub refused: Vec<Refusal>,
}

/// Why there is no run.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// There is no such scene.
    #[error("there is no scene `{0}`: {hint}", hint = scene::hint())]
    UnknownScene(String),
    /// There is no such method.
    #[error("there is no method `{wanted}`: name some of {known}")]
    UnknownMethod {
        /// What was asked for.
        wanted: String,
        /// What there is.
        known: String,
    },
    /// No method passed its proof.
    #[error("no method is left to compare")]
    NoMethods,
    /// A method failed in a scene.
    #[error("{scene}: {method} {knob}: {error}")]
    Method {
        /// The scene's name.
        scene: String,
        /// The method's name.
        method: &'static str,
        /// The setting.
        knob: String,
        /// What went wrong.
        error: MethodError,
    },
    /// Nothing can be relative to a black truth.
    #[error(
        "{scene}: camera {camera}: no indirect light reaches what it shows, so no error can be relative to it"
    )]
    BlackTruth {
        /// The scene's name.
        scene: String,
        /// The camera's name.
        camera: String,
    },
    /// A scene's file is not readable.
    #[error(transparent)]
    File(#[from] vlm_format::Error),
    /// A scene cannot be used.
    #[error(transparent)]
    Scene(#[from] vlm_bake::scene::Error),
    /// The truth cannot be kept.
    #[error(transparent)]
    Truth(#[from] TruthError),
    /// A picture cannot be written.
    #[error(transparent)]
    Picture(#[from] vlm_bake::picture::PictureError),
    /// `raw.csv` cannot be written.
    #[error("raw.csv: {0}")]
    Csv(#[from] csv::Error),
    /// A folder cannot be made.
    #[error("cannot create the folder {path}: {source}; name a folder that can be written", path = path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file or folder cannot be written or read.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

/// Proves the methods, runs them, and writes `raw.csv` and `images/SCENE/CAMERA/*.exr`. `log` is told what is going on.
///
/// # Errors
/// Whatever keeps the run from being whole; a method that fails its proof is left out instead.
pub fn run(options: &RunOptions, log: &dyn Fn(&str)) -> Result<Outcome, RunError> {
    let entries = chosen(options.backend, options.methods.as_deref())?;
    let files = options
        .scenes
        .iter()
        .map(|name| scene::file(name).ok_or_else(|| RunError::UnknownScene(name.clone())));
    let files: Vec<PathBuf> = files.collect::<Result<_, _>>()?;
    // Before the proofs, which take a while.
    create_folder(&options.out)?;
    let mut outcome = Outcome::default();
    let entries = proven(entries, &mut outcome.refused, log);
    if entries.is_empty() {
        return Err(RunError::NoMethods);
    }
    for (name, file) in options.scenes.iter().zip(&files) {
        outcome.rows.extend(run_scene(options, name, file, &entries, log)?);
        write_rows(&options.out, &outcome.rows)?;
    }
    Ok(outcome)
}

fn chosen(backend: Backend, names: Option<&[String]>) -> Result<Vec<&'static Entry>, RunError> {
    let all = all(backend);
    let Some(names) = names else { return Ok(all.iter().collect()) };
    let find = |name: &String| {
        let known = || all.iter().map(|entry| entry.name).collect::<Vec<_>>().join(", ");
        // `vlm-bench render` and the rows spell names differently.
        let found = all.iter().find(|entry| entry.name == name.replace('-', "_"));
        found.ok_or_else(|| RunError::UnknownMethod { wanted: name.clone(), known: known() })
    };
    names.iter().map(find).collect()
}

fn proven(
    entries: Vec<&'static Entry>,
    refused: &mut Vec<Refusal>,
    log: &dyn Fn(&str),
) -> Vec<&'static Entry> {
    let mut passed = Vec::new();
    for entry in entries {
        match prove(entry) {
            Ok(()) => passed.push(entry),
            Err(refusal) => {
                log(&format!("refused: {refusal}"));
                refused.push(refusal);
            }
        }
    }
    passed
}

/// A method at a setting, ready for frames.
pub(super) struct Contestant {
    pub(super) method: Box<dyn Method>,
    pub(super) prepared: Box<dyn Prepared>,
    pub(super) cost: Cost,
}

fn run_scene(
    options: &RunOptions,
    name: &str,
    file: &Path,
    entries: &[&'static Entry],
    log: &dyn Fn(&str),
) -> Result<Vec<Row>, RunError> {
    let bytes = fs::read(file).map_err(|source| RunError::Io { path: file.to_owned(), source })?;
    let scene: Scene = load(&GltfFile::open(file)?, &LoadOptions::default())?;
    let trace = TraceScene::new(&scene);
    let stage = Stage::new(&trace);
    let size = options.size.unwrap_or_else(|| scene::default_size(name));
    let views: Vec<View<'_>> =
        scene.cameras_or_default().iter().map(|camera| View::new(&trace, camera, size)).collect();

    let contestants = prepare(name, &stage, entries, log)?;
    let pictures = render_repeats(options, name, &contestants, &views, log)?;
    let truths = Truths::new(&options.cache, &bytes)?;
    let mut rows = Vec::new();
    for (view, pictures) in views.iter().zip(&pictures) {
        rows.extend(Judge { options, scene: name, truths: &truths, view, log }.rows(&contestants, pictures)?);
    }
    Ok(rows)
}

fn prepare(
    name: &str,
    stage: &Stage<'_>,
    entries: &[&'static Entry],
    log: &dyn Fn(&str),
) -> Result<Vec<Contestant>, RunError> {
    let methods = entries.iter().flat_map(|entry| (entry.sweep)(stage));
    let prepared = methods.map(|method| {
        log(&format!("{name}: prepare {} {}", method.name(), method.knob()));
        let prepared = method.prepare(stage).map_err(|error| failed(name, &*method, error))?;
        Ok(Contestant { cost: prepared.cost(), prepared, method })
    });
    prepared.collect()
}

/// A method's error with where it happened.
pub(super) fn failed(scene: &str, method: &dyn Method, error: MethodError) -> RunError {
    RunError::Method { scene: scene.to_owned(), method: method.name(), knob: method.knob(), error }
}

/// Pictures by view, contestant and repeat.
type Pictures = Vec<Vec<Vec<Picture>>>;

fn render_repeats(
    options: &RunOptions,
    name: &str,
    contestants: &[Contestant],
    views: &[View<'_>],
    log: &dyn Fn(&str),
) -> Result<Pictures, RunError> {
    let mut pictures: Pictures =
        views.iter().map(|_| contestants.iter().map(|_| Vec::new()).collect()).collect();
    for repeat in 0..options.repeats.max(2) {
        log(&format!("{name}: repeat {repeat}"));
        for (view, contestant) in order_of(repeat, views.len(), contestants.len()) {
            let Contestant { method, prepared, .. } = &contestants[contestant];
            let picture =
                prepared.render(&views[view], repeat).map_err(|error| failed(name, &**method, error))?;
            pictures[view][contestant].push(picture);
        }
    }
    Ok(pictures)
}

/// All pairs of a view and a contestant, in an order that each repeat has of its own.
fn order_of(repeat: u32, views: usize, contestants: usize) -> Vec<(usize, usize)> {
    let pairs = (0..views).flat_map(|view| (0..contestants).map(move |contestant| (view, contestant)));
    let mut order: Vec<_> = pairs.collect();
    order.sort_by_cached_key(|&(view, contestant)| {
        random::bits(u64::from(repeat), (view * contestants + contestant) as u64)
    });
    order
}

fn write_rows(folder: &Path, rows: &[Row]) -> Result<(), RunError> {
    let path = folder.join("raw.csv");
    let mut writer = csv::Writer::from_path(&path)?;
    for row in rows {
        writer.serialize(row)?;
    }
    writer.flush().map_err(|source| RunError::Io { path, source })
}

pub(super) fn create_folder(path: &Path) -> Result<(), RunError> {
    fs::create_dir_all(path).map_err(|source| RunError::Folder { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_are_known_by_either_spelling() {
        let of = |name: &str| chosen(Backend::Cpu, Some(&[name.to_owned()])).map(|entries| entries[0].name);
        for name in ["instant_radiosity", "instant-radiosity"] {
            assert_eq!(of(name).unwrap(), "instant_radiosity");
        }
        assert!(of("magic").unwrap_err().to_string().contains("instant_radiosity"));
    }

    #[test]
    fn every_repeat_runs_everything_once_in_an_order_of_its_own() {
        let orders: Vec<_> = (0..3).map(|repeat| order_of(repeat, 2, 5)).collect();
        for order in &orders {
            let mut sorted = order.clone();
            sorted.sort_unstable();
            sorted.dedup();
            assert_eq!(sorted.len(), 10);
        }
        assert!(orders[0] != orders[1] && orders[1] != orders[2]);
    }
}

//! The measurement: every file by both tools, each in a process of its own, in interleaved repeats.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use super::sample::{ChildReport, GLTFPACK, PROCESS, Run, Sample, VLM};
use super::{BakeBenchError, gltfpack};
use crate::device::processor;
use crate::pareto::scene;
use crate::random;
use crate::room;

/// Name of the room made in memory.
pub(super) const ROOM: &str = "room";

/// What to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeBenchOptions {
    /// The program that has the subcommand `bake-child`: `vlm-bench` itself.
    pub program: PathBuf,
    /// The program beside it, by name in PATH or by its path.
    pub gltfpack: String,
    /// Triangles of the rooms. They have about so many; the samples say how many.
    pub triangles: Vec<u64>,
    /// Real scenes, by the names that [`crate::pareto::scene::file`] knows.
    pub scenes: Vec<String>,
    /// Whether a scene that is not there is an error.
    pub scenes_required: bool,
    /// Name of the preset.
    pub preset: String,
    /// Times that everything is run.
    pub repeats: u32,
}

/// A file to bake.
struct Input {
    name: String,
    path: PathBuf,
}

/// Runs everything. Files are made in a temporary folder and removed. `log` is told what is going on.
///
/// # Errors
/// [`BakeBenchError`] for scenes that are asked for and absent, and bakes that fail. That `gltfpack` is absent or fails is
/// no error.
pub fn measure(options: &BakeBenchOptions, log: &dyn Fn(&str)) -> Result<Run, BakeBenchError> {
    let io = |source| BakeBenchError::Io { what: "temporary folder".to_owned(), source };
    let folder = tempfile::tempdir().map_err(io)?;
    let mut run = Run {
        gltfpack: gltfpack::version(&options.gltfpack),
        preset: options.preset.clone(),
        threads: rayon::current_num_threads(),
        device: processor(),
        ..Run::default()
    };
    let inputs = inputs(options, folder.path(), &mut run.absent)?;
    for repeat in 0..options.repeats.max(1) {
        let mut order: Vec<(u64, &Input)> = (0..).zip(&inputs).collect();
        order.sort_by_key(|&(i, _)| random::bits(u64::from(repeat), i));
        for (_, input) in order {
            log(&format!("repeat {repeat}: {}", input.path.display()));
            let baked = bake(options, input, folder.path(), repeat)?;
            run.samples.push(baked);
            run.samples.extend(pack(options, input, folder.path(), &run, log));
        }
    }
    Ok(run)
}

/// Writes the rooms and finds the scenes.
fn inputs(
    options: &BakeBenchOptions,
    folder: &Path,
    absent: &mut Vec<String>,
) -> Result<Vec<Input>, BakeBenchError> {
    let mut inputs = Vec::new();
    for &triangles in &options.triangles {
        let path = folder.join(format!("{ROOM}_{triangles}.glb"));
        vlm_format::write_file(&path, &room::glb(triangles))?;
        inputs.push(Input { name: ROOM.to_owned(), path });
    }
    for name in &options.scenes {
        match scene::file(name) {
            Some(path) => inputs.push(Input { name: name.clone(), path }),
            None if options.scenes_required => return Err(BakeBenchError::UnknownScene(name.clone())),
            None => absent.push(name.clone()),
        }
    }
    Ok(inputs)
}

fn bake(
    options: &BakeBenchOptions,
    input: &Input,
    folder: &Path,
    repeat: u32,
) -> Result<Sample, BakeBenchError> {
    let output = folder.join("baked.glb");
    let mut command = Command::new(&options.program);
    command.arg("bake-child").arg(&input.path).arg(&output).arg(&options.preset);
    let start = Instant::now();
    let done = command.output().map_err(|source| BakeBenchError::Io {
        what: format!("cannot run {}", options.program.display()),
        source,
    })?;
    let process = start.elapsed().as_secs_f64();
    let failed = |message: String| BakeBenchError::Child { input: input.path.display().to_string(), message };
    if !done.status.success() {
        return Err(failed(String::from_utf8_lossy(&done.stderr).trim().to_owned()));
    }
    // The next bake must not find the same content and save itself the writing.
    fs::remove_file(&output)
        .map_err(|source| BakeBenchError::Io { what: output.display().to_string(), source })?;
    let report: ChildReport =
        serde_json::from_slice(&done.stdout).map_err(|error| failed(error.to_string()))?;
    let mut seconds = report.seconds;
    seconds.insert(PROCESS.to_owned(), process);
    Ok(Sample {
        input: input.name.clone(),
        tool: VLM.to_owned(),
        repeat,
        triangles: report.triangles,
        lights: Some(report.lights),
        seconds,
        peak_bytes: report.peak_bytes,
    })
}

/// The sample of the other tool over the file that was baked last; `None` if it is not there or fails.
fn pack(
    options: &BakeBenchOptions,
    input: &Input,
    folder: &Path,
    run: &Run,
    log: &dyn Fn(&str),
) -> Option<Sample> {
    let baked = run.samples.last()?;
    run.gltfpack.as_ref().ok()?;
    match gltfpack::seconds(&options.gltfpack, &input.path, &folder.join("packed.glb")) {
        Ok(seconds) => Some(Sample {
            tool: GLTFPACK.to_owned(),
            lights: None,
            seconds: [(PROCESS.to_owned(), seconds)].into(),
            peak_bytes: None,
            ..baked.clone()
        }),
        Err(reason) => {
            log(&format!("{}: gltfpack: {reason}", input.path.display()));
            None
        }
    }
}

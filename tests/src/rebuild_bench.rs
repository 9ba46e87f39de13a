//! How long a change takes to arrive: a batch whose files are all baked already, and a watch from the save to the written file.

use std::error::Error;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use tempfile::TempDir;
use vlm_format::{Container, GltfFile, Target, strip_vlm, write_atomic};

use crate::text::table;

/// The longest that a watch may take for one change.
const PATIENCE: Duration = Duration::from_secs(600);

/// One measured thing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The scene, or `batch`.
    pub scene: String,
    /// What was done.
    pub what: String,
    /// Which repeat, from 0.
    pub repeat: u32,
    /// Wall seconds: of the program for bakes, from the save to the written file for edits.
    pub seconds: f64,
    /// Stages that found everything as it was.
    pub reused: String,
}

/// What is measured.
#[derive(Clone, Debug)]
pub struct RebuildOptions {
    /// The program `vlm`.
    pub program: PathBuf,
    /// glTF files that are edited.
    pub scenes: Vec<PathBuf>,
    /// Files of the batch, 0 for none.
    pub batch: u32,
    /// Repeats; bakes and edits take turns.
    pub repeats: u32,
}

/// Measures everything; `say` is told what runs.
///
/// # Errors
/// If files cannot be read, written or baked.
pub fn measure(options: &RebuildOptions, say: &dyn Fn(&str)) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut rows = Vec::new();
    if options.batch > 0 {
        say(&format!("batch of {} files", options.batch));
        batch(options, &mut rows)?;
    }
    for scene in &options.scenes {
        say(&scene.display().to_string());
        edits(options, scene, &mut rows)?;
    }
    Ok(rows)
}

/// Many copies of the Cornell box that differ in a name: baked once, then looked at again and again.
fn batch(options: &RebuildOptions, rows: &mut Vec<Row>) -> Result<(), Box<dyn Error>> {
    let folder = TempDir::new()?;
    let source = folder.path().join("src");
    fs::create_dir(&source)?;
    let cornell = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/cornell.glb");
    for number in 0..options.batch {
        let mut edited = Edited::new(Path::new(cornell), &source, &format!("room{number}"))?;
        edited.json["asset"]["extras"] = json!({ "number": number });
        edited.save()?;
    }
    let run = || {
        let begun = Instant::now();
        let arguments = ["bake", "src", "--out-dir", "out", "--cache-dir", "cache", "--preset", "draft"];
        let status = quiet(&options.program, folder.path()).args(arguments).status()?;
        if status.success() {
            Ok(begun.elapsed().as_secs_f64())
        } else {
            Err(format!("the batch failed: {status}"))
        }
        .map_err(Box::<dyn Error>::from)
    };
    let row = |what: &str, repeat, seconds| Row {
        scene: format!("batch of {}", options.batch),
        what: what.to_owned(),
        repeat,
        seconds,
        reused: String::new(),
    };
    rows.push(row("nothing baked before", 0, run()?));
    for repeat in 0..options.repeats {
        rows.push(row("all up to date", repeat, run()?));
    }
    fs::remove_dir_all(folder.path().join("out"))?;
    rows.push(row("all in the cache", 0, run()?));
    Ok(())
}

/// A scene as .gltf that can be edited as JSON.
struct Edited {
    json: Value,
    path: PathBuf,
}

impl Edited {
    fn new(scene: &Path, folder: &Path, name: &str) -> Result<Self, Box<dyn Error>> {
        let file_name = format!("{name}.gltf");
        let target = Target { container: Container::Gltf { embedded: false }, file_name };
        let files = strip_vlm(&GltfFile::open(scene)?, &target)?;
        write_atomic(&files, folder)?;
        let path = folder.join(&target.file_name);
        Ok(Self { json: serde_json::from_slice(&fs::read(&path)?)?, path })
    }

    fn save(&self) -> Result<(), Box<dyn Error>> {
        Ok(fs::write(&self.path, serde_json::to_vec(&self.json)?)?)
    }

    /// Another base colour factor of the last material.
    fn recolour(&mut self, step: u32) {
        let factor = 0.9 - 0.02 * f64::from(step);
        if let Some(material) = self.json["materials"].as_array_mut().and_then(|all| all.last_mut()) {
            material["pbrMetallicRoughness"]["baseColorFactor"] = json!([factor, 0.8, 0.7, 1.0]);
        }
    }

    /// Another place of the last node that has a mesh.
    fn shift(&mut self, step: u32) {
        let nodes = self.json["nodes"].as_array_mut();
        let has_mesh = |node: &&mut Value| node.get("mesh").is_some() && node.get("matrix").is_none();
        if let Some(node) = nodes.and_then(|nodes| nodes.iter_mut().rev().find(has_mesh)) {
            node["translation"] = json!([0.001 * f64::from(step + 1), 0.0, 0.0]);
        }
    }
}

/// Full bakes and edits of one scene, in turns.
fn edits(options: &RebuildOptions, scene: &Path, rows: &mut Vec<Row>) -> Result<(), Box<dyn Error>> {
    let folder = TempDir::new()?;
    let name = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut edited = Edited::new(scene, folder.path(), "scene")?;
    let watch = Watch::start(&options.program, folder.path())?;
    watch.next()?;
    for repeat in 0..options.repeats {
        let row = |what: &str, seconds, reused| Row {
            scene: name.clone(),
            what: what.to_owned(),
            repeat,
            seconds,
            reused,
        };
        let begun = Instant::now();
        let status =
            quiet(&options.program, folder.path()).args(["bake", "scene.gltf", "-o", "full.glb"]).status()?;
        if !status.success() {
            return Err(format!("{}: the bake failed: {status}", scene.display()).into());
        }
        rows.push(row("full bake", begun.elapsed().as_secs_f64(), String::new()));
        edited.recolour(repeat);
        edited.save()?;
        let event = watch.next()?;
        rows.push(row("a new colour", seconds(&event)?, reused(&event)));
        edited.shift(repeat);
        edited.save()?;
        let event = watch.next()?;
        rows.push(row("a moved object", seconds(&event)?, reused(&event)));
    }
    Ok(())
}

fn seconds(event: &Value) -> Result<f64, Box<dyn Error>> {
    event["seconds"]
        .as_f64()
        .filter(|_| event["outcome"] == "baked")
        .ok_or_else(|| format!("unexpected: {event}").into())
}

fn reused(event: &Value) -> String {
    let stages = event["reused"].as_array().into_iter().flatten();
    stages.filter_map(Value::as_str).collect::<Vec<_>>().join(" ")
}

fn quiet(program: &Path, folder: &Path) -> Command {
    let mut command = Command::new(program);
    command.current_dir(folder).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// A running `vlm watch`.
struct Watch {
    child: Child,
    events: Receiver<Value>,
}

impl Watch {
    fn start(program: &Path, folder: &Path) -> Result<Self, Box<dyn Error>> {
        let mut child = quiet(program, folder)
            .args(["watch", "scene.gltf", "--out-dir", "out", "--no-cache", "--json"])
            .stdout(Stdio::piped())
            .spawn()?;
        let output = child.stdout.take().ok_or("the watch has no output")?;
        let (tell, events) = channel();
        std::thread::spawn(move || {
            let lines = BufReader::new(output).lines().map_while(Result::ok);
            // The receiver is gone when the watch is.
            lines.filter_map(|line| serde_json::from_str(&line).ok()).for_each(|event| _ = tell.send(event));
        });
        Ok(Self { child, events })
    }

    fn next(&self) -> Result<Value, Box<dyn Error>> {
        Ok(self.events.recv_timeout(PATIENCE)?)
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Medians, and how often a full bake's time each edit takes.
#[must_use]
pub fn summary(rows: &[Row]) -> String {
    let header =
        ["scene", "what", "median seconds", "full bake over it", "stages as before"].map(str::to_owned);
    let mut seen: Vec<(&str, &str)> = Vec::new();
    for row in rows {
        if !seen.contains(&(&row.scene, &row.what)) {
            seen.push((&row.scene, &row.what));
        }
    }
    let of = |scene: &str, what: &str| {
        let mut seconds: Vec<f64> =
            rows.iter().filter(|row| row.scene == scene && row.what == what).map(|row| row.seconds).collect();
        seconds.sort_by(f64::total_cmp);
        seconds.get(seconds.len() / 2).copied()
    };
    let line = |&(scene, what): &(&str, &str)| {
        let median = of(scene, what).unwrap_or(f64::NAN);
        let ratio = of(scene, "full bake").map_or_else(String::new, |full| format!("{:.1}", full / median));
        let reused = rows.iter().find(|row| row.scene == scene && row.what == what);
        let reused = reused.map_or_else(String::new, |row| row.reused.clone());
        vec![scene.to_owned(), what.to_owned(), format!("{median:.3}"), ratio, reused]
    };
    table(&header, &seen.iter().map(line).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_ratios() {
        let row = |what: &str, seconds| Row {
            scene: "room".into(),
            what: what.into(),
            repeat: 0,
            seconds,
            reused: String::new(),
        };
        let text = summary(&[
            row("full bake", 3.0),
            row("full bake", 9.0),
            row("full bake", 6.0),
            row("a new colour", 0.5),
        ]);
        assert!(text.contains("6.000") && text.contains("12.0"), "{text}");
    }
}

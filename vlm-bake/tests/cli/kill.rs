//! SIGKILL at any moment: no output is ever torn, and what the cache holds makes what a bake without it makes.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;
use vlm_format::{GltfFile, read_vlm};

use crate::support::{Document, vlm};

/// Times that each kind of run is killed.
const KILLS: u32 = 100;

/// Every so many kills, a run goes to its end, and all is compared.
const COMPARED: u32 = 10;

/// A project that changes from round to round.
struct Project(TempDir);

impl Project {
    fn new() -> Self {
        let project = Self(tempfile::tempdir().unwrap());
        fs::create_dir_all(project.path("src/in")).unwrap();
        project.change(0);
        project
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Other colours in one file, and another place in the other: nothing that was baked before.
    fn change(&self, round: u32) {
        let room = Document::room().to_string();
        fs::write(self.path("src/colour.gltf"), room.replace("0.8", &format!("0.{}", 100 + round))).unwrap();
        let mut moved: serde_json::Value = serde_json::from_str(&room).unwrap();
        moved["nodes"][0]["translation"] = serde_json::json!([0.01 * f64::from(round), 0.0, 0.0]);
        fs::write(self.path("src/in/place.gltf"), moved.to_string()).unwrap();
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let quick = ["--lights", "30", "--probes", "20", "--rays", "32"];
        let mut command = vlm(arguments.iter().copied().chain(quick));
        command.current_dir(self.0.path()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    }

    fn bake(&self) -> Command {
        self.command(&["bake", "src", "--out-dir", "out", "--cache-dir", "cache"])
    }

    /// The second of two, since the first reads the program from disk.
    fn time_of_bake(&self) -> Duration {
        assert!(self.bake().status().unwrap().success());
        self.change(9999);
        let begun = Instant::now();
        assert!(self.bake().status().unwrap().success());
        begun.elapsed()
    }

    /// Whatever is there is whole, whichever version it is.
    fn assert_whole(&self) {
        for name in ["out/colour.gltf", "out/in/place.gltf"] {
            let path = self.path(name);
            if path.exists() {
                let file = GltfFile::open(&path).unwrap_or_else(|error| panic!("torn: {error}"));
                let asset = read_vlm(&file).unwrap_or_else(|error| panic!("torn: {error}"));
                assert!(asset.is_some(), "{name} has no lights");
            }
        }
    }

    /// A run that nobody kills makes what one without a cache makes, and leaves nothing else.
    fn assert_not_poisoned(&self) {
        assert!(self.bake().status().unwrap().success());
        let fresh = self.command(&["bake", "src", "--out-dir", "fresh", "--no-cache"]).status().unwrap();
        assert!(fresh.success());
        let (out, expected) = (contents(&self.path("out")), contents(&self.path("fresh")));
        assert_eq!(out.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
        assert!(out == expected, "the outputs are those of a fresh bake");
    }
}

fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let files =
        walkdir::WalkDir::new(folder).into_iter().map(Result::unwrap).filter(|e| e.file_type().is_file());
    files.map(|e| (e.path().strip_prefix(folder).unwrap().to_owned(), fs::read(e.path()).unwrap())).collect()
}

/// Moments spread over a span, in an order without pattern.
fn moment(round: u32, span: Duration) -> Duration {
    // The golden ratio's multiples fill the unit interval evenly (Weyl 1916).
    span.mul_f64((f64::from(round) * 0.618_033_988_749_895).fract())
}

fn kill(mut child: Child) {
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn bakes_may_be_killed_at_any_moment() {
    let project = Project::new();
    let span = project.time_of_bake();
    let mut killed = 0;
    for round in 1..=KILLS {
        project.change(round);
        let mut child = project.bake().spawn().unwrap();
        std::thread::sleep(moment(round, span));
        killed += u32::from(child.try_wait().unwrap().is_none());
        kill(child);
        project.assert_whole();
        if round % COMPARED == 0 {
            project.assert_not_poisoned();
        }
    }
    assert!(killed > KILLS / 2, "most were still running: {killed}");
}

#[test]
fn watches_may_be_killed_at_any_moment() {
    let project = Project::new();
    let span = project.time_of_bake().mul_f64(1.5);
    for round in 1..=KILLS {
        let child =
            project.command(&["watch", "src", "--out-dir", "out", "--cache-dir", "cache"]).spawn().unwrap();
        std::thread::sleep(moment(round, span / 3));
        project.change(round);
        std::thread::sleep(moment(round * 7, span));
        kill(child);
        project.assert_whole();
        if round % COMPARED == 0 {
            project.assert_not_poisoned();
        }
    }
}

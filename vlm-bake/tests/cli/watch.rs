//! `vlm watch` on real files: whatever way they are saved, their bakes follow.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;
use vlm_format::{GltfFile, read_vlm};

use crate::support::{Document, read, vlm};

/// Long enough on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// Nothing is expected to come in this time.
const SILENCE: Duration = Duration::from_millis(1500);

/// A watch over `src`, writing to `out`.
struct Watched {
    folder: TempDir,
    child: Child,
    lines: Receiver<Value>,
}

impl Drop for Watched {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A room whose walls have this albedo.
fn room(albedo: &str) -> String {
    Document::room().to_string().replace("0.8", albedo)
}

impl Watched {
    fn new(flags: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("src")).unwrap();
        fs::write(folder.path().join("src/room.gltf"), room("0.8")).unwrap();
        let all = [
            "watch",
            "src",
            "--out-dir",
            "out",
            "--json",
            "--lights",
            "30",
            "--probes",
            "20",
            "--cache-dir",
            "cache",
        ];
        let mut command = vlm(all.into_iter().chain(flags.iter().copied()));
        command.current_dir(folder.path()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let (tell, lines) = channel();
        let output = BufReader::new(child.stdout.take().unwrap());
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                let _ = tell.send(serde_json::from_str(&line).unwrap());
            }
        });
        let watched = Self { folder, child, lines };
        watched.expect("baked");
        watched
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::write(self.path(name), bytes).unwrap();
    }

    fn next(&self) -> Value {
        self.lines.recv_timeout(PATIENCE).expect("the watch says something")
    }

    /// The next event, which is this outcome.
    fn expect(&self, outcome: &str) -> Value {
        let event = self.next();
        assert_eq!(event["outcome"], outcome, "{event}");
        event
    }

    fn assert_silent(&self) {
        assert_eq!(self.lines.recv_timeout(SILENCE).ok(), None);
    }

    /// The red albedo of the baked room's first light.
    fn albedo(&self) -> f32 {
        read(self.path("out/room.gltf").to_str().unwrap()).albedo[0].x
    }

    fn assert_albedo(&self, expected: f32) {
        assert!((self.albedo() - expected).abs() < 1e-3, "{} for {expected}", self.albedo());
    }
}

#[test]
fn a_new_colour_is_there_without_tracing_rays_again() {
    for flags in [&[][..], &["--poll", "0.1"]] {
        let watched = Watched::new(flags);
        watched.assert_albedo(0.8);
        watched.write("src/room.gltf", room("0.4"));
        let event = watched.expect("baked");
        watched.assert_albedo(0.4);
        assert_eq!(event["reused"], serde_json::json!(["decimate", "mend", "grid"]));
        assert!(event["stages"]["samples"].is_number() && event["stages"]["grid"].is_null(), "{event}");
        assert_eq!(event["reasons"], serde_json::json!(["the file changed"]));
        assert!(event["seconds"].as_f64().unwrap() > 0.0);
        watched.assert_silent();
        watched.write("src/room.gltf", room("0.4"));
        watched.assert_silent();
        watched.write("src/room.gltf", room("0.8"));
        watched.expect("restored");
        watched.assert_albedo(0.8);
    }
}

#[test]
fn editors_save_in_many_ways() {
    let watched = Watched::new(&[]);
    let (file, other) = (watched.path("src/room.gltf"), watched.path("src/.room.gltf.swp"));
    fs::write(&other, room("0.3")).unwrap();
    fs::rename(&other, &file).unwrap();
    watched.expect("baked");
    watched.assert_albedo(0.3);

    fs::write(&other, room("0.5")).unwrap();
    fs::remove_file(&file).unwrap();
    fs::hard_link(&other, &file).unwrap();
    watched.expect("baked");
    watched.assert_albedo(0.5);

    fs::remove_file(&file).unwrap();
    watched.assert_silent();
    watched.assert_albedo(0.5);
    fs::write(&file, room("0.6")).unwrap();
    watched.expect("baked");
    watched.assert_albedo(0.6);
}

#[test]
fn a_half_written_file_is_waited_for_and_a_broken_one_keeps_the_last_bake() {
    let watched = Watched::new(&[]);
    let whole = room("0.2");
    let mut file = fs::File::create(watched.path("src/room.gltf")).unwrap();
    for part in whole.as_bytes().chunks(whole.len() / 8 + 1) {
        file.write_all(part).unwrap();
        file.flush().unwrap();
        std::thread::sleep(Duration::from_millis(60));
    }
    drop(file);
    watched.expect("baked");
    watched.assert_albedo(0.2);

    watched.write("src/room.gltf", &whole[..whole.len() / 2]);
    let event = watched.next();
    assert!(event["error"].as_str().unwrap().contains("room.gltf"), "{event}");
    watched.assert_albedo(0.2);
    watched.write("src/room.gltf", room("0.7"));
    watched.expect("baked");
    watched.assert_albedo(0.7);
}

#[test]
fn what_a_file_refers_to_counts_also_when_it_comes_late() {
    let watched = Watched::new(&[]);
    let mut json: Value = serde_json::from_str(&room("0.8")).unwrap();
    let uri = json["buffers"][0]["uri"].as_str().unwrap().to_owned();
    let bytes =
        base64::Engine::decode(&base64::prelude::BASE64_STANDARD, uri.split_once(',').unwrap().1).unwrap();
    json["buffers"][0]["uri"] = "data.bin".into();
    watched.write("src/room.gltf", json.to_string());
    assert!(watched.next()["error"].as_str().unwrap().contains("data.bin"));
    watched.write("src/data.bin", &bytes);
    watched.expect("baked");
    let moved: Vec<u8> = bytes
        .chunks(4)
        .flat_map(|c| if c == 2.0_f32.to_le_bytes() { 2.5_f32.to_le_bytes() } else { c.try_into().unwrap() })
        .collect();
    watched.write("src/data.bin", moved);
    let event = watched.expect("baked");
    assert_eq!(event["reasons"], serde_json::json!(["data.bin changed"]));
    assert_eq!(event["reused"], serde_json::json!([]));
}

#[test]
fn files_that_come_later_and_new_options_are_baked() {
    let watched = Watched::new(&[]);
    fs::create_dir_all(watched.path("src/later/on")).unwrap();
    watched.write("src/later/on/new.gltf", room("0.9"));
    let event = watched.expect("baked");
    assert_eq!(event["output"], "out/later/on/new.gltf");
    assert!(watched.path("out/later/on/new.gltf").exists());
    watched.write("vlm.toml", "compress = true\n");
    for _ in 0..2 {
        let event = watched.expect("baked");
        assert_eq!(
            event["reused"],
            serde_json::json!(["decimate", "mend", "grid"]),
            "only the file is written anew"
        );
    }
    watched.write("vlm.toml", "compres = true\n");
    watched.assert_silent();
    watched.write("vlm.toml", "preset = 'draft'\n");
    watched.expect("baked");
    watched.expect("baked");
}

#[test]
fn a_storm_of_saves_ends_in_the_last_of_them() {
    let watched = Watched::new(&[]);
    let file = watched.path("src/room.gltf");
    for i in 0..10_000 {
        fs::write(&file, if i % 2 == 0 { "{" } else { "[" }).unwrap();
    }
    fs::write(&file, room("0.25")).unwrap();
    let begun = Instant::now();
    let albedo = || {
        let file = GltfFile::open(&watched.path("out/room.gltf")).ok()?;
        read_vlm(&file).ok()?.map(|asset| asset.albedo[0].x)
    };
    while albedo().is_none_or(|albedo| (albedo - 0.25).abs() > 1e-3) {
        assert!(begun.elapsed() < PATIENCE, "the last save is baked");
        std::thread::sleep(Duration::from_millis(20));
    }
    let events = watched.lines.try_iter().count();
    assert!(events < 100, "{events} events for one storm");
}

#[test]
fn a_command_runs_after_each_written_file() {
    let watched = Watched::new(&["--exec", "cp \"$VLM_OUTPUT\" copy.gltf && echo \"$VLM_INPUT\" >> log"]);
    watched.write("src/room.gltf", room("0.4"));
    watched.expect("baked");
    let begun = Instant::now();
    while fs::read_to_string(watched.path("log")).unwrap_or_default().lines().count() < 2 {
        assert!(begun.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(fs::read_to_string(watched.path("log")).unwrap(), "src/room.gltf\nsrc/room.gltf\n");
    assert_eq!(
        fs::read(watched.path("copy.gltf")).unwrap(),
        fs::read(watched.path("out/room.gltf")).unwrap()
    );
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_it_well_even_amid_a_bake() {
    for busy in [false, true] {
        let mut watched = Watched::new(&["--rays", "60000"]);
        let before = fs::read(watched.path("out/room.gltf")).unwrap();
        if busy {
            watched.write("src/room.gltf", Document::room().to_string().replace("\"room\"", "\"hall\""));
            let far: Value = serde_json::from_str(&room("0.8")).unwrap();
            let mut far = far;
            far["nodes"][0]["translation"] = serde_json::json!([0.0, 1.0, 0.0]);
            watched.write("src/room.gltf", far.to_string());
            std::thread::sleep(Duration::from_millis(300));
        }
        interrupt(&watched.child);
        let begun = Instant::now();
        let status = loop {
            if let Some(status) = watched.child.try_wait().unwrap() {
                break status;
            }
            assert!(begun.elapsed() < PATIENCE, "it ends");
            std::thread::sleep(Duration::from_millis(10));
        };
        assert_eq!(status.code(), Some(0));
        let mut said = String::new();
        watched.child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        assert!(said.ends_with("stopped\n"), "{said}");
        if !busy {
            assert_eq!(fs::read(watched.path("out/room.gltf")).unwrap(), before);
        }
        assert!(leftovers(&watched.path("out")).is_empty());
    }
}

fn interrupt(child: &Child) {
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(killed.unwrap().success());
}

fn leftovers(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|extension| extension == "tmp")).collect()
}

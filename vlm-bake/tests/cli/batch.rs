//! `vlm bake` on many files: what is baked, what is left alone and why.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use insta::assert_snapshot;
use serde_json::Value;
use tempfile::TempDir;

use crate::support::{Document, read, text, vlm};

/// Bakes of a few lights take a fifth of a second.
const QUICK: [&str; 4] = ["--lights", "30", "--probes", "0"];

/// A project with a source folder, in which the program runs.
struct Project(TempDir);

impl Project {
    /// `src/room.gltf`, with its data in a file beside it, and `src/props/quad.glb` hold the same room.
    fn new() -> Self {
        let project = Self(tempfile::tempdir().unwrap());
        project.write("src/room.gltf", with_data_beside(&project.path("src")));
        fs::create_dir_all(project.path("src/props")).unwrap();
        project.write("src/props/prop.gltf", Document::room().to_string());
        project
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::create_dir_all(self.path(name).parent().unwrap()).unwrap();
        fs::write(self.path(name), bytes).unwrap();
    }

    fn run(&self, arguments: &[&str]) -> Output {
        let mut command = vlm(arguments.iter().copied());
        command.current_dir(self.0.path()).env("VLM_CACHE_DIR", self.path("cache"));
        command.output().unwrap()
    }

    /// Bakes `src` to `out`, quickly.
    fn bake(&self, flags: &[&str]) -> Output {
        self.run(&[&["bake", "src", "--out-dir", "out"], &QUICK[..], flags].concat())
    }

    /// The same as JSON, of a run that succeeds.
    fn report(&self, flags: &[&str]) -> Value {
        let output = self.bake(&[flags, &["--json"]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// Outcome and reasons of every file.
    fn outcomes(&self, flags: &[&str]) -> Vec<(String, String)> {
        let report = self.report(flags);
        let file = |file: &Value| {
            let reasons: Vec<&str> =
                file["reasons"].as_array().unwrap().iter().map(|r| r.as_str().unwrap()).collect();
            (file["outcome"].as_str().unwrap().to_owned(), reasons.join("; "))
        };
        report["files"].as_array().unwrap().iter().map(file).collect()
    }

    /// Those of the room alone.
    fn room(&self, flags: &[&str]) -> (String, String) {
        self.outcomes(flags).pop().unwrap()
    }
}

/// The room with its buffer in `room data.bin` and a texture beside it.
fn with_data_beside(folder: &Path) -> String {
    let mut json: Value = serde_json::from_str(&Document::room().to_string()).unwrap();
    let uri = json["buffers"][0]["uri"].as_str().unwrap().to_owned();
    let bytes =
        base64::Engine::decode(&base64::prelude::BASE64_STANDARD, uri.split_once(',').unwrap().1).unwrap();
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("room data.bin"), bytes).unwrap();
    write_picture(&folder.join("paint.png"), 200);
    json["buffers"][0]["uri"] = "room%20data.bin".into();
    json["images"] = serde_json::json!([{ "uri": "paint.png" }]);
    json["textures"] = serde_json::json!([{ "source": 0 }]);
    json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = serde_json::json!({ "index": 0 });
    json.to_string()
}

fn write_picture(path: &Path, grey: u8) {
    image::RgbImage::from_pixel(4, 4, image::Rgb([grey; 3])).save(path).unwrap();
}

/// All files below a folder.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let files =
        walkdir::WalkDir::new(folder).into_iter().map(Result::unwrap).filter(|e| e.file_type().is_file());
    files.map(|e| (e.path().strip_prefix(folder).unwrap().to_owned(), fs::read(e.path()).unwrap())).collect()
}

/// Lines without their seconds.
fn timeless(output: &Output) -> String {
    let words = |line: &str| {
        let words = line.split(' ').map(|word| {
            let number = word.trim_start_matches('(');
            let decimals = number.split_once('.').map_or(0, |(_, decimals)| decimals.len());
            if decimals == 2 && number.parse::<f64>().is_ok() {
                word.replace(number, "[s]")
            } else {
                word.to_owned()
            }
        });
        words.collect::<Vec<_>>().join(" ")
    };
    text(&output.stdout).lines().map(words).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_folder_is_mirrored_and_the_second_run_does_nothing() {
    let project = Project::new();
    let first = project.bake(&[]);
    assert_eq!(first.status.code(), Some(0), "{}", text(&first.stderr));
    assert_snapshot!(timeless(&first), @"
    baked       src/props/prop.gltf  (30 lights, [s] s; it was not baked before)
    baked       src/room.gltf  (30 lights, [s] s; it was not baked before)
    2 files    2 baked ([s] s)
    ");
    for output in ["out/room.gltf", "out/props/prop.gltf"] {
        assert_eq!(read(project.path(output).to_str().unwrap()).triangles.len(), 30);
    }
    assert!(project.path("out/room data.bin").exists(), "what the file refers to goes along");
    let written = fs::metadata(project.path("out/room.gltf")).unwrap().modified().unwrap();
    assert_snapshot!(timeless(&project.bake(&[])), @"2 files    2 up to date ([s] s)");
    assert_eq!(fs::metadata(project.path("out/room.gltf")).unwrap().modified().unwrap(), written);
}

#[test]
fn one_that_fails_does_not_stop_the_others() {
    let project = Project::new();
    project.write("src/a_broken.glb", "neither");
    let output = project.bake(&[]);
    assert_eq!(output.status.code(), Some(1));
    assert_snapshot!(timeless(&output), @"
    FAILED      src/a_broken.glb: the file is neither GLB nor JSON [NOT_GLTF]; export the model as glTF 2.0 (.glb or .gltf)
    baked       src/props/prop.gltf  (30 lights, [s] s; it was not baked before)
    baked       src/room.gltf  (30 lights, [s] s; it was not baked before)
    3 files    2 baked, 1 failed ([s] s)
    ");
    assert!(text(&output.stderr).starts_with("error: 1 of 3 files failed; the first: src/a_broken.glb"));
}

#[test]
fn every_input_that_matters_makes_it_anew_and_says_why() {
    let project = Project::new();
    project.report(&[]);
    let up_to_date = ("up_to_date".to_owned(), String::new());
    assert_eq!(project.room(&[]), up_to_date);
    let baked = |why: &str| ("baked".to_owned(), why.to_owned());

    let scene = fs::read_to_string(project.path("src/room.gltf")).unwrap();
    project.write("src/room.gltf", scene.replace("0.8", "0.7"));
    assert_eq!(project.room(&[]), baked("the file changed"));

    let mut data = fs::read(project.path("src/room data.bin")).unwrap();
    data[3] ^= 1;
    project.write("src/room data.bin", data);
    assert_eq!(project.room(&[]), baked("room data.bin changed"));

    write_picture(&project.path("src/paint.png"), 100);
    assert_eq!(project.room(&[]), baked("paint.png changed"));

    for flags in [
        ["--lights", "31"],
        ["--probes", "20"],
        ["--cell", "2"],
        ["--rays", "16"],
        ["--near", "1"],
        ["--preset", "draft"],
        ["--compress", "--no-config"],
    ] {
        let all = [&["bake", "src", "--out-dir", "out", "--json"], &flags[..]].concat();
        let output = project.run(&all);
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        let room = report["files"].as_array().unwrap().last().unwrap();
        assert_eq!(room["outcome"], "baked", "{flags:?}: {report}");
        assert!(room["reasons"][0].as_str().unwrap().starts_with("the options changed"), "{report}");
    }
    assert_eq!(project.room(&[]).0, "restored", "the cache still has the first options'");
}

#[test]
fn what_does_not_matter_makes_nothing_anew() {
    let project = Project::new();
    project.report(&[]);
    let touched = fs::read(project.path("src/room.gltf")).unwrap();
    project.write("src/room.gltf", touched);
    project.write("src/unrelated.bin", "x");
    project.write("src/.hidden.glb", "x");
    assert_eq!(project.report(&["--jobs", "1"])["up_to_date"], 2);
    assert_eq!(project.report(&["--jobs", "5"])["up_to_date"], 2);
}

#[test]
fn outputs_that_are_gone_or_altered_come_back_from_the_cache() {
    let project = Project::new();
    project.report(&[]);
    let good = fs::read(project.path("out/room.gltf")).unwrap();
    project.write("out/room.gltf", "broken");
    fs::remove_file(project.path("out/props/prop.gltf")).unwrap();
    assert_eq!(
        project.outcomes(&["--dry-run"]),
        [
            ("restorable".to_owned(), "prop.gltf is missing".to_owned()),
            ("restorable".to_owned(), "room.gltf was altered".to_owned()),
        ]
    );
    assert_eq!(fs::read(project.path("out/room.gltf")).unwrap(), b"broken", "a dry run writes nothing");
    assert_eq!(project.outcomes(&[]).into_iter().map(|o| o.0).collect::<Vec<_>>(), ["restored", "restored"]);
    assert_eq!(fs::read(project.path("out/room.gltf")).unwrap(), good);
}

/// Whatever stands in the cache, it makes the same outputs.
#[test]
fn an_altered_cache_is_noticed() {
    let project = Project::new();
    project.report(&[]);
    let good = fs::read(project.path("out/room.gltf")).unwrap();
    for damage in ["0", "manifest.json"] {
        fs::remove_dir_all(project.path("out")).unwrap();
        for entry in fs::read_dir(project.path("cache/entries")).unwrap() {
            fs::write(entry.unwrap().path().join(damage), "poison").unwrap();
        }
        let outcomes = project.outcomes(&[]);
        assert!(outcomes.iter().all(|(outcome, _)| outcome == "baked"), "{damage}: {outcomes:?}");
        assert_eq!(fs::read(project.path("out/room.gltf")).unwrap(), good);
        let again = project.outcomes(&[]);
        assert!(again.iter().all(|(outcome, _)| outcome == "up_to_date"), "{damage}: {again:?}");
    }
}

#[test]
fn a_miss_fails_where_it_must_not_be() {
    let project = Project::new();
    let missed = project.bake(&["--fail-on-miss"]);
    assert_eq!(missed.status.code(), Some(1));
    assert!(
        text(&missed.stderr).contains("2 of 2 files are not baked as they are now"),
        "{}",
        text(&missed.stderr)
    );
    assert!(!project.path("out").exists());
    project.report(&[]);
    fs::remove_dir_all(project.path("out")).unwrap();
    assert_eq!(project.bake(&["--fail-on-miss"]).status.code(), Some(0), "the cache has them");
    assert!(project.path("out/room.gltf").exists());
}

#[test]
fn the_project_s_file_sets_options_that_flags_override() {
    let project = Project::new();
    project.write(
        "vlm.toml",
        "lights = 20\nprobes = 0\n[[files]]\nglob = 'src/props/*'\nlights = 12\n[[files]]\nglob = '**/left*'\nskip = true\n\
         [cache]\ndir = 'kept'\n",
    );
    project.write("src/left.glb", "not even read");
    let lights = |flags: &[&str]| {
        let output = project.run(&[&["bake", "src", "--out-dir", "out", "--json"], flags].concat());
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!((&report["skipped"], output.status.code()), (&Value::from(1), Some(0)), "{report}");
        let asked = |file: &Value| file["report"]["asked_lights"].as_u64().unwrap();
        report["files"].as_array().unwrap().iter().map(asked).collect::<Vec<_>>()
    };
    assert_eq!(lights(&[]), [12, 20]);
    assert_eq!(lights(&["--lights", "15"]), [15, 15]);
    let without = project.run(&[
        "bake",
        "src/room.gltf",
        "--out-dir",
        "out",
        "--no-config",
        "--json",
        "--preset",
        "draft",
    ]);
    let report: Value = serde_json::from_slice(&without.stdout).unwrap();
    assert_eq!(report["files"][0]["report"]["asked_lights"], 120);

    let one = project.run(&["bake", "src/room.gltf", "-o", "one.glb"]);
    assert_eq!(one.status.code(), Some(0), "{}", text(&one.stderr));
    assert_eq!(read(project.path("one.glb").to_str().unwrap()).settings.lights, 20, "of one file, too");

    project.write("vlm.toml", "[[files]]\nglob = '*'\nlihgts = 3\n");
    let wrong = project.bake(&[]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(text(&wrong.stderr).contains("vlm.toml:3:1: unknown field `lihgts`"), "{}", text(&wrong.stderr));
    assert!(text(&wrong.stderr).contains("did you mean `lights`?"));
}

#[test]
fn the_project_s_cache_is_where_it_says() {
    let project = Project::new();
    project.write("vlm.toml", "[cache]\ndir = 'kept'\nsize = '1 kB'\n");
    let arguments = [&["bake", "src", "--out-dir", "out"], &QUICK[..]].concat();
    let mut command = vlm(arguments);
    command.current_dir(project.0.path()).env_remove("VLM_CACHE_DIR");
    assert!(command.output().unwrap().status.success());
    assert!(project.path("kept/entries").is_dir());
    let left = fs::read_dir(project.path("kept/entries")).unwrap().count();
    assert_eq!(left, 0, "entries above the size go");
    assert!(project.path("out/room.gltf").exists());
}

#[test]
fn outputs_do_not_depend_on_how_many_are_baked_at_once() {
    let project = Project::new();
    let bake = |out: &str, jobs: &str, threads: &str| {
        let all = [
            &["bake", "src", "--out-dir", out, "--no-cache", "--jobs", jobs],
            &["--lights", "30", "--probes", "40"][..],
        ];
        let mut command = vlm(all.concat());
        command.current_dir(project.0.path()).env_remove("VLM_CACHE_DIR").env("RAYON_NUM_THREADS", threads);
        assert!(command.output().unwrap().status.success());
        contents(&project.path(out))
    };
    let one = bake("a", "1", "1");
    assert_eq!(
        one.len(),
        6,
        "two scenes, the data of each, and both files that the room refers to: {:?}",
        one.keys()
    );
    assert_eq!(one, bake("b", "2", "3"));
}

#[test]
fn flags_that_make_no_sense_together_are_refused() {
    let project = Project::new();
    for (arguments, message) in [
        (vec!["bake", "src", "-o", "out.glb"], "is a folder; use --out-dir"),
        (
            vec!["bake", "src/room.gltf", "src/props/prop.gltf", "-o", "out.glb"],
            "--output takes one file, but 2",
        ),
        (vec!["bake", "src/room.gltf", "-o", "out.glb", "--dry-run"], "--dry-run is for several files"),
        (vec!["bake", "src/room.gltf"], "--output <FILE>"),
        (vec!["bake", "src", "--out-dir", "src"], "would replace their sources"),
        (vec!["bake", "src/room.gltf", "--out-dir", "src"], "its bake would replace it"),
        (vec!["bake", "nowhere", "--out-dir", "out"], "there is no such file or folder"),
        (vec!["bake", "src/*.glb", "--out-dir", "out"], "no .glb or .gltf file is there"),
        (vec!["bake", "src", "--out-dir", "out", "--no-cache", "--cache-size", "1MB"], "cannot be used with"),
    ] {
        let output = project.run(&arguments);
        assert_ne!(output.status.code(), Some(0), "{arguments:?}");
        let said = [text(&output.stderr), text(&output.stdout)].concat();
        assert!(said.contains(message), "{arguments:?}: {said}");
    }
    assert!(!project.path("out.glb").exists());
}

/// Two runs at once on one cache and one output folder: each file is baked once.
#[test]
fn runs_at_the_same_time_share_a_cache() {
    let project = Project::new();
    let start = || {
        let all = [&["bake", "src", "--out-dir", "out", "--json", "--lights", "30", "--probes", "300"][..]]
            .concat();
        let mut command = vlm(all);
        command.current_dir(project.0.path()).env("VLM_CACHE_DIR", project.path("cache"));
        command.stdout(std::process::Stdio::piped()).spawn().unwrap()
    };
    let runs: Vec<_> = (0..3).map(|_| start()).collect();
    let mut baked = 0;
    for run in runs {
        let output = run.wait_with_output().unwrap();
        assert!(output.status.success());
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        baked += report["baked"].as_u64().unwrap();
    }
    assert_eq!(baked, 2, "each file once, whoever came first");
}

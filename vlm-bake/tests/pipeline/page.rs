//! The page on pipelines: its commands run, and its table says what the tools do.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

use crate::support::{VLM, bake, check, npm, repository, said, vlm};

/// The commands of a page: those that run, and those that cannot here.
#[derive(Debug, Default, PartialEq)]
struct Commands {
    run: Vec<String>,
    not_run: Vec<String>,
}

/// Reads the lines of the blocks "sh" and "sh not-run".
fn commands(page: &str) -> Commands {
    let mut found = Commands::default();
    let mut block = "";
    for line in page.lines() {
        match (line.strip_prefix("```"), block) {
            (Some(_), "sh" | "sh not-run" | "other") => block = "",
            (Some(fence), _) => block = if fence.starts_with("sh") { fence } else { "other" },
            (None, "sh") => found.run.push(line.to_owned()),
            (None, "sh not-run") => found.not_run.push(line.to_owned()),
            (None, "" | "other") => {}
            (None, unknown) => panic!("a block `{unknown}` is neither `sh` nor `sh not-run`"),
        }
    }
    found
}

/// Runs a line in a folder with `vlm` and the npm packages on the path.
fn run(folder: &Path, line: &str) -> Output {
    let own = Path::new(VLM).parent().unwrap().to_owned();
    let others = std::env::var_os("PATH").unwrap();
    let path = [own, npm().join(".bin")].into_iter().chain(std::env::split_paths(&others));
    let path = std::env::join_paths(path).unwrap();
    Command::new("sh").current_dir(folder).args(["-ec", line]).env("PATH", path).output().unwrap()
}

/// A folder as the page describes it.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let room = std::fs::read(repository("assets/cornell.glb")).unwrap();
    // The same length, so that no size in the file changes.
    let authored = replace(&room, b"\"tall block\"", b"\"VLM_blocks\"");
    assert_ne!(authored, room);
    std::fs::write(folder.path().join("room.glb"), room).unwrap();
    std::fs::write(folder.path().join("authored.glb"), authored).unwrap();
    std::os::unix::fs::symlink(npm().canonicalize().unwrap(), folder.path().join("node_modules")).unwrap();
    folder
}

fn replace(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for i in 0..=bytes.len() - from.len() {
        if bytes[i..].starts_with(from) {
            bytes[i..i + from.len()].copy_from_slice(to);
        }
    }
    bytes
}

/// How many Virtual Light Meshes of a file artists made.
fn authored(folder: &Path, name: &str) -> usize {
    let content: Value = serde_json::from_slice(&vlm(folder, &["inspect", name, "--json"]).stdout).unwrap();
    content["vlms"].as_array().unwrap().iter().filter(|vlm| vlm["authored"] == true).count()
}

#[test]
#[cfg_attr(not(has_npm), ignore = "tests/js has no node_modules: run tests/run")]
fn every_command_of_the_page_runs() {
    let folder = folder();
    let page = std::fs::read_to_string(repository("docs/pipeline.md")).unwrap();
    let commands = commands(&page);
    assert!(commands.run.len() >= 18, "{commands:?}");
    for line in &commands.run {
        let output = run(folder.path(), line);
        assert!(output.status.success(), "`{line}`: {}", said(&output));
    }
    for line in &commands.not_run {
        println!("not run: {line}");
        assert!(line.starts_with("blender "), "only Blender is not here: `{line}`");
    }
    assert!(commands.run.iter().all(|line| !line.contains("blender")));
    assert_eq!(authored(folder.path(), "authored.vlm.glb"), 1, "the artist's mesh was lost on the way");
    assert_eq!(authored(folder.path(), "room.vlm.glb"), 0);
    assert_eq!(check(folder.path(), "shipped.glb"), None);

    // What the page warns of.
    for line in [
        "gltfpack -i authored.glb -o lost.glb -c",
        "gltfpack -i authored.glb -o lost.glb -kn -ke",
        "gltf-transform optimize authored.glb lost.glb",
    ] {
        assert!(run(folder.path(), line).status.success(), "{line}");
        assert!(run(folder.path(), "vlm bake lost.glb -o lost.vlm.glb --preset draft").status.success());
        assert_eq!(
            authored(folder.path(), "lost.vlm.glb"),
            0,
            "`{line}` no longer loses it: correct the page"
        );
    }
}

#[test]
#[cfg_attr(not(has_npm), ignore = "tests/js has no node_modules: run tests/run")]
fn a_command_that_cannot_run_fails() {
    let folder = folder();
    for line in
        ["vlm bake room.glb -o out.glb --no-such-flag", "gltfpack -i missing.glb -o out.glb", "blender"]
    {
        assert!(!run(folder.path(), line).status.success(), "{line}");
    }
}

#[test]
fn blocks_are_told_apart() {
    let page = "```sh\na\nb\n```\nc\n```sh not-run\nd\n```\n```js\ne\n```\n";
    let [a, b, d] = ["a", "b", "d"].map(str::to_owned);
    assert_eq!(commands(page), Commands { run: vec![a, b], not_run: vec![d] });
    assert!(std::panic::catch_unwind(|| commands("```sh later\nx\n```\n")).is_err());
}

#[test]
#[cfg_attr(not(has_npm), ignore = "tests/js has no node_modules: run tests/run")]
fn other_tools_do_to_the_extension_what_the_table_says() {
    let folder = folder();
    bake("cornell.glb", folder.path(), "baked.glb");
    assert_eq!(check(folder.path(), "baked.glb"), None);
    let config = "--config node_modules/gltf-transform-vlm/gltf-transform.config.mjs";
    for (line, code) in [
        (format!("gltf-transform draco baked.glb out.glb {config}").as_str(), "DRACO"),
        ("gltf-transform copy baked.glb out.glb", "NO_VLM"),
        ("gltfpack -i baked.glb -o out.glb", "NO_VLM"),
        ("gltfpack -i baked.glb -o out.glb -c", "NO_VLM"),
        ("gltfpack -i baked.glb -o out.glb -cc", "NO_VLM"),
        ("gltfpack -i baked.glb -o out.glb -noq -kn -ke", "NO_VLM"),
        ("gltf-pipeline -i baked.glb -o out.glb", "STALE"),
        ("gltf-pipeline -i baked.glb -o out.glb -d", "DRACO"),
    ] {
        let output = run(folder.path(), line);
        assert!(output.status.success(), "`{line}`: {}", said(&output));
        assert_eq!(check(folder.path(), "out.glb").as_deref(), Some(code), "{line}");
        if code != "DRACO" {
            assert!(
                run(folder.path(), "vlm bake out.glb -o again.glb --preset draft").status.success(),
                "{line}"
            );
            assert_eq!(check(folder.path(), "again.glb"), None, "{line}");
        }
    }
}

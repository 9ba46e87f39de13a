//! Writing to disk: all or nothing, and a clear word when it cannot be.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::fs;
use std::path::{Path, PathBuf};

use vlm_format::{Error, OutputFile, write_atomic};

fn output(path: &str, text: &str) -> OutputFile {
    OutputFile { path: PathBuf::from(path), bytes: text.as_bytes().to_vec(), copied_from: None }
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn files_and_folders_arrive_whole() {
    let folder = tempfile::tempdir().unwrap();
    write_atomic(&[output("a.gltf", "json"), output("textures/a.png", "image")], folder.path()).unwrap();
    assert_eq!(names(folder.path()), ["a.gltf", "textures"]);
    assert_eq!(fs::read(folder.path().join("textures/a.png")).unwrap(), b"image");
    write_atomic(&[output("a.gltf", "other")], folder.path()).unwrap();
    assert_eq!(fs::read(folder.path().join("a.gltf")).unwrap(), b"other");
}

#[test]
fn a_file_that_is_already_right_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    fs::write(&path, "image").unwrap();
    let before = fs::metadata(&path).unwrap().modified().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(20));
    write_atomic(&[output("a.png", "image")], folder.path()).unwrap();
    assert_eq!(fs::metadata(&path).unwrap().modified().unwrap(), before);
}

#[test]
fn a_failure_leaves_everything_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.gltf"), "old").unwrap();
    fs::create_dir(folder.path().join("folder.bin")).unwrap();
    let too_long = "x".repeat(300);
    for bad in ["folder.bin", &too_long] {
        let error = write_atomic(&[output(bad, "data"), output("a.gltf", "new")], folder.path()).unwrap_err();
        assert!(matches!(&error, Error::Io { .. }) && error.to_string().contains(bad), "{error}");
        assert_eq!(names(folder.path()), ["a.gltf", "folder.bin"]);
        assert_eq!(fs::read(folder.path().join("a.gltf")).unwrap(), b"old");
    }
}

#[test]
fn a_missing_output_folder_is_named() {
    let folder = tempfile::tempdir().unwrap().path().join("missing");
    let error = write_atomic(&[output("a.glb", "")], &folder).unwrap_err().to_string();
    for part in [&*folder.display().to_string(), "does not exist", "check the path"] {
        assert!(error.contains(part), "`{part}` is missing in: {error}");
    }
}

/// Those of programs that still run stay; which those are only Linux tells at once.
#[test]
#[cfg(target_os = "linux")]
fn what_killed_programs_left_goes() {
    let folder = tempfile::tempdir().unwrap();
    let gone = format!(".a.glb.{}-0.tmp", u32::MAX);
    let ours = format!(".a.glb.{}-7.tmp", std::process::id());
    for name in [&gone, &ours, ".b.glb.4294967295-0.tmp", ".a.glb.tmp"] {
        fs::write(folder.path().join(name), "half").unwrap();
    }
    write_atomic(&[output("a.glb", "whole")], folder.path()).unwrap();
    assert_eq!(names(folder.path()), [&ours, ".a.glb.tmp", ".b.glb.4294967295-0.tmp", "a.glb"]);
}

/// A main file and the data named for its content belong together, whatever a former output, or one that was killed, left.
#[test]
#[cfg(target_os = "linux")]
fn data_of_a_former_output_goes_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let data = |digit: &str| format!("a.vlm.{}.bin", digit.repeat(16));
    let abandoned = format!(".{}.{}-0.tmp", data("3"), u32::MAX);
    for name in
        [&abandoned, data("1").as_str(), "a.vlm.bin", "a.vlm.12.bin", "b.vlm.1111111111111111.bin", "a.bin"]
    {
        fs::write(folder.path().join(name), "data").unwrap();
    }
    write_atomic(&[output("a.gltf", "json"), output(&data("2"), "new")], folder.path()).unwrap();
    let left = ["a.bin", "a.gltf", "a.vlm.12.bin", &data("2"), "a.vlm.bin", "b.vlm.1111111111111111.bin"];
    assert_eq!(names(folder.path()), left);
}

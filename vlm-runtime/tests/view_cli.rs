//! The program `vlm-view`: what it prints, and with which code it ends. None of these needs a GPU.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::process::{Command, Output};

fn run(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vlm-view"));
    // No driver, no display.
    command.env("VK_ICD_FILENAMES", "/nowhere.json").env("VK_DRIVER_FILES", "/nowhere.json");
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    command.args(arguments).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn cornell() -> String {
    concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/cornell.glb").to_owned()
}

#[test]
fn without_an_adapter_it_says_what_to_install() {
    let output = run(&[&cornell(), "--headless", "--method", "direct", "--size", "8x8"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("mesa-vulkan-drivers"), "{}", stderr(&output));
    assert!(output.stdout.is_empty());
}

#[test]
fn without_a_display_it_says_what_to_do() {
    if cfg!(not(target_os = "linux")) {
        return;
    }
    let output = run(&[&cornell()]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    let text = stderr(&output);
    assert!(text.contains("--headless") && !text.contains("panicked"), "{text}");
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let output = run(&["/nowhere/room.glb", "--headless"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("/nowhere/room.glb"), "{}", stderr(&output));
}

#[test]
fn a_pipe_is_not_followed() {
    let output = run(&["-"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("--headless"), "{}", stderr(&output));
}

#[test]
fn flags_that_do_not_go_together_are_refused() {
    for flags in [&["--out", "a.png"][..], &["--json"], &["--headless", "--size", "0x8"], &["--method", "x"]]
    {
        let cornell = cornell();
        let all: Vec<&str> = std::iter::once(cornell.as_str()).chain(flags.iter().copied()).collect();
        assert_eq!(run(&all).status.code(), Some(2), "{flags:?}");
    }
}

#[test]
fn help_names_every_flag_of_vlm_render() {
    let output = run(&["--help"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for flag in
        ["--camera", "--size", "--method", "--out", "--irradiance", "--json", "--exposure", "--alpha-masks"]
    {
        assert!(text.contains(flag), "{flag}: {text}");
    }
}

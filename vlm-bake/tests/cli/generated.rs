//! `vlm completions` and `vlm man`.

use std::process::Command;

use crate::support::{Folders, run, text};

/// Every command, as `vlm --help` lists them.
fn commands() -> Vec<String> {
    let help = run(["--help"]);
    let lines = text(&help.stdout).lines().skip_while(|line| *line != "Commands:").skip(1);
    let listed = lines.take_while(|line| line.starts_with("  "));
    let names =
        listed.filter(|line| !line.starts_with("   ")).filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

/// True if a shell accepts a script; `None` if there is no such shell.
fn accepts(shell: &str, script: &[u8]) -> Option<bool> {
    let folders = Folders::new();
    let path = folders.input("script", script);
    Command::new(shell).args(["-n", &path]).output().ok().map(|output| output.status.success())
}

#[test]
fn every_shell_gets_a_script_that_names_every_command() {
    let commands = commands();
    assert!(commands.contains(&String::from("bake")) && commands.len() >= 8, "{commands:?}");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let output = run(["completions", shell]);
        assert_eq!(output.status.code(), Some(0), "{shell}");
        for command in &commands {
            assert!(text(&output.stdout).contains(command.as_str()), "{shell} does not complete {command}");
        }
        assert!(text(&output.stdout).contains("preset"), "{shell} does not complete flags");
    }
    assert_eq!(run(["completions", "cmd"]).status.code(), Some(2));
}

#[test]
fn shells_accept_their_scripts() {
    for shell in ["bash", "zsh", "fish"] {
        let script = run(["completions", shell]).stdout;
        match accepts(shell, &script) {
            Some(accepted) => assert!(accepted, "{shell}"),
            None => println!("there is no {shell} here"),
        }
    }
    assert_eq!(accepts("bash", b"if then fi"), Some(false));
}

#[test]
fn bash_completes_a_flag() {
    let script = run(["completions", "bash"]).stdout;
    let complete = |words: &str| {
        let ask = format!(
            "COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}}-1)); COMPREPLY=(); _vlm vlm \"${{COMP_WORDS[COMP_CWORD]}}\" \
             bake; echo \"${{COMPREPLY[@]}}\"\n"
        );
        let folders = Folders::new();
        let path = folders.input("ask", [script.as_slice(), b"\n", ask.as_bytes()].concat());
        text(&Command::new("bash").arg(path).output().unwrap().stdout).trim().to_owned()
    };
    assert_eq!(complete("vlm bake --pres"), "--preset");
    assert_eq!(complete("vlm bake --no-such"), "");
}

#[test]
fn every_command_has_a_manual_page() {
    let folders = Folders::new();
    let folder = folders.output("man");
    let output = run(["man", &folder]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let page = |name: &str| std::fs::read_to_string(format!("{folder}/{name}.1")).unwrap_or_default();
    let commands = commands();
    for command in &commands {
        let page = page(&format!("vlm-{command}"));
        assert!(page.contains(".SH SYNOPSIS") && page.contains(command.as_str()), "{command}: {page}");
    }
    assert!(page("vlm").contains("vlm\\-bake(1)"), "{}", page("vlm"));
    assert!(page("vlm-bake").contains("\\-\\-preset"));
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), commands.len() + 1);
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let folders = Folders::new();
    let file = folders.input("file", b"");
    let output = run(["man", &format!("{file}/man")]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("file/man: cannot be written"), "{}", text(&output.stderr));
}

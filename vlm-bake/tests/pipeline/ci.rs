//! The files for CI are YAML of the right shape, and the program knows every command in them.

use std::process::Command;

use serde_json::Value;

use crate::support::{VLM, repository, said};

fn yaml(path: &str) -> Value {
    let text = std::fs::read_to_string(repository(path)).unwrap();
    serde_saphyr::from_str(&text).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// All texts in a document, in any depth.
fn texts<'a>(value: &'a Value, found: &mut Vec<&'a str>) {
    match value {
        Value::String(text) => found.push(text),
        Value::Array(list) => list.iter().for_each(|item| texts(item, found)),
        Value::Object(map) => map.values().for_each(|item| texts(item, found)),
        _ => {}
    }
}

/// The words of each `vlm` command in a script, with variables filled in.
fn commands(script: &str) -> Vec<Vec<String>> {
    let lines = script.lines().map(str::trim).filter(|line| line.starts_with("vlm "));
    lines
        .map(|line| line.split(" > ").next().unwrap().split_whitespace().skip(1).map(filled_in).collect())
        .collect()
}

fn filled_in(word: &str) -> String {
    match word.trim_matches('"').strip_prefix('$') {
        Some(name) if name.contains("JOBS") => String::from("2"),
        Some(name) => name.to_lowercase(),
        None => word.to_owned(),
    }
}

/// All commands of the CI kit, with the file that has them.
fn all_commands() -> Vec<(&'static str, Vec<String>)> {
    let mut all = Vec::new();
    for path in ["action.yml", "docs/ci/gitlab-ci.yml", ".pre-commit-hooks.yaml"] {
        let (document, mut found) = (yaml(path), Vec::new());
        texts(&document, &mut found);
        all.extend(found.into_iter().flat_map(commands).map(|command| (path, command)));
    }
    // The hooks' commands with the arguments that users give them.
    let (hooks, config) = (yaml(".pre-commit-hooks.yaml"), yaml("docs/ci/pre-commit-config.yaml"));
    for hook in config["repos"][0]["hooks"].as_array().unwrap() {
        let known = hooks.as_array().unwrap().iter().find(|known| known["id"] == hook["id"]);
        let entry =
            known.unwrap_or_else(|| panic!("there is no hook {}", hook["id"]))["entry"].as_str().unwrap();
        let mut command = commands(entry).remove(0);
        let arguments = hook["args"].as_array().into_iter().flatten();
        command.extend(arguments.map(|argument| argument.as_str().unwrap().to_owned()));
        all.push(("docs/ci/pre-commit-config.yaml", command));
    }
    all
}

/// What the program says against a command whose flags it does not know, or that contradict each other; `None` if it understands it.
fn refusal(command: &[String]) -> Option<String> {
    // Nothing is there to be baked, so it ends at once.
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(VLM).current_dir(folder.path()).args(command).output().unwrap();
    let said = said(&output);
    said.contains("try '--help'").then_some(said)
}

#[test]
fn the_files_have_what_their_readers_ask_for() {
    let action = yaml("action.yml");
    assert_eq!(action["runs"]["using"], "composite");
    for step in action["runs"]["steps"].as_array().unwrap() {
        assert!(step.get("run").is_some() != step.get("uses").is_some(), "{step}");
        assert!(
            step.get("run").is_none() || step.get("shell").is_some(),
            "a composite step needs a shell: {step}"
        );
    }
    let page = std::fs::read_to_string(repository("docs/ci/README.md")).unwrap();
    for name in action["inputs"].as_object().unwrap().keys() {
        assert!(page.contains(&format!("| `{name}` |")), "docs/ci/README.md does not explain `{name}`");
    }
    // Every input that a step names exists.
    let script = action["runs"].to_string();
    for used in script.split("inputs.").skip(1) {
        let name: String = used.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '-').collect();
        assert!(action["inputs"].get(&name).is_some(), "the action has no input `{name}`");
    }
    for hook in yaml(".pre-commit-hooks.yaml").as_array().unwrap() {
        for key in ["id", "name", "entry", "language", "files"] {
            assert!(hook[key].is_string(), "{hook} has no {key}");
        }
    }
    assert!(yaml("docs/ci/gitlab-ci.yml")["bake"]["script"].is_array());
}

#[test]
fn the_program_knows_every_command_that_bakes() {
    let all = all_commands();
    for path in ["action.yml", "docs/ci/gitlab-ci.yml", ".pre-commit-hooks.yaml"] {
        assert!(all.iter().any(|(file, _)| *file == path), "{path} has no command");
    }
    for (path, command) in all.into_iter().filter(|(_, command)| command[0] == "bake") {
        if path == ".pre-commit-hooks.yaml" {
            continue; // Users give it its arguments, as the configuration does.
        }
        assert_eq!(refusal(&command), None, "{path}: vlm {}", command.join(" "));
    }
}

#[test]
fn the_program_knows_every_other_command() {
    for (path, command) in all_commands().into_iter().filter(|(_, command)| command[0] != "bake") {
        let command: Vec<String> =
            if command.len() == 1 { [command, vec![String::from("a.glb")]].concat() } else { command };
        assert_eq!(refusal(&command), None, "{path}: vlm {}", command.join(" "));
    }
}

#[test]
fn a_flag_that_the_program_does_not_know_is_seen() {
    let words = |line: &str| commands(line).remove(0);
    assert_eq!(refusal(&words("vlm check --json baked > report.json")), None);
    assert!(refusal(&words("vlm check --no-such-flag baked")).unwrap().contains("--no-such-flag"));
    assert!(refusal(&words("vlm no-such-command baked")).is_some());
    assert!(
        refusal(&words("vlm bake in --out-dir out --dry-run --fail-on-miss")).is_some(),
        "they contradict each other"
    );
    assert!(commands("echo vlm check").is_empty());
    assert_eq!(words("vlm bake \"$INPUT\" --jobs \"$VLM_JOBS\" > x"), ["bake", "input", "--jobs", "2"]);
}

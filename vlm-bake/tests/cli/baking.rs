//! `vlm bake` on what is in order: what it prints, what it writes, and that it always writes the same.

use insta::assert_snapshot;
use serde_json::{Value, json};
use vlm_bake::options::{BakeOptions, Preset};

use crate::support::{Document, Folders, read, repository, run, run_with_input, text, vlm};

/// The lines with every number, path and hash that may change taken out.
fn redacted(summary: &str) -> String {
    let mut lines = Vec::new();
    for line in summary.lines() {
        let words = line.split(' ').map(|word| {
            let core = word.trim_matches(|c: char| "(),;%".contains(c));
            if core.contains('/') {
                word.replace(core, "[path]")
            } else if core.parse::<f64>().is_ok() {
                word.replace(core, "[n]")
            } else {
                word.to_owned()
            }
        });
        lines.push(words.collect::<Vec<_>>().join(" "));
    }
    lines.join("\n")
}

#[test]
fn summary_says_what_was_made_and_where_the_picture_is() {
    let folders = Folders::new();
    let picture = folders.output("out.png");
    let output = run([
        "bake",
        &repository("assets/cornell.glb"),
        "-o",
        &folders.output("out.glb"),
        "--preview",
        &picture,
    ]);
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(text(&output.stderr), "", "stderr is silent in a pipe");
    assert!(std::fs::metadata(&picture).unwrap().len() > 1000);
    assert!(text(&output.stdout).contains(&picture));
    assert_snapshot!(redacted(text(&output.stdout)), @"
    baked     [path]
    lights    [n] of [n] asked, for [n] visible triangles; decimation error [n] mm
    clearance [n] of [n] surface points violated; lights lie [n] mm deep on average, [n] mm required
    tags      [n] ([n] % of the lights' area)
    grid      [n] probes in [n] cells; [n] near lights, [n] far; [n] kB
    time      [n] s
    picture   [path]  (camera camera, radiance in nt times [n])
    ");
}

#[test]
fn report_has_the_keys_that_others_read() {
    let folders = Folders::new();
    let report = folders.output("report.json");
    let output = run([
        "bake",
        &repository("assets/cornell.glb"),
        "-o",
        &folders.output("out.glb"),
        "--report",
        &report,
    ]);
    assert_eq!(output.status.code(), Some(0));
    let report: Value = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
    for key in [
        "/visible_triangles",
        "/lights",
        "/clearance/samples",
        "/clearance/violations",
        "/clearance/worst_m",
        "/grid/leaves",
        "/grid/probes",
        "/grid/near_entries",
        "/grid/far_entries",
        "/grid/bytes",
        "/seconds/decimate",
        "/asked_lights",
    ] {
        assert!(report.pointer(key).is_some_and(Value::is_number), "{key} in {report}");
    }
    assert!(report["tags"].is_array());
    assert_eq!(report["hash"].as_str().unwrap().len(), 64);
    assert_eq!(report["visible_triangles"], json!(34));
    assert_eq!(report["clearance"]["violations"], json!(0));
}

#[test]
fn pipes_carry_the_same_bytes() {
    let folders = Folders::new();
    let input = repository("assets/cornell.glb");
    let written = folders.output("out.glb");
    assert!(run(["bake", &input, "-o", &written]).status.success());
    let piped = run_with_input(&["bake", "-", "-o", "-"], &std::fs::read(&input).unwrap());
    assert_eq!(piped.status.code(), Some(0));
    assert!(piped.stdout == std::fs::read(written).unwrap(), "the pipe's bytes differ from the file's");
}

#[test]
fn same_bytes_twice_and_with_any_number_of_threads() {
    for scene in ["cornell", "cornell_sphere"] {
        let input = repository(&format!("assets/{scene}.glb"));
        let bake = |threads: &str| {
            let output = vlm(["bake", &input, "-o", "-"]).env("RAYON_NUM_THREADS", threads).output().unwrap();
            assert!(output.status.success());
            output.stdout
        };
        let first = bake("2");
        assert!(first == bake("2"), "{scene}: twice");
        assert!(first == bake("1"), "{scene}: with one thread");
    }
}

#[test]
fn compressed_bakes_hold_the_same_in_fewer_bytes_and_say_so() {
    let folders = Folders::new();
    let input = repository("assets/cornell.glb");
    let bake = |name: &str, flags: &[&str]| {
        let output = folders.output(name);
        let page = folders.output(&format!("{name}.html"));
        let fixed = ["bake", &input, "-o", &output, "--preset", "draft", "--report-html", &page];
        let result = run(fixed.into_iter().chain(flags.iter().copied()));
        assert!(result.status.success(), "{}", text(&result.stderr));
        (output, std::fs::read_to_string(page).unwrap())
    };
    let (plain, plain_page) = bake("plain.glb", &[]);
    let (small, small_page) = bake("small.glb", &["--compress"]);
    let (again, _) = bake("again.glb", &["--compress"]);
    let bytes = |path: &str| std::fs::read(path).unwrap();
    assert_eq!(read(&small), read(&plain));
    assert!(4 * bytes(&small).len() < 3 * bytes(&plain).len(), "{} bytes", bytes(&small).len());
    assert!(bytes(&again) == bytes(&small), "the second time");
    assert!(run(["check", &small, "--geometry", &input]).status.success());

    let grid = |path: &str| -> Value {
        serde_json::from_slice::<Value>(&run(["inspect", path, "--json"]).stdout).unwrap()["grid"].clone()
    };
    let (large, small_grid) = (grid(&plain), grid(&small));
    assert_eq!((&large["bytes"], &large["stored_bytes"]), (&small_grid["bytes"], &large["bytes"]));
    let (decoded, stored) = (&small_grid["bytes"], &small_grid["stored_bytes"]);
    assert!(4 * stored.as_u64().unwrap() < 3 * decoded.as_u64().unwrap(), "{stored} of {decoded}");
    let kilobytes = |bytes: &Value| format!("{:.1} kB", bytes.as_f64().unwrap() / 1e3);
    let line = format!("{}, {} in the file", kilobytes(decoded), kilobytes(stored));
    assert!(text(&run(["inspect", &small]).stdout).contains(&line), "{line}");

    let sum = |page: &str| {
        let row =
            page.split("all arrays of the VLM").nth(1).unwrap().split("</tr>").next().unwrap().to_owned();
        row.split("<td class=\"n\">")
            .skip(1)
            .map(|c| c.split('<').next().unwrap().to_owned())
            .collect::<Vec<_>>()
    };
    let (large, small) = (sum(&plain_page), sum(&small_page));
    assert_eq!((&large[0], &large[1]), (&small[0], &large[0]));
    assert_ne!(small[1], small[0], "in memory and in the file");
}

#[test]
fn the_budget_of_lights_is_met() {
    let folders = Folders::new();
    for asked in [120, 460, 2000] {
        let output = folders.output("out.glb");
        let input = repository("assets/cornell.glb");
        assert!(run(["bake", &input, "-o", &output, "--lights", &asked.to_string()]).status.success());
        let made = read(&output).triangles.len();
        assert!(made.abs_diff(asked) * 20 <= asked, "{made} lights where {asked} were asked");
    }
}

#[test]
fn emissive_materials_become_lights() {
    let folders = Folders::new();
    let mut document = Document::room();
    document.push(
        "lamp",
        &[[[-0.5, 1.9, -0.5], [0.5, 1.9, -0.5], [0.5, 1.9, 0.5], [-0.5, 1.9, 0.5]]],
        Some(2),
    );
    let asset = folders.bake(&document, &["--lights", "200"]);
    let lamp = asset.vlms.iter().find(|vlm| vlm.node == 1).expect("the lamp makes lights");
    let [first, count] = lamp.lights.map(|n| n as usize);
    assert!(count > 0);
    // The lights are a little smaller than the lamp, having sunk into it, and emit as much. Radiosity of a Lambertian emitter
    // is pi times the radiance in the material; the lamp has 1 m2.
    let flux: glam::Vec3 = (first..first + count).map(|l| asset.emission[l] * area(&asset, l)).sum();
    let expected = std::f32::consts::PI * glam::Vec3::new(1.0, 0.5, 0.25);
    assert!(flux.abs_diff_eq(expected, 0.01 * expected.z), "{flux} where {expected} leaves the lamp");
    assert!(asset.emission[..first].iter().all(|&e| e == glam::Vec3::ZERO), "walls do not emit");
}

/// Square metres of a light, in the space of its node.
fn area(asset: &vlm_format::VlmAsset, light: usize) -> f32 {
    let [a, b, c] = asset.triangles[light].map(|v| asset.positions[v as usize]);
    (b - a).cross(c - a).length() / 2.0
}

/// The help and the README say what the presets do, and the options do it.
#[test]
fn presets_are_what_they_are_said_to_be() {
    let output = run(["bake", "--help"]);
    let readme = std::fs::read_to_string(repository("README.md")).unwrap();
    for preset in Preset::ALL {
        let BakeOptions { samples, grid, lights, .. } = BakeOptions::preset(preset, 100_000);
        let help = text(&output.stdout);
        let help = help
            .lines()
            .find(|line| line.trim_start().starts_with(&format!("- {}:", preset.name())))
            .unwrap();
        assert!(help.ends_with(&format!(", {samples} samples each")), "{help}");
        let row = readme.lines().find(|line| line.starts_with(&format!("| `{}` |", preset.name()))).unwrap();
        let told: Vec<&str> = row.split('|').map(str::trim).collect();
        assert_eq!(told[3], samples.to_string(), "{row}");
        let probes = told[4].replace(',', "");
        assert!(probes.ends_with(&format!(" {} {}", grid.rays, grid.near)), "{row}");
        let a_light = f64::from(grid.probes) / f64::from(lights);
        let fewest = BakeOptions::preset(preset, 1).grid.probes;
        assert!(probes.starts_with(&format!("{a_light} ({fewest} at least)")), "{row}");
    }
}

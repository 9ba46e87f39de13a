//! `summary.md`: what a run found, in tables.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::curves::{SceneCurves, Spread, YARDSTICK, distinct, method_name, method_order, scene_curves};
use super::equal::{Equal, table};
use super::names::{file_name, sheet_file};
use super::numbers::{range, short, time};
use super::row::Row;

/// What the columns of a camera's table hold.
const COLUMNS: &str = "Columns of the tables by camera:
- front: * marks settings on the method's Pareto front, from the means over the scene's cameras.
- pairs: a pixel with a light or probe; rays: of a frame; bytes: what the method keeps beside the scene.
- prepare: once per scene (bake, grid, probe placement), not in the frame's time.
- inject: light arrives at lights or probes, per frame.
- gather: indirect light of every pixel, per frame.
- algorithm: relative RMSE against the exact sum over the same lights, without occlusion; – where there are no area lights.
  The algorithm's error and the missing occlusion can cancel: an error against the truth below the exact sum's is chance.
- relMSE: mean of squared error over squared truth, so that dark pixels count as much as bright ones.
- FLIP: mean visible difference of the shown pictures, 0 to 1.
- energy: sum over the truth's sum, less 1; above 0 is too bright.
- p99: 99th percentile of the luminance's error, over the truth's mean.
- jump: largest difference of the error between neighbouring pixels, over the truth's mean: an edge that should not be.
- frame change: RMS of the change between two frames of a still scene, over the truth's RMS: flicker.
- †: the truth's own noise is above a third of this error, which is then an upper bound.
";

/// The summary of a run's rows, in Markdown; `sheets` names the contact sheets beside it. The same rows give the same text.
#[must_use]
pub fn summary(rows: &[Row], sheets: &BTreeSet<String>) -> String {
    let mut text = introduction(rows);
    for scene in scene_curves(rows) {
        let rows: Vec<&Row> = rows.iter().filter(|row| row.scene == scene.scene).collect();
        text += &scene_section(&scene, &rows, sheets);
    }
    text
}

fn introduction(rows: &[Row]) -> String {
    let devices = distinct(rows.iter().map(|row| row.device.as_str())).join("; ");
    let repeats = distinct(
        rows.iter().map(|row| row.repeat.to_string()).collect::<Vec<_>>().iter().map(String::as_str),
    );
    format!(
        "# Run time against error\n\n\
         Device: {devices}. {} interleaved repeats, {} samples. Time is that of a frame: inject and gather.\n\
         Errors are relative RMSE of the indirect irradiance against the path-traced truth, unless a column says\n\
         otherwise. Values are medians over the repeats, with the least and the greatest.\n\n\
         Equal time and equal error: every repeat's Pareto front, straight between its settings in log-log, over the\n\
         front of `{YARDSTICK}` in the same repeat; below 1 is better. Scenes with several cameras: quadratic\n\
         means of the errors, arithmetic means of the times.\n\n\
         {COLUMNS}",
        repeats.len(),
        rows.len(),
    )
}

fn scene_section(scene: &SceneCurves, rows: &[&Row], sheets: &BTreeSet<String>) -> String {
    let name = &scene.scene;
    let file = file_name(name);
    let mut text = format!(
        "\n## {name}\n\n![{name}: error against time]({file}_pareto.svg)\n\n\
         ![{name}: error against the truth, and of the algorithm]({file}_split.svg)\n\n\
         ### {name} at equal time\n\n{}\n### {name} at equal error\n\n{}",
        table(Equal::Time, scene),
        table(Equal::Error, scene),
    );
    if !scene.incomplete.is_empty() {
        let _ = write!(text, "\nLeft out, since a camera lacks them: {}.\n", scene.incomplete.join("; "));
    }
    for camera in &scene.cameras {
        let rows: Vec<&Row> = rows.iter().filter(|row| row.camera == *camera).copied().collect();
        text += &camera_section(scene, camera, &rows, sheets);
    }
    text
}

/// Every setting of every method as one camera sees it.
fn camera_section(scene: &SceneCurves, camera: &str, rows: &[&Row], sheets: &BTreeSet<String>) -> String {
    let size =
        rows.first().map_or_else(String::new, |row| format!("{} x {} pixels. ", row.width, row.height));
    let spp = distinct(
        rows.iter().map(|row| row.truth_spp.to_string()).collect::<Vec<_>>().iter().map(String::as_str),
    );
    let noise = Spread::of(rows.iter().map(|row| row.truth_noise)).unwrap_or_default();
    let noise = if noise.low == noise.high { short(noise.low) } else { range(&noise, short) };
    let file = sheet_file(&scene.scene, camera);
    let sheet = if sheets.contains(&file) {
        format!("![{} from {camera}: every method]({file})", scene.scene)
    } else {
        "Contact sheet not kept.".to_owned()
    };
    let mut text = format!(
        "\n### {} from {camera}\n\n{sheet}\n\n{size}Truth: {} directions per pixel, noise {noise} (relative RMSE).\n\n\
         | method | setting | front | lights | pairs | rays | bytes | prepare | inject | gather | frame \
         | least .. greatest | relative RMSE | least .. greatest | algorithm | relMSE | FLIP | energy | p99 | jump \
         | frame change |\n|---|---|---|{}\n",
        scene.scene,
        spp.join(", "),
        "---:|".repeat(18),
    );
    let mut settings: BTreeMap<((u8, String), &str), Vec<&Row>> = BTreeMap::new();
    for row in rows {
        settings.entry((method_order(&method_name(row)), &row.knob)).or_default().push(row);
    }
    for (((_, method), knob), rows) in settings {
        let on_front = scene
            .methods
            .iter()
            .any(|curve| curve.name == method && curve.front().iter().any(|setting| setting.knob == knob));
        let _ =
            writeln!(text, "| {method} | {knob} | {} | {} |", if on_front { "*" } else { "" }, cells(&rows));
    }
    text
}

fn cells(rows: &[&Row]) -> String {
    let spread = |value: fn(&Row) -> f64| Spread::of(rows.iter().map(|row| value(row))).unwrap_or_default();
    let count = |value: fn(&Row) -> f64| format!("{:.0}", spread(value).median);
    let error = |value: fn(&Row) -> f64| short(spread(value).median);
    let seconds = |value: fn(&Row) -> f64| time(spread(value).median);
    let algorithm = Spread::of(rows.iter().filter_map(|row| row.algorithm_rmse));
    let mark = if rows.iter().all(|row| row.truth_suffices) { "" } else { " †" };
    let cells = [
        count(|row| f64::from(row.lights)),
        count(|row| row.pairs as f64),
        count(|row| row.rays as f64),
        count(|row| row.bytes as f64),
        seconds(|row| row.seconds_prepare),
        seconds(|row| row.seconds_inject),
        seconds(|row| row.seconds_gather),
        seconds(Row::frame_seconds),
        range(&spread(Row::frame_seconds), time),
        error(|row| row.relative_rmse) + mark,
        range(&spread(|row| row.relative_rmse), short),
        algorithm.map_or_else(|| "–".to_owned(), |algorithm| short(algorithm.median)),
        error(|row| row.rel_mse),
        error(|row| row.flip),
        error(|row| row.signed_energy),
        error(|row| row.p99),
        error(|row| row.largest_jump),
        error(|row| row.frame_change),
    ];
    cells.join(" | ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pareto::made_up::row;

    fn rows() -> Vec<Row> {
        let mut rows = Vec::new();
        for repeat in 0..3 {
            let seconds = [0.010, 0.012, 0.011][repeat as usize];
            rows.push(row("box", "front", "vlm", "lights=464", repeat, seconds, 0.2));
            rows.push(row("box", "front", "vlm", "lights=116", repeat, 2.0 * seconds, 0.3));
            rows.push(row("box", "front", "thesis", "range=4.5", repeat, 2.0 * seconds, 0.4));
        }
        rows
    }

    fn line<'a>(text: &'a str, start: &str) -> &'a str {
        text.lines().find(|line| line.starts_with(start)).unwrap_or_else(|| panic!("{start} in\n{text}"))
    }

    #[test]
    fn settings_have_medians_their_spread_and_a_place_on_the_front() {
        let text = summary(&rows(), &BTreeSet::new());
        let best = line(&text, "| vlm | lights=464 | * |");
        assert!(
            best.contains(
                "| 2.75 ms | 8.25 ms | 11.0 ms | 10.0 ms .. 12.0 ms | 0.200 | 0.200 .. 0.200 | – |"
            ),
            "{best}"
        );
        line(&text, "| vlm | lights=116 |  |");
        assert!(text.contains("96 x 96 pixels. Truth: 256 directions per pixel, noise 0.00100"), "{text}");
    }

    #[test]
    fn columns_match_their_header() {
        let text = summary(&rows(), &BTreeSet::new());
        for table in text.split("\n\n").filter(|part| part.starts_with('|')) {
            let columns: Vec<usize> = table.lines().map(|line| line.matches('|').count()).collect();
            assert!(columns.windows(2).all(|pair| pair[0] == pair[1]), "{table}");
        }
    }

    #[test]
    fn the_order_of_the_rows_within_a_scene_does_not_matter() {
        let mut other = rows();
        other.reverse();
        assert_eq!(summary(&rows(), &BTreeSet::new()), summary(&other, &BTreeSet::new()));
    }

    #[test]
    fn doubtful_rows_are_marked_where_they_stand() {
        let mut rows = rows();
        let marks = |rows: &[Row]| summary(rows, &BTreeSet::new()).matches('†').count();
        assert_eq!(marks(&rows), 1, "the explanation");
        rows[1].truth_suffices = false;
        assert!(line(&summary(&rows, &BTreeSet::new()), "| vlm | lights=116 |").contains("0.300 †"));
        assert!(!line(&summary(&rows, &BTreeSet::new()), "| vlm | lights=464 |").contains('†'));
    }

    #[test]
    fn equal_time_and_equal_error_are_compared() {
        let text = summary(&rows(), &BTreeSet::new());
        assert!(text.contains("### box at equal time") && text.contains("### box at equal error"));
        assert!(text.contains("| thesis | not reached | – |"), "{text}");
        assert!(
            text.contains("| 20.0 ms | vlm | 0.200 | 0.200 .. 0.200 | 0.500 | 0.500 .. 0.500 |"),
            "{text}"
        );
    }
}

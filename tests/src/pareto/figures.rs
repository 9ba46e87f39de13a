//! A scene's figures: error against time, and the error against the truth beside that of the algorithm.

use std::path::Path;

use super::curves::{MethodCurve, SceneCurves, Setting, Spread};
use super::names::file_name;
use super::numbers::short;
use super::row::Row;
use crate::plot::{Axis, Curve, Figure, Line, Marker, PlotError, Point};

/// The split figure shows algorithm errors down to this share of the least model error: exact methods err by rounding
/// alone, and would press everything else together.
const SPLIT_DEPTH: f64 = 1e-2;

/// Writes `SCENE_pareto` and `SCENE_split` into a folder, each as SVG and PNG.
///
/// # Errors
/// [`PlotError`] if one cannot be drawn or written.
pub fn write(folder: &Path, scene: &SceneCurves, rows: &[Row]) -> Result<(), PlotError> {
    let file = file_name(&scene.scene);
    let conditions = conditions(scene, rows);
    pareto(scene, &conditions).write(&folder.join(format!("{file}_pareto")))?;
    split(scene, &conditions).write(&folder.join(format!("{file}_split")))
}

fn conditions(scene: &SceneCurves, rows: &[Row]) -> String {
    let Some(row) = rows.iter().find(|row| row.scene == scene.scene) else { return String::new() };
    let cameras = match scene.cameras.as_slice() {
        [one] => one.clone(),
        several => format!("{} cameras (quadratic mean of errors, mean of times)", several.len()),
    };
    format!("{} x {} pixels, {cameras}, {}", row.width, row.height, row.device)
}

fn point(setting: &Setting, error: &Spread) -> Point {
    let range = |spread: &Spread| (spread.low < spread.high).then_some((spread.low, spread.high));
    Point {
        x: setting.seconds.median,
        y: error.median,
        x_spread: range(&setting.seconds),
        y_spread: range(error),
    }
}

/// All settings, pale, and each method's front in front of them.
fn pareto(scene: &SceneCurves, conditions: &str) -> Figure {
    let (timed, untimed): (Vec<_>, Vec<_>) = scene.methods.iter().partition(|method| takes_time(method));
    let mut curves: Vec<Curve> = timed.iter().map(|method| all_settings(method)).collect();
    for method in &timed {
        let points = method.front().into_iter().map(|setting| point(setting, &setting.error)).collect();
        curves.push(Curve::new(&method.name, method.series, points));
    }
    curves.extend(untimed.iter().filter_map(|method| level(&method.name, method, time_range(scene)?)));
    let doubtful: Vec<Curve> = timed.iter().filter_map(|method| doubtful_settings(method)).collect();
    let hollow = if doubtful.is_empty() { "" } else { "; hollow: the truth is too noisy to tell" };
    curves.extend(doubtful);
    Figure {
        title: format!("{}: error against time", scene.scene),
        subtitle: format!(
            "{conditions}\nLines: Pareto fronts; pale: all other settings; bars: least to greatest{hollow}"
        ),
        x: Axis::log(TIME),
        y: Axis::log("relative RMSE against the path-traced truth"),
        curves,
    }
}

const TIME: &str = "time of a frame (s)";

/// True if any setting has a place on a logarithmic axis of time.
fn takes_time(method: &MethodCurve) -> bool {
    method.settings.iter().any(|setting| setting.seconds.median > 0.0)
}

fn all_settings(method: &MethodCurve) -> Curve {
    let points = method.settings.iter().map(|s| Point::new(s.seconds.median, s.error.median)).collect();
    Curve { line: Line::Hidden, faint: true, ..Curve::new("", method.series, points) }
}

/// The settings on the front that the truth does not suffice for.
fn doubtful_settings(method: &MethodCurve) -> Option<Curve> {
    let doubtful = method.front().into_iter().filter(|setting| !setting.suffices);
    let points: Vec<Point> = doubtful.map(|s| Point::new(s.seconds.median, s.error.median)).collect();
    let curve = Curve { line: Line::Hidden, marker: Marker::Hollow, ..Curve::new("", method.series, points) };
    (!curve.points.is_empty()).then_some(curve)
}

/// The least error of a method that takes no time, across the figure: such as no indirect light at all.
fn level(name: &str, method: &MethodCurve, (low, high): (f64, f64)) -> Option<Curve> {
    let error = method.settings.iter().map(|setting| setting.error.median).min_by(f64::total_cmp)?;
    let points = vec![Point::new(low, error), Point::new(high, error)];
    let name = format!("{name} (no time)");
    Some(Curve { line: Line::Dashed, marker: Marker::Hidden, ..Curve::new(&name, method.series, points) })
}

/// From the fastest to the slowest setting.
fn time_range(scene: &SceneCurves) -> Option<(f64, f64)> {
    let settings = scene.methods.iter().flat_map(|method| &method.settings);
    positive_range(settings.flat_map(|setting| [setting.seconds.low, setting.seconds.high]))
}

fn positive_range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|value| *value > 0.0).fold(None, |range: Option<(f64, f64)>, value| {
        let (low, high) = range.unwrap_or((value, value));
        Some((low.min(value), high.max(value)))
    })
}

/// The front's settings: error against the truth, and error against the exact sum over the same lights.
fn split(scene: &SceneCurves, conditions: &str) -> Figure {
    let floor = split_floor(scene);
    let mut curves = Vec::new();
    for method in &scene.methods {
        let front = method.front();
        let model = format!("{}: against the truth", method.name);
        if takes_time(method) {
            let points = front.iter().map(|setting| point(setting, &setting.error)).collect();
            curves.push(Curve::new(&model, method.series, points));
        } else {
            curves.extend(time_range(scene).and_then(|range| level(&model, method, range)));
        }
        curves.extend(algorithm(method, &front, floor));
    }
    Figure {
        title: format!("{}: error against the truth, and of the algorithm", scene.scene),
        subtitle: format!(
            "{conditions}\nAlgorithm: against the exact sum over the same lights, without occlusion; its error and the \
             missing occlusion can cancel"
        ),
        x: Axis::log(TIME),
        y: Axis::log("relative RMSE"),
        curves,
    }
}

/// What errs by less than the figure shows, says so in the legend.
fn algorithm(method: &MethodCurve, front: &[&Setting], floor: f64) -> Option<Curve> {
    let points = front.iter().filter_map(|setting| Some(point(setting, &setting.algorithm?)));
    let (below, shown): (Vec<Point>, Vec<Point>) = points.partition(|point| point.y < floor);
    let name = match (below.len(), shown.len()) {
        (0, 0) => return None,
        (0, _) => format!("{}: algorithm", method.name),
        (_, 0) => format!("{}: algorithm < {}", method.name, short(floor)),
        _ => format!("{}: algorithm, or < {}", method.name, short(floor)),
    };
    Some(Curve { line: Line::Dashed, marker: Marker::Hollow, ..Curve::new(&name, method.series, shown) })
}

fn split_floor(scene: &SceneCurves) -> f64 {
    let settings = scene.methods.iter().flat_map(MethodCurve::front);
    positive_range(settings.map(|setting| setting.error.median)).map_or(0.0, |(least, _)| SPLIT_DEPTH * least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pareto::curves::scene_curves;
    use crate::pareto::made_up::row;

    fn scene() -> SceneCurves {
        let mut rows = Vec::new();
        for (knob, seconds, error) in [("a", 0.01, 0.4), ("b", 0.1, 0.2), ("c", 1.0, 0.3)] {
            let mut row = row("s", "c", "vlm", knob, 0, seconds, error);
            row.algorithm_rmse = Some(if knob == "a" { 0.05 } else { 1e-7 });
            rows.push(row);
        }
        rows.push(row("s", "c", "direct", "", 0, 0.001, 1.0));
        scene_curves(&rows).remove(0)
    }

    #[test]
    fn fronts_stand_before_all_settings() {
        let figure = pareto(&scene(), "");
        let of_vlm: Vec<(&str, usize, bool)> = figure
            .curves
            .iter()
            .filter(|curve| curve.series == 1)
            .map(|curve| (curve.name.as_str(), curve.points.len(), curve.faint))
            .collect();
        assert_eq!(of_vlm, [("", 3, true), ("vlm", 2, false)], "setting c is no faster and no better than b");
    }

    #[test]
    fn what_takes_no_time_is_a_level() {
        let rows = [row("s", "c", "direct", "", 0, 0.0, 1.0), row("s", "c", "vlm", "", 0, 0.5, 0.1)];
        let figure = pareto(&scene_curves(&rows)[0], "");
        let direct = figure.curves.iter().find(|curve| curve.name == "direct (no time)").unwrap();
        assert_eq!(direct.points, [Point::new(0.5, 1.0); 2]);
    }

    #[test]
    fn doubtful_settings_are_hollow() {
        let mut rows = [row("s", "c", "brute", "", 0, 0.1, 0.2), row("s", "c", "vlm", "", 0, 0.5, 0.1)];
        let hollow = |rows: &[Row]| -> Vec<usize> {
            let curves = pareto(&scene_curves(rows)[0], "").curves;
            curves.iter().filter(|curve| curve.marker == Marker::Hollow).map(|curve| curve.series).collect()
        };
        assert_eq!(hollow(&rows), [0; 0]);
        rows[0].truth_suffices = false;
        assert_eq!(hollow(&rows), [2]);
    }

    #[test]
    fn the_split_shows_the_algorithm_where_there_is_one() {
        let figure = split(&scene(), "");
        let names: Vec<&str> = figure.curves.iter().map(|curve| curve.name.as_str()).collect();
        assert_eq!(
            names,
            ["vlm: against the truth", "vlm: algorithm, or < 0.00200", "direct: against the truth"]
        );
        assert_eq!(figure.curves[1].points, [Point::new(0.01, 0.05)], "rounding lies below the figure");
    }

    #[test]
    fn both_figures_are_written() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), &scene(), &[]).unwrap();
        for name in ["s_pareto.svg", "s_pareto.png", "s_split.svg", "s_split.png"] {
            assert!(folder.path().join(name).is_file(), "{name}");
        }
    }
}

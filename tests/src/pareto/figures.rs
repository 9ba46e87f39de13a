//! A scene's figures: error against time, and the error split into algorithm and model.

use std::path::Path;

use super::curves::{MethodCurve, SceneCurves, Setting, Spread};
use super::names::file_name;
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
        several => format!("{} cameras (geometric mean)", several.len()),
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
    let all = |method: &MethodCurve| Curve {
        line: Line::Hidden,
        faint: true,
        ..Curve::new(
            "",
            method.series,
            method.settings.iter().map(|s| Point::new(s.seconds.median, s.error.median)).collect(),
        )
    };
    let front = |method: &MethodCurve| {
        let points = method.front().into_iter().map(|setting| point(setting, &setting.error)).collect();
        Curve::new(&method.name, method.series, points)
    };
    let methods = &scene.methods;
    Figure {
        title: format!("{}: error against time", scene.scene),
        subtitle: format!(
            "{conditions}. Lines: Pareto fronts; pale: all other settings; bars: least to greatest"
        ),
        x: Axis::log("time of a frame (s)"),
        y: Axis::log("relative RMSE against the path-traced truth"),
        curves: methods.iter().map(all).chain(methods.iter().map(front)).collect(),
    }
}

/// The front's settings: error against the truth, and error against the exact sum over the same lights.
fn split(scene: &SceneCurves, conditions: &str) -> Figure {
    let mut curves = Vec::new();
    for method in &scene.methods {
        let front = method.front();
        let model = front.iter().map(|setting| point(setting, &setting.error)).collect();
        curves.push(Curve::new(&format!("{}: model", method.name), method.series, model));
        let algorithm = |setting: &&Setting| setting.algorithm.map(|error| point(setting, &error));
        let algorithm: Vec<Point> = front.iter().filter_map(algorithm).collect();
        if !algorithm.is_empty() {
            curves.push(Curve {
                line: Line::Dashed,
                marker: Marker::Hollow,
                ..Curve::new(&format!("{}: algorithm", method.name), method.series, algorithm)
            });
        }
    }
    let y = Axis::log("relative RMSE");
    Figure {
        title: format!("{}: error of the algorithm and of the model", scene.scene),
        subtitle: format!(
            "{conditions}. Model: against the truth; algorithm: against the exact sum of the same lights"
        ),
        x: Axis::log("time of a frame (s)"),
        y: Axis { range: split_range(scene), ..y },
        curves,
    }
}

fn split_range(scene: &SceneCurves) -> Option<(f64, f64)> {
    let settings = || scene.methods.iter().flat_map(MethodCurve::front);
    let positive = |values: &mut dyn Iterator<Item = f64>| -> Option<(f64, f64)> {
        values.filter(|value| *value > 0.0).fold(None, |range: Option<(f64, f64)>, value| {
            let (low, high) = range.unwrap_or((value, value));
            Some((low.min(value), high.max(value)))
        })
    };
    let (least_model, most_model) = positive(&mut settings().flat_map(|s| [s.error.low, s.error.high]))?;
    let algorithm = settings().filter_map(|s| s.algorithm).flat_map(|error| [error.low, error.high]);
    let (least, most) = positive(&mut algorithm.into_iter()).unwrap_or((least_model, most_model));
    let low = least.min(least_model).max(SPLIT_DEPTH * least_model);
    Some((0.8 * low, 1.25 * most.max(most_model)))
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
    fn the_split_shows_the_algorithm_where_there_is_one() {
        let figure = split(&scene(), "");
        let names: Vec<&str> = figure.curves.iter().map(|curve| curve.name.as_str()).collect();
        assert_eq!(names, ["direct: model", "vlm: model", "vlm: algorithm"]);
        let (low, high) = figure.y.range.unwrap();
        assert!(low > 1e-3 && low < 0.05 && high > 1.0, "rounding lies below the figure: {low} {high}");
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

//! Figures: seconds of the most expensive stages, and peak memory, against triangles.

use std::path::Path;

use super::BakeBenchError;
use super::measure::ROOM;
use super::sample::{GLTFPACK, PHASES, PROCESS, Run, VLM};
use super::table::{Column, Value, columns};
use crate::plot::{Axis, Curve, Figure, Line, Marker, Point, SERIES};

/// Writes `bake_seconds` and `bake_memory`.
pub fn write(folder: &Path, run: &Run) -> Result<(), BakeBenchError> {
    seconds(run).write(&folder.join("bake_seconds"))?;
    memory(run).write(&folder.join("bake_memory"))?;
    Ok(())
}

fn seconds(run: &Run) -> Figure {
    let all = columns();
    let whole =
        |tool: &str| all.iter().find(|c| c.tool == tool && matches!(c.value, Value::Seconds(PROCESS)));
    let mut phases: Vec<&Column> =
        all.iter().filter(|c| PHASES.iter().any(|phase| c.tool == VLM && c.name == *phase)).collect();
    // Descending by the time for the largest room.
    phases.sort_by(|a, b| largest(b, run).total_cmp(&largest(a, run)));
    phases.truncate(SERIES - 2);
    let mut curves = Vec::new();
    for (series, column) in whole(VLM).into_iter().chain(whole(GLTFPACK)).chain(phases).enumerate() {
        let name = match (column.tool, series) {
            (GLTFPACK, _) => "gltfpack -si 0.1, whole process",
            (_, 0) => "vlm bake, whole process",
            _ => &column.name,
        };
        let curve = room_curve(name, series, column, run);
        if curve.points.is_empty() {
            continue;
        }
        curves.push(Curve { faint: series > 1, ..curve });
        if series < 2 {
            curves.extend(real_scenes(series, column, run));
        }
    }
    Figure {
        title: "Cost of a bake".to_owned(),
        subtitle: subtitle(run, "the six most expensive phases; hollow: real scenes"),
        x: Axis::log("triangles"),
        y: Axis::log("seconds"),
        curves,
    }
}

fn memory(run: &Run) -> Figure {
    let all = columns();
    let peak = all.iter().find(|column| matches!(column.value, Value::Peak));
    let curves = |column: &Column| [Some(room_curve("room", 0, column, run)), real_scenes(0, column, run)];
    Figure {
        title: "Peak memory of a bake".to_owned(),
        subtitle: subtitle(run, "whole process; hollow: real scenes, textures included"),
        x: Axis::log("triangles"),
        y: Axis::log("bytes"),
        curves: peak.map_or_else(Vec::new, |column| curves(column).into_iter().flatten().collect()),
    }
}

fn subtitle(run: &Run, more: &str) -> String {
    format!("{}, {} threads, preset {}; {more}", run.device, run.threads, run.preset)
}

fn largest(column: &Column, run: &Run) -> f64 {
    column.points(run).last().map_or(0.0, |(_, spread)| spread.median)
}

fn point((x, spread): (f64, crate::pareto::curves::Spread)) -> Point {
    Point { y_spread: Some((spread.low, spread.high)), ..Point::new(x, spread.median) }
}

fn room_curve(name: &str, series: usize, column: &Column, run: &Run) -> Curve {
    Curve::new(name, series, column.points(run).into_iter().map(point).collect())
}

/// Points that no line joins; `None` without any.
fn real_scenes(series: usize, column: &Column, run: &Run) -> Option<Curve> {
    let mut inputs: Vec<(&str, u64)> =
        run.samples.iter().filter(|s| s.input != ROOM).map(|s| (s.input.as_str(), s.triangles)).collect();
    inputs.sort_unstable();
    inputs.dedup();
    let spreads = inputs.into_iter().filter_map(|(i, t)| Some((t as f64, column.spread(run, i, t)?)));
    let points: Vec<Point> = spreads.map(point).collect();
    let curve = Curve { line: Line::Hidden, marker: Marker::Hollow, ..Curve::new("", series, points) };
    (!curve.points.is_empty()).then_some(curve)
}

#[cfg(test)]
mod tests {
    use super::super::table::tests::made_up;
    use super::*;

    #[test]
    fn curves_are_of_the_rooms_and_real_scenes_stand_alone() {
        let figure = seconds(&made_up());
        let names: Vec<&str> = figure.curves.iter().map(|curve| curve.name.as_str()).collect();
        // The fixture has two phases; those without a time have no curve.
        let expected = ["vlm bake, whole process", "", "gltfpack -si 0.1, whole process", "decimate", "load"];
        assert_eq!(names, expected);
        assert_eq!(figure.curves[3].points.len(), 4);
        assert_eq!(figure.curves[1].points[0].x, 777.0);
    }

    #[test]
    fn memory_is_in_bytes() {
        let figure = memory(&made_up());
        assert_eq!(figure.curves[0].points[3].y, 1e9);
        let nothing = memory(&Run::default());
        assert!(nothing.curves.iter().all(|curve| curve.points.is_empty()), "the negative control");
    }
}

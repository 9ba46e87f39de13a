//! A figure per scene: build time against lights x cells.

use std::collections::BTreeSet;
use std::path::Path;

use super::GridBenchError;
use super::row::{BUILDERS, Row, SCATTER, THESIS};
use super::table::seconds;
use crate::pareto::names::file_name;
use crate::plot::{Axis, Curve, Figure, Line, Marker, Point};

/// Writes the figure of every scene.
pub fn write(folder: &Path, rows: &[Row]) -> Result<(), GridBenchError> {
    let scenes: BTreeSet<&str> = rows.iter().map(|row| row.scene.as_str()).collect();
    for scene in scenes {
        let rows: Vec<Row> = rows.iter().filter(|row| row.scene == scene).cloned().collect();
        figure(scene, &rows).write(&folder.join(file_name(scene) + "_grid"))?;
    }
    Ok(())
}

fn figure(scene: &str, rows: &[Row]) -> Figure {
    let cells: BTreeSet<u32> = rows.iter().map(|row| row.cells_per_axis).collect();
    let curve = |builder: &str, (series, &cells): (usize, &u32)| {
        let (line, marker) = match builder {
            THESIS => (Line::Dashed, Marker::Hollow),
            SCATTER => (Line::Solid, Marker::Hollow),
            _ => (Line::Solid, Marker::Filled),
        };
        let name = format!("{builder}, {cells}^3 cells");
        Curve { line, marker, ..Curve::new(&name, series, points(rows, builder, cells)) }
    };
    let curves = BUILDERS.map(|builder| cells.iter().enumerate().map(move |c| curve(builder, c)));
    Figure {
        title: format!("Building the grid: {scene}"),
        subtitle: rows.first().map_or_else(String::new, |row| {
            format!("{}, {} threads; lights reach {} radii", row.device, row.threads, row.range)
        }),
        x: Axis::log("lights x cells"),
        y: Axis::log("build time (s)"),
        curves: curves.into_iter().flatten().collect(),
    }
}

fn points(rows: &[Row], builder: &str, cells: u32) -> Vec<Point> {
    let lights: BTreeSet<u64> = rows.iter().map(|row| row.lights).collect();
    let point = |lights: u64| {
        let seconds = seconds(rows, builder, lights, cells)?;
        let x = lights as f64 * f64::from(cells).powi(3);
        Some(Point { y_spread: Some((seconds.low, seconds.high)), ..Point::new(x, seconds.median) })
    };
    lights.into_iter().filter_map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::super::table::tests::made_up;
    use super::*;

    #[test]
    fn every_build_has_a_curve_and_every_median_a_point() {
        let figure = figure("room", &made_up());
        let names: Vec<&str> = figure.curves.iter().map(|curve| curve.name.as_str()).collect();
        assert_eq!(
            names,
            [
                "thesis, 16^3 cells",
                "thesis, 32^3 cells",
                "scatter, 16^3 cells",
                "scatter, 32^3 cells",
                "scatter to surface, 16^3 cells",
                "scatter to surface, 32^3 cells"
            ]
        );
        let counts: Vec<usize> = figure.curves.iter().map(|curve| curve.points.len()).collect();
        assert_eq!(counts, [2, 1, 2, 2, 2, 2], "what was not run has no point");
        assert_eq!(figure.curves[3].points[1].x, 1e4 * 32f64.powi(3));
        assert!((figure.curves[3].points[1].y - 0.02).abs() < 1e-12);
    }
}

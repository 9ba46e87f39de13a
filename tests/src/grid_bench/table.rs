//! Tables of grid builds, after the thesis' table 5.2.

use std::collections::BTreeSet;

use super::measure::GridOptions;
use super::row::{BUILDERS, Row, THESIS};
use crate::pareto::curves::Spread;
use crate::pareto::numbers::{short, time};
use crate::slope::exponent;
use crate::text::{bytes, grouped, table};

/// Everything in Markdown.
#[must_use]
pub fn summary(rows: &[Row], options: &GridOptions) -> String {
    let mut text = "# Build time of the grid\n\n".to_owned();
    if let Some(row) = rows.first() {
        text += &format!(
            "{}, {} threads; medians of {} interleaved repeats; a light reaches {} of its radii.\n\
             `thesis` tests every cell against every light; `scatter` lets each light visit the rows of cells that it may reach; \
             `scatter to surface` does so for cells that hold surface, and finds these. All keep the first {} lights of a cell. \
             Lists were compared with the thesis', cell by cell, and are the same. \
             For scale: Aquotte 2017, table 5.2, needs 12.5 s for 100^3 cells and 100,000 lights on a graphics card.\n",
            row.device,
            row.threads,
            repeats(rows),
            row.range,
            options.list
        );
    }
    for scene in distinct(rows.iter().map(|row| row.scene.clone())) {
        let rows: Vec<Row> = rows.iter().filter(|row| row.scene == scene).cloned().collect();
        text += &scene_tables(&scene, &rows, options.limit);
    }
    text
}

fn repeats(rows: &[Row]) -> usize {
    rows.iter().map(|row| row.repeat).collect::<BTreeSet<_>>().len()
}

/// In the order of their first.
fn distinct<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

fn scene_tables(scene: &str, rows: &[Row], limit: f64) -> String {
    let lights: BTreeSet<u64> = rows.iter().map(|row| row.lights).collect();
    let cells: BTreeSet<u32> = rows.iter().map(|row| row.cells_per_axis).collect();
    let from = if scene == "room" {
        "the triangles of the room, divided into so many"
    } else {
        "baked with such a budget"
    };
    let mut text = format!(
        "\n## {scene}\n\nSurface: {} triangles. Lights: {from}.\n\n",
        grouped(rows.first().map_or(0, |row| row.triangles))
    );
    let pairs = || lights.iter().flat_map(|&l| cells.iter().map(move |&c| (l, c)));
    let header = ["lights", "cells", "build", "tests", "fewer", "time", "faster"].map(str::to_owned);
    let lines = pairs().flat_map(|(l, c)| BUILDERS.map(|builder| compared(rows, builder, l, c)));
    text += &table(&header, &lines.collect::<Vec<_>>());
    if rows.iter().any(|row| seconds(rows, THESIS, row.lights, row.cells_per_axis).is_none()) {
        text += &format!(
            "\n*not run*: at its speed in this run, tests a second, the thesis' build would take longer than {} s.\n",
            short(limit)
        );
    }
    text += &spread_line(rows);
    text += "\nExponent of the time by number of lights:\n\n";
    let header: Vec<String> =
        std::iter::once("build".to_owned()).chain(cells.iter().map(|c| format!("{c}^3 cells"))).collect();
    let slopes = BUILDERS.map(|builder| {
        let of = |&c: &u32| {
            slope(lights.iter().filter_map(|&l| Some((l as f64, seconds(rows, builder, l, c)?.median))))
        };
        std::iter::once(builder.to_owned()).chain(cells.iter().map(of)).collect()
    });
    text += &table(&header, &slopes);
    text += "\nWhat is stored:\n\n";
    text + &stored(rows, &lights, &cells)
}

fn slope(points: impl Iterator<Item = (f64, f64)>) -> String {
    exponent(points).map_or_else(|| "-".to_owned(), |p| format!("{p:.2}"))
}

/// Time of one build over its repeats.
pub(super) fn seconds(rows: &[Row], builder: &str, lights: u64, cells: u32) -> Option<Spread> {
    let of =
        rows.iter().filter(|r| (r.builder.as_str(), r.lights, r.cells_per_axis) == (builder, lights, cells));
    Spread::of(of.map(|row| row.seconds))
}

/// A build's tests and median time, and how many times less than the thesis' they are.
fn compared(rows: &[Row], builder: &str, lights: u64, cells: u32) -> Vec<String> {
    let row = first(rows, builder, lights, cells);
    let median = |builder: &str| seconds(rows, builder, lights, cells).map(|spread| spread.median);
    let all = lights * u64::from(cells).pow(3);
    let tests = row.map(|row| row.tests);
    let fewer = tests.filter(|_| builder != THESIS).map(|tests| all as f64 / tests.max(1) as f64);
    let faster = median(THESIS).zip(median(builder)).filter(|_| builder != THESIS).map(|(a, b)| a / b);
    let times = |ratio: Option<f64>| ratio.map_or_else(|| "-".to_owned(), |ratio| short(ratio) + " x");
    vec![
        grouped(lights),
        format!("{cells}^3"),
        builder.to_owned(),
        grouped(tests.unwrap_or(all)),
        times(fewer),
        median(builder).map_or_else(|| "*not run*".to_owned(), time),
        times(faster),
    ]
}

/// The first sample of a build.
fn first<'a>(rows: &'a [Row], builder: &str, lights: u64, cells: u32) -> Option<&'a Row> {
    rows.iter().find(|row| (row.builder.as_str(), row.lights, row.cells_per_axis) == (builder, lights, cells))
}

/// How far repeats differ: the greatest over the least time of a build.
fn spread_line(rows: &[Row]) -> String {
    let spreads = rows.iter().filter_map(|r| seconds(rows, &r.builder, r.lights, r.cells_per_axis));
    let worst = Spread::of(spreads.map(|s| s.high / s.low));
    worst.map_or_else(String::new, |worst| {
        format!(
            "\nSlowest over fastest repeat of a build: {} in the median, {} at worst.\n",
            short(worst.median),
            short(worst.high)
        )
    })
}

fn stored(rows: &[Row], lights: &BTreeSet<u64>, cells: &BTreeSet<u32>) -> String {
    let header = ["lights", "cells", "build", "stored cells", "entries", "a stored cell", "dropped", "bytes"];
    let mut lines = Vec::new();
    for (&l, &c) in lights.iter().flat_map(|l| cells.iter().map(move |c| (l, c))) {
        lines.extend(BUILDERS.iter().filter_map(|builder| first(rows, builder, l, c)).map(stored_line));
    }
    table(&header.map(str::to_owned), &lines)
}

fn stored_line(row: &Row) -> Vec<String> {
    vec![
        grouped(row.lights),
        format!("{}^3", row.cells_per_axis),
        row.builder.clone(),
        grouped(row.stored_cells),
        grouped(row.entries),
        short(row.entries as f64 / row.stored_cells.max(1) as f64),
        grouped(row.dropped),
        bytes(row.bytes),
    ]
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::row::{SCATTER, SURFACE};
    use super::*;

    /// Scattering grows with the lights, the thesis' with lights x cells; repeats differ by 10 %; the largest was not run.
    pub fn made_up() -> Vec<Row> {
        let mut rows = Vec::new();
        for (lights, cells) in [(1_000u64, 16u32), (1_000, 32), (10_000, 16), (10_000, 32)] {
            let all = lights * u64::from(cells).pow(3);
            for (builder, tests, seconds) in [
                (THESIS, all, 4e-9 * all as f64),
                (SCATTER, 100 * lights, 2e-6 * lights as f64),
                (SURFACE, 10 * lights, 1e-6 * lights as f64),
            ] {
                if builder == THESIS && lights * u64::from(cells) > 200_000 {
                    continue;
                }
                rows.extend([1.0, 0.9, 1.1].into_iter().zip(0..).map(|(factor, repeat)| Row {
                    scene: "room".to_owned(),
                    triangles: 12_345,
                    lights,
                    cells_per_axis: cells,
                    range: 4.5,
                    builder: builder.to_owned(),
                    repeat,
                    seconds: seconds * factor,
                    tests,
                    cells: u64::from(cells).pow(3),
                    stored_cells: 500,
                    entries: 40 * lights,
                    bytes: 1_500_000,
                    threads: 2,
                    device: "made up".to_owned(),
                    ..Row::default()
                }));
            }
        }
        rows
    }

    #[test]
    fn tables_hold_medians_ratios_and_slopes() {
        let text = summary(&made_up(), &GridOptions::default());
        for line in [
            "| 1,000 | 16^3 | thesis | 4,096,000 | - | 16.4 ms | - |",
            "| 1,000 | 16^3 | scatter | 100,000 | 41.0 x | 2.00 ms | 8.19 x |",
            "| 1,000 | 16^3 | scatter to surface | 10,000 | 410 x | 1.00 ms | 16.4 x |",
            "| 10,000 | 32^3 | thesis | 327,680,000 | - | *not run* | - |",
            "| 10,000 | 32^3 | scatter | 1,000,000 | 328 x | 20.0 ms | - |",
            "| scatter | 1.00 | 1.00 |",
            "| thesis | 1.00 | - |",
            "| 1,000 | 16^3 | scatter | 500 | 40,000 | 80.0 | 0 | 1.5 MB |",
            "longer than 20.0 s",
            "1.22 in the median, 1.22 at worst",
            "medians of 3 interleaved repeats",
            "Surface: 12,345 triangles",
        ] {
            assert!(text.contains(line), "{line}\nis not in\n{text}");
        }
    }

    #[test]
    fn without_anything_left_out_nothing_is_said() {
        let rows: Vec<Row> = made_up().into_iter().filter(|row| row.cells_per_axis == 16).collect();
        let text = summary(&rows, &GridOptions::default());
        assert!(!text.contains("not run"), "the negative control: {text}");
    }
}

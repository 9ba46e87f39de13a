//! Tables of grid builds, after the thesis' table 5.2.

use std::collections::BTreeSet;

use super::measure::GridOptions;
use super::row::{OURS, Row, THESIS};
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
             Cells are counted along the longest axis; `ours` are cubes, `thesis` divides every axis alike.\n\
             `ours` scatters lights into the cells that hold surface, and finds these; `thesis` tests every cell against \
             every light, with lists of {}. \
             Both on this processor. For scale: Aquotte 2017, table 5.2, needs 12.5 s for 100^3 cells and 100,000 \
             lights on a graphics card.\n",
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
    let header = |first: &str| -> Vec<String> {
        std::iter::once(first.to_owned()).chain(cells.iter().map(|c| format!("{c} per axis"))).collect()
    };
    let times = lights.iter().map(|&l| {
        let cell = |&c: &u32| times(rows, l, c);
        std::iter::once(grouped(l)).chain(cells.iter().map(cell)).collect()
    });
    let counts =
        std::iter::once("cells: ours; thesis".to_owned()).chain(cells.iter().map(|&c| counts(rows, c)));
    let lines: Vec<Vec<String>> = std::iter::once(counts.collect()).chain(times).collect();
    text += &table(&header("lights: ours, thesis (ratio)"), &lines);
    if rows.iter().any(|row| seconds(rows, THESIS, row.lights, row.cells_per_axis).is_none()) {
        text += &format!(
            "\n*not run*: at its speed in this run, tests a second, the thesis' build would take longer than {} s.\n",
            short(limit)
        );
    }
    text += &spread_line(rows);
    text += "\nExponent of the time by number of lights:\n\n";
    let slopes = [OURS, THESIS].map(|builder| {
        let of = |&c: &u32| {
            slope(lights.iter().filter_map(|&l| Some((l as f64, seconds(rows, builder, l, c)?.median))))
        };
        std::iter::once(builder.to_owned()).chain(cells.iter().map(of)).collect()
    });
    text += &table(&header("build"), &slopes);
    text += "\nWhat is stored:\n\n";
    text + &stored(rows, &lights, &cells)
}

fn slope(points: impl Iterator<Item = (f64, f64)>) -> String {
    exponent(points).map_or_else(|| "-".to_owned(), |p| format!("{p:.2}"))
}

/// Cells of both builds' boxes: ours are cubes, and so fewer along the shorter axes.
fn counts(rows: &[Row], cells: u32) -> String {
    let of = |builder: &str| {
        let of_builder = rows.iter().filter(|row| row.builder == builder && row.cells_per_axis == cells);
        let found: BTreeSet<u64> = of_builder.map(|row| row.cells).collect();
        match (found.first(), found.last()) {
            (Some(least), Some(most)) if least < most => format!("{} to {}", grouped(*least), grouped(*most)),
            (Some(count), _) => grouped(*count),
            _ => "*not run*".to_owned(),
        }
    };
    format!("{}; {}", of(OURS), of(THESIS))
}

/// Time of one build over its repeats.
pub(super) fn seconds(rows: &[Row], builder: &str, lights: u64, cells: u32) -> Option<Spread> {
    let of =
        rows.iter().filter(|r| (r.builder.as_str(), r.lights, r.cells_per_axis) == (builder, lights, cells));
    Spread::of(of.map(|row| row.seconds))
}

fn times(rows: &[Row], lights: u64, cells: u32) -> String {
    let Some(ours) = seconds(rows, OURS, lights, cells) else { return "-".to_owned() };
    match seconds(rows, THESIS, lights, cells) {
        Some(thesis) => format!(
            "{}, {} ({} x)",
            time(ours.median),
            time(thesis.median),
            short(thesis.median / ours.median)
        ),
        None => format!("{}, *not run*", time(ours.median)),
    }
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
    let header = [
        "lights",
        "per axis",
        "build",
        "cells",
        "stored cells",
        "entries",
        "a stored cell",
        "dropped",
        "bytes",
    ];
    let mut lines = Vec::new();
    for (&l, &c) in lights.iter().flat_map(|l| cells.iter().map(move |c| (l, c))) {
        for builder in [OURS, THESIS] {
            let found = rows
                .iter()
                .find(|row| (row.builder.as_str(), row.lights, row.cells_per_axis) == (builder, l, c));
            lines.extend(found.map(stored_line));
        }
    }
    table(&header.map(str::to_owned), &lines)
}

fn stored_line(row: &Row) -> Vec<String> {
    vec![
        grouped(row.lights),
        row.cells_per_axis.to_string(),
        row.builder.clone(),
        grouped(row.cells),
        grouped(row.stored_cells),
        grouped(row.entries),
        short(row.entries as f64 / row.stored_cells.max(1) as f64),
        grouped(row.dropped),
        bytes(row.bytes),
    ]
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Ours grows with the lights, the thesis' with lights x cells; repeats differ by 10 %; the largest was not run.
    pub fn made_up() -> Vec<Row> {
        let mut rows = Vec::new();
        for (lights, cells) in [(1_000u64, 16u32), (1_000, 32), (10_000, 16), (10_000, 32)] {
            for (builder, seconds) in
                [(OURS, 2e-6 * lights as f64), (THESIS, 4e-9 * lights as f64 * f64::from(cells).powi(3))]
            {
                if builder == THESIS && lights * u64::from(cells) > 200_000 {
                    continue;
                }
                rows.extend([1.0, 0.9, 1.1].into_iter().zip(0..).map(|(factor, repeat)| Row {
                    scene: "room".to_owned(),
                    triangles: 12_345,
                    lights,
                    cells_per_axis: cells,
                    range: 8.0,
                    builder: builder.to_owned(),
                    repeat,
                    seconds: seconds * factor,
                    // A room half as high as wide, where cells are cubes.
                    cells: u64::from(cells).pow(3) / if builder == OURS { 2 } else { 1 },
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
            "| 1,000 | 2.00 ms, 16.4 ms (8.19 x) | 2.00 ms, 131 ms (65.5 x) |",
            "| 10,000 | 20.0 ms, 164 ms (8.19 x) | 20.0 ms, *not run* |",
            "| ours | 1.00 | 1.00 |",
            "| thesis | 1.00 | - |",
            "| cells: ours; thesis | 2,048; 4,096 | 16,384; 32,768 |",
            "| 1,000 | 16 | ours | 2,048 | 500 | 40,000 | 80.0 | 0 | 1.5 MB |",
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

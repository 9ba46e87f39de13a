//! The table of bakes: seconds by stage, peak memory, and their exponents.

use std::collections::BTreeSet;

use super::measure::ROOM;
use super::sample::{BAKE, GLTFPACK, PHASES, PROCESS, Run, Sample, VLM};
use crate::pareto::curves::Spread;
use crate::pareto::numbers::short;
use crate::slope::exponent;
use crate::text::{bytes, grouped, table};

/// From so many triangles on, the presets `draft` and `game` give a scene the most lights that they give: 80,000, and a room
/// of about 100,000 triangles may have a few less.
const MANY: u64 = 80_000;

/// A column: its head, and the values of one sample.
pub(super) struct Column {
    pub(super) name: String,
    pub(super) tool: &'static str,
    pub(super) value: Value,
}

/// What of a sample a column shows.
#[derive(Clone, Copy)]
pub(super) enum Value {
    Seconds(&'static str),
    Peak,
}

impl Column {
    fn of(&self, sample: &Sample) -> Option<f64> {
        if sample.tool != self.tool {
            return None;
        }
        match self.value {
            Value::Seconds(phase) => sample.seconds.get(phase).copied(),
            Value::Peak => sample.peak_bytes.map(|bytes| bytes as f64),
        }
    }

    fn show(&self, value: f64) -> String {
        match self.value {
            Value::Seconds(_) => seconds(value),
            Value::Peak => bytes(value as u64),
        }
    }

    /// Median and spread over the repeats of an input.
    pub(super) fn spread(&self, run: &Run, input: &str, triangles: u64) -> Option<Spread> {
        let of = run.samples.iter().filter(|s| s.input == input && s.triangles == triangles);
        Spread::of(of.filter_map(|sample| self.of(sample)))
    }

    /// Medians of the rooms.
    pub(super) fn points(&self, run: &Run) -> Vec<(f64, Spread)> {
        let spread = |t: u64| Some((t as f64, self.spread(run, ROOM, t)?));
        sizes(run, ROOM).into_iter().filter_map(spread).collect()
    }

    fn exponent(&self, run: &Run, least: u64) -> String {
        let points = self.points(run).into_iter().filter(|&(t, _)| t >= least as f64);
        exponent(points.map(|(t, s)| (t, s.median))).map_or_else(|| "-".to_owned(), |p| format!("{p:.2}"))
    }
}

pub(super) fn columns() -> Vec<Column> {
    let ours = |name: &str, phase| Column { name: name.to_owned(), tool: VLM, value: Value::Seconds(phase) };
    let mut columns: Vec<Column> = PHASES.iter().map(|phase| ours(phase, phase)).collect();
    columns.push(ours("all stages", BAKE));
    columns.push(ours("whole process", PROCESS));
    columns.push(Column { name: "peak memory".to_owned(), tool: VLM, value: Value::Peak });
    let value = Value::Seconds(PROCESS);
    columns.push(Column { name: "gltfpack -si 0.1".to_owned(), tool: GLTFPACK, value });
    columns
}

/// Numbers of triangles of an input, ascending.
pub(super) fn sizes(run: &Run, input: &str) -> BTreeSet<u64> {
    run.samples.iter().filter(|sample| sample.input == input).map(|sample| sample.triangles).collect()
}

/// Milliseconds or more, in seconds.
fn seconds(value: f64) -> String {
    if value < 5e-5 { "0.0000".to_owned() } else { short(value) }
}

/// Everything in Markdown.
#[must_use]
pub fn summary(run: &Run) -> String {
    let repeats = run.samples.iter().map(|sample| sample.repeat).collect::<BTreeSet<_>>().len();
    let gltfpack = match &run.gltfpack {
        Ok(version) => format!("`gltfpack -si 0.1`: {version} of PATH, whole process"),
        Err(reason) => format!("`gltfpack`: {reason}"),
    };
    let mut text = format!(
        "# Cost of a bake by number of triangles\n\n\
         {}, {} threads; preset `{}`; seconds, medians of {repeats} interleaved repeats, each in a process of its own. \
         Load reads the file, textures too; peak memory is the most that the process had resident, everything included{}. \
         {gltfpack}.\n\n",
        run.device,
        run.threads,
        run.preset,
        if run.samples.iter().all(|s| s.peak_bytes.is_none()) { " (this system does not tell)" } else { "" },
    );
    let columns = columns();
    let head = ["input", "triangles", "lights"].map(str::to_owned);
    let header: Vec<String> = head.into_iter().chain(columns.iter().map(|c| c.name.clone())).collect();
    let mut rows: Vec<Vec<String>> =
        sizes(run, ROOM).into_iter().map(|size| line(run, &columns, ROOM, size)).collect();
    if rows.len() > 1 {
        rows.push(exponents(run, &columns, "**exponent**", 0));
    }
    if sizes(run, ROOM).range(MANY..).count() > 1 {
        rows.push(exponents(run, &columns, "**exponent, 80,000 triangles on**", MANY));
    }
    let real: BTreeSet<(u64, &str)> = run
        .samples
        .iter()
        .filter(|sample| sample.input != ROOM)
        .map(|sample| (sample.triangles, sample.input.as_str()))
        .collect();
    rows.extend(real.into_iter().map(|(size, input)| line(run, &columns, input, size)));
    text += &table(&header, &rows);
    text += "\nExponents are slopes of least squares in log-log over the rooms: 1 is proportional.\n";
    text += &spread_line(run);
    if !run.absent.is_empty() {
        text += &format!("\nNot on this machine: {}.\n", run.absent.join(", "));
    }
    text
}

fn line(run: &Run, columns: &[Column], input: &str, triangles: u64) -> Vec<String> {
    let lights = run
        .samples
        .iter()
        .find(|s| s.input == input && s.triangles == triangles && s.lights.is_some())
        .and_then(|sample| sample.lights);
    let head = [input.to_owned(), grouped(triangles), lights.map_or_else(|| "-".to_owned(), grouped)];
    let cell = |column: &Column| match (column.spread(run, input, triangles), &run.gltfpack) {
        (Some(spread), _) => column.show(spread.median),
        (None, Err(reason)) if column.tool == GLTFPACK => reason.clone(),
        (None, _) if column.tool == GLTFPACK => "failed".to_owned(),
        (None, _) => "-".to_owned(),
    };
    head.into_iter().chain(columns.iter().map(cell)).collect()
}

fn exponents(run: &Run, columns: &[Column], name: &str, least: u64) -> Vec<String> {
    let head = [name.to_owned(), String::new(), String::new()];
    head.into_iter().chain(columns.iter().map(|column| column.exponent(run, least))).collect()
}

/// How far repeats differ.
fn spread_line(run: &Run) -> String {
    let whole = Column { name: String::new(), tool: VLM, value: Value::Seconds(PROCESS) };
    let spreads = run.samples.iter().filter_map(|s| whole.spread(run, &s.input, s.triangles));
    Spread::of(spreads.map(|s| s.high / s.low)).map_or_else(String::new, |worst| {
        format!(
            "Slowest over fastest repeat of the whole process: {} in the median, {} at worst.\n",
            short(worst.median),
            short(worst.high)
        )
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Decimation with exponent 1.2, peak memory proportional, everything else constant.
    pub fn made_up() -> Run {
        let mut samples = Vec::new();
        for triangles in [1_000u64, 10_000, 100_000, 1_000_000] {
            for (repeat, factor) in [1.0, 0.8, 1.25].into_iter().enumerate() {
                let decimate = factor * 1e-3 * (triangles as f64 / 1e3).powf(1.2);
                let seconds = [("decimate", decimate), ("load", 0.5), (BAKE, decimate + 1.0), (PROCESS, 4.0)];
                let sample = Sample {
                    input: ROOM.to_owned(),
                    tool: VLM.to_owned(),
                    repeat: repeat as u32,
                    triangles,
                    lights: Some(460),
                    seconds: seconds.map(|(phase, s)| (phase.to_owned(), s)).into(),
                    peak_bytes: Some(1_000 * triangles),
                };
                samples.push(sample.clone());
                samples.push(Sample { input: "hall".to_owned(), triangles: 777, ..sample.clone() });
                samples.push(Sample {
                    tool: GLTFPACK.to_owned(),
                    lights: None,
                    seconds: [(PROCESS.to_owned(), 1e-6 * triangles as f64)].into(),
                    peak_bytes: None,
                    ..sample
                });
            }
        }
        Run {
            samples,
            gltfpack: Ok("gltfpack 9.9".to_owned()),
            absent: vec!["sponza".to_owned()],
            preset: "game".to_owned(),
            threads: 2,
            device: "made up".to_owned(),
        }
    }

    /// The cells of the first line that begins with `start`.
    fn cells(text: &str, start: &str) -> Vec<String> {
        let line = text.lines().find(|line| line.starts_with(start)).unwrap_or_default();
        line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()
    }

    #[test]
    fn medians_and_known_exponents_are_in_their_columns() {
        let text = summary(&made_up());
        let head = cells(&text, "| input");
        let column = |name: &str| head.iter().position(|cell| cell == name).unwrap();
        let room = cells(&text, "| room | 10,000 |");
        assert_eq!(room[column("lights")], "460");
        assert_eq!(room[column("decimate")], "0.0158", "the median, not the mean of 0.0161");
        assert_eq!(room[column("mend")], "-");
        assert_eq!(room[column("peak memory")], "10.0 MB");
        assert_eq!(room[column("gltfpack -si 0.1")], "0.0100");
        for start in ["| **exponent** |", "| **exponent, 80,000"] {
            let exponents = cells(&text, start);
            assert_eq!(exponents[column("decimate")], "1.20");
            assert_eq!(exponents[column("load")], "0.00");
            assert_eq!(exponents[column("peak memory")], "1.00");
            assert_eq!(exponents[column("gltfpack -si 0.1")], "1.00");
            assert_eq!(exponents[column("mend")], "-");
        }
        assert!(!cells(&text, "| hall | 777 |")[0].is_empty());
        assert!(text.contains("Not on this machine: sponza") && text.contains("gltfpack 9.9"));
    }

    #[test]
    fn what_is_not_there_is_said() {
        let mut run = made_up();
        run.gltfpack = Err("not installed".to_owned());
        run.samples.retain(|sample| sample.tool == VLM);
        run.samples.iter_mut().for_each(|sample| sample.peak_bytes = None);
        let text = summary(&run);
        assert!(text.contains("this system does not tell"));
        assert_eq!(cells(&text, "| room | 1,000 |").last().unwrap(), "not installed");
        assert!(!summary(&made_up()).contains("not installed"), "the negative control");
        assert!(!summary(&made_up()).contains("does not tell"), "the negative control");
    }
}

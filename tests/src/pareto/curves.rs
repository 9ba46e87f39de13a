//! The rows of a run by scene, method and setting: medians and spread over repeats, and means over a scene's cameras.

use std::collections::{BTreeMap, BTreeSet};

use super::front::{Sample, front, front_samples};
use super::row::Row;
use crate::plot::SERIES;

/// The method that all ratios are relative to.
pub const YARDSTICK: &str = "thesis";

/// Methods in the order of their series numbers: a run of fewer methods keeps every method's colour and marker.
const NUMBERED: [&str; 6] = [YARDSTICK, OURS, "brute", "ddgi", "instant_radiosity", "direct"];

/// A median with the least and greatest value that it stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// The middle value, or the mean of the two.
    pub median: f64,
    /// The least value.
    pub low: f64,
    /// The greatest value.
    pub high: f64,
}

impl Spread {
    /// Of any values; `None` without any.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let (low, high) = (*values.first()?, *values.last()?);
        let middle = values.len() / 2;
        let median = if values.len().is_multiple_of(2) {
            0.5 * (values[middle - 1] + values[middle])
        } else {
            values[middle]
        };
        Some(Self { median, low, high })
    }
}

/// A method's setting in a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// `key=value` pairs.
    pub knob: String,
    /// Per repeat, means over the cameras: quadratic of the errors, arithmetic of the times.
    pub repeats: BTreeMap<u32, Sample>,
    /// Time of a frame over the repeats.
    pub seconds: Spread,
    /// Model error over the repeats.
    pub error: Spread,
    /// Algorithm error over the repeats, where the method has area lights.
    pub algorithm: Option<Spread>,
    /// False if any camera's truth is too noisy to judge any repeat.
    pub suffices: bool,
}

/// A method's settings in a scene, from fast to slow.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodCurve {
    /// The method's name, with its backend where that is not the processor.
    pub name: String,
    /// Its number for its colour: known methods have the same one in every run.
    pub series: usize,
    /// By median time.
    pub settings: Vec<Setting>,
}

/// A scene's methods.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneCurves {
    /// The scene's name.
    pub scene: String,
    /// Its cameras, in the order of the rows.
    pub cameras: Vec<String>,
    /// The yardstick, ours, then by name.
    pub methods: Vec<MethodCurve>,
    /// Settings that lack a camera in every repeat, and so have no place in a mean over cameras.
    pub incomplete: Vec<String>,
}

impl MethodCurve {
    /// The medians of each setting.
    #[must_use]
    pub fn medians(&self) -> Vec<Sample> {
        let sample = |setting: &Setting| Sample {
            seconds: setting.seconds.median,
            error: setting.error.median,
            suffices: setting.suffices,
        };
        self.settings.iter().map(sample).collect()
    }

    /// The settings on the front of the medians.
    #[must_use]
    pub fn front(&self) -> Vec<&Setting> {
        front(&self.medians()).into_iter().map(|i| &self.settings[i]).collect()
    }

    /// The front that a single repeat shows.
    #[must_use]
    pub fn front_of(&self, repeat: u32) -> Vec<Sample> {
        let samples: Vec<Sample> =
            self.settings.iter().filter_map(|setting| setting.repeats.get(&repeat).copied()).collect();
        front_samples(&samples)
    }

    /// The repeats that any setting has, ascending.
    #[must_use]
    pub fn repeats(&self) -> Vec<u32> {
        let repeats = self.settings.iter().flat_map(|setting| setting.repeats.keys().copied());
        repeats.collect::<BTreeSet<u32>>().into_iter().collect()
    }
}

/// The name under which a row's method appears.
#[must_use]
pub fn method_name(row: &Row) -> String {
    if row.backend == "cpu" { row.method.clone() } else { format!("{} ({})", row.method, row.backend) }
}

/// The method that the project makes.
const OURS: &str = "vlm";

/// True for the yardstick on any backend.
pub(crate) fn is_yardstick(name: &str) -> bool {
    name.strip_prefix(YARDSTICK).is_some_and(|backend| backend.is_empty() || backend.starts_with(" ("))
}

/// Sorts names: the yardstick, ours, and the others by name.
pub(crate) fn method_order(name: &str) -> (u8, String) {
    let rank = match name {
        name if is_yardstick(name) => 0,
        name if name.starts_with(OURS) => 1,
        _ => 2,
    };
    (rank, name.to_owned())
}

/// The distinct values in order of first appearance.
pub(crate) fn distinct<'a>(values: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut seen = BTreeSet::new();
    values.filter(|value| seen.insert(*value)).map(str::to_owned).collect()
}

/// Groups the rows by scene, in the order of the rows.
#[must_use]
pub fn scene_curves(rows: &[Row]) -> Vec<SceneCurves> {
    let mut all_methods =
        distinct(rows.iter().map(method_name).collect::<Vec<_>>().iter().map(String::as_str));
    all_methods.sort_by_cached_key(|name| method_order(name));
    let scenes = distinct(rows.iter().map(|row| row.scene.as_str()));
    scenes.into_iter().map(|scene| one_scene(rows, scene, &all_methods)).collect()
}

/// The series number of each method. Unknown ones take the numbers after the known ones, then those of known methods that
/// the run lacks, so that colours repeat only where there are more methods than colours.
fn series_numbers(methods: &[String]) -> Vec<usize> {
    let known = |name: &String| NUMBERED.iter().position(|numbered| numbered == name);
    let lacking = |&number: &usize| !methods.iter().any(|name| known(name) == Some(number));
    let mut free = (NUMBERED.len()..SERIES).chain((0..NUMBERED.len()).filter(lacking)).chain(SERIES..);
    methods.iter().map(|name| known(name).or_else(|| free.next()).unwrap_or_default()).collect()
}

fn one_scene(rows: &[Row], scene: String, all_methods: &[String]) -> SceneCurves {
    let rows: Vec<&Row> = rows.iter().filter(|row| row.scene == scene).collect();
    let cameras = distinct(rows.iter().map(|row| row.camera.as_str()));
    let mut incomplete = Vec::new();
    let mut methods = Vec::new();
    for (series, name) in series_numbers(all_methods).into_iter().zip(all_methods) {
        let mut by_knob: BTreeMap<&str, Vec<&Row>> = BTreeMap::new();
        for row in rows.iter().filter(|row| method_name(row) == *name) {
            by_knob.entry(&row.knob).or_default().push(row);
        }
        let mut settings = Vec::new();
        for (knob, rows) in by_knob {
            match setting(knob, &rows, cameras.len()) {
                Some(setting) => settings.push(setting),
                None => incomplete.push(format!("{name} {knob}").trim().to_owned()),
            }
        }
        settings.sort_by(|a: &Setting, b| a.seconds.median.total_cmp(&b.seconds.median));
        if !settings.is_empty() {
            methods.push(MethodCurve { name: name.clone(), series, settings });
        }
    }
    SceneCurves { scene, cameras, methods, incomplete }
}

fn setting(knob: &str, rows: &[&Row], cameras: usize) -> Option<Setting> {
    let mut by_repeat: BTreeMap<u32, Vec<&Row>> = BTreeMap::new();
    for row in rows {
        by_repeat.entry(row.repeat).or_default().push(row);
    }
    by_repeat.retain(|_, rows| rows.len() == cameras);
    let sample = |rows: &Vec<&Row>| Sample {
        seconds: mean(rows.iter().map(|row| row.frame_seconds())),
        error: quadratic_mean(rows.iter().map(|row| row.relative_rmse)),
        suffices: rows.iter().all(|row| row.truth_suffices),
    };
    let algorithm = |rows: &Vec<&Row>| -> Option<f64> {
        Some(quadratic_mean(
            rows.iter().map(|row| row.algorithm_rmse).collect::<Option<Vec<f64>>>()?.into_iter(),
        ))
    };
    let repeats: BTreeMap<u32, Sample> =
        by_repeat.iter().map(|(&repeat, rows)| (repeat, sample(rows))).collect();
    Some(Setting {
        knob: knob.to_owned(),
        seconds: Spread::of(repeats.values().map(|sample| sample.seconds))?,
        error: Spread::of(repeats.values().map(|sample| sample.error))?,
        algorithm: Spread::of(by_repeat.values().filter_map(algorithm)),
        suffices: repeats.values().all(|sample| sample.suffices),
        repeats,
    })
}

/// As if the cameras' frames were shown one after another.
fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// Root of the mean of squares, as over the pixels of one picture: a camera in which a method fails stays visible, where
/// a geometric mean would let a good camera hide it.
fn quadratic_mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len();
    // One value stays as it is, not rounded.
    if count == 1 { values.sum() } else { mean(values.map(|value| value * value)).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pareto::made_up::row;

    #[test]
    fn spreads_have_a_middle() {
        assert_eq!(Spread::of([3.0, 1.0, 2.0]), Some(Spread { median: 2.0, low: 1.0, high: 3.0 }));
        assert_eq!(Spread::of([4.0, 1.0]).unwrap().median, 2.5);
        assert_eq!(Spread::of([]), None);
    }

    #[test]
    fn methods_keep_their_number_and_the_yardstick_leads() {
        let rows = [
            row("a", "c", "vlm", "n=1", 0, 1.0, 0.1),
            row("b", "c", "brute", "", 0, 1.0, 0.1),
            row("b", "c", "thesis", "", 0, 1.0, 0.1),
        ];
        let scenes = scene_curves(&rows);
        let names = |i: usize| -> Vec<(&str, usize)> {
            scenes[i].methods.iter().map(|method| (method.name.as_str(), method.series)).collect()
        };
        assert_eq!(names(0), [("vlm", 1)]);
        assert_eq!(names(1), [("thesis", 0), ("brute", 2)]);
    }

    #[test]
    fn colours_do_not_depend_on_what_else_ran() {
        let numbers =
            |names: &[&str]| series_numbers(&names.iter().map(|&n| n.to_owned()).collect::<Vec<_>>());
        assert_eq!(
            numbers(&["thesis", "vlm", "brute", "ddgi", "instant_radiosity", "direct"]),
            [0, 1, 2, 3, 4, 5]
        );
        assert_eq!(numbers(&["direct", "vlm"]), [5, 1]);
        assert_eq!(numbers(&["vlm", "a", "b", "c", "d"]), [1, 6, 7, 0, 2], "unknown ones take what is free");
    }

    #[test]
    fn a_camera_that_fails_is_not_hidden() {
        let rows =
            [row("a", "front", "brute", "", 0, 1.0, 8.37), row("a", "back", "brute", "", 0, 3.0, 0.041)];
        let setting = &scene_curves(&rows)[0].methods[0].settings[0];
        assert!((setting.error.median - 5.919).abs() < 1e-3, "not 0.586, the geometric mean");
        assert_eq!(setting.seconds.median, 2.0);
    }

    #[test]
    fn cameras_count_equally_and_must_all_be_there() {
        let rows = [
            row("a", "left", "vlm", "n=1", 0, 1.0, 0.1),
            row("a", "right", "vlm", "n=1", 0, 4.0, 0.4),
            row("a", "left", "vlm", "n=1", 1, 1.0, 0.1),
            row("a", "left", "vlm", "n=2", 0, 1.0, 0.1),
        ];
        let scene = &scene_curves(&rows)[0];
        let settings = &scene.methods[0].settings;
        assert_eq!((settings.len(), settings[0].repeats.len()), (1, 1), "repeat 1 lacks a camera");
        assert!((settings[0].seconds.median - 2.5).abs() < 1e-12);
        assert!((settings[0].error.median - 0.085f64.sqrt()).abs() < 1e-12);
        assert_eq!(scene.incomplete, ["vlm n=2"]);
    }

    #[test]
    fn one_doubtful_truth_makes_the_setting_doubtful() {
        let mut rows = [row("a", "c", "vlm", "", 0, 1.0, 0.1), row("a", "c", "vlm", "", 1, 3.0, 0.1)];
        assert!(scene_curves(&rows)[0].methods[0].settings[0].suffices);
        rows[1].truth_suffices = false;
        let setting = scene_curves(&rows)[0].methods[0].settings[0].clone();
        assert!(!setting.suffices);
        assert_eq!(setting.seconds, Spread { median: 2.0, low: 1.0, high: 3.0 });
    }

    #[test]
    fn backends_are_methods_of_their_own() {
        let mut gpu = row("a", "c", "vlm", "", 0, 1.0, 0.1);
        gpu.backend = "gpu".to_owned();
        let scene = &scene_curves(&[gpu, row("a", "c", "vlm", "", 0, 2.0, 0.1)])[0];
        assert_eq!(scene.methods.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["vlm", "vlm (gpu)"]);
        assert!(is_yardstick("thesis") && is_yardstick("thesis (gpu)") && !is_yardstick("thesis_of_others"));
    }
}

//! Tables that compare methods at equal time and at equal error.

use std::fmt::Write;

use super::curves::{MethodCurve, SceneCurves, Spread, YARDSTICK, is_yardstick};
use super::front::{Reading, Sample, error_within, front_samples, seconds_to_reach};
use super::numbers::{levels, range, short, time};

/// Levels in a table.
const MOST_LEVELS: usize = 6;

/// What stays equal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Equal {
    /// Which error is reached within a time?
    Time,
    /// Which time does an error take?
    Error,
}

impl Equal {
    fn read(self, front: &[Sample], level: f64) -> Option<Reading> {
        match self {
            Self::Time => error_within(front, level),
            Self::Error => seconds_to_reach(front, level),
        }
    }

    /// Round levels over what the fronts of the medians cover.
    fn levels(self, scene: &SceneCurves) -> Vec<f64> {
        let fronts = scene.methods.iter().flat_map(|method| front_samples(&method.medians()));
        let values = fronts.map(|sample| if self == Self::Time { sample.seconds } else { sample.error });
        let positive = values.filter(|value| *value > 0.0);
        let (low, high) = positive.fold((f64::INFINITY, 0f64), |(l, h), v| (l.min(v), h.max(v)));
        levels(low, high, MOST_LEVELS)
    }
}

/// What a method shows at a level, over the repeats.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Error or seconds; `None` if no repeat gets there.
    pub value: Option<Spread>,
    /// Over the yardstick's in the same repeat, where both get there.
    pub ratio: Option<Spread>,
    /// Repeats that get there, and repeats.
    pub reached: (usize, usize),
    /// False if the truth does not suffice for what the answer rests on.
    pub suffices: bool,
}

/// Asks a method, every repeat by itself: its own front, against the yardstick's front of the same repeat.
#[must_use]
pub fn ask(equal: Equal, method: &MethodCurve, yardstick: Option<&MethodCurve>, level: f64) -> Answer {
    let repeats = method.repeats();
    let readings: Vec<(u32, Reading)> =
        repeats.iter().filter_map(|&r| Some((r, equal.read(&method.front_of(r), level)?))).collect();
    let ratio = |(repeat, reading): &(u32, Reading)| {
        let theirs = equal.read(&yardstick?.front_of(*repeat), level)?.value;
        (theirs > 0.0).then(|| reading.value / theirs)
    };
    Answer {
        value: Spread::of(readings.iter().map(|(_, reading)| reading.value)),
        ratio: Spread::of(readings.iter().filter_map(ratio)),
        reached: (readings.len(), repeats.len()),
        suffices: readings.iter().all(|(_, reading)| reading.suffices),
    }
}

/// The table in Markdown; a line without it if there is no level to compare at.
#[must_use]
pub fn table(equal: Equal, scene: &SceneCurves) -> String {
    let (level_name, value_name) = match equal {
        Equal::Time => ("within", "relative RMSE"),
        Equal::Error => ("relative RMSE", "time"),
    };
    let yardstick = scene.methods.iter().find(|method| is_yardstick(&method.name));
    let levels = equal.levels(scene);
    if levels.is_empty() {
        return "No method has a time and an error above 0.\n".to_owned();
    }
    let mut text = format!(
        "| {level_name} | method | {value_name} | least .. greatest | over {YARDSTICK} | least .. greatest |\n\
         |---:|---|---:|---:|---:|---:|\n"
    );
    for level in levels {
        for method in &scene.methods {
            let answer = ask(equal, method, yardstick, level);
            // Writing to a string cannot fail.
            let _ = writeln!(text, "| {} |", cells(equal, level, method, &answer).join(" | "));
        }
    }
    text
}

fn cells(equal: Equal, level: f64, method: &MethodCurve, answer: &Answer) -> [String; 6] {
    let (level_text, write): (String, fn(f64) -> String) = match equal {
        Equal::Time => (time(level), short),
        Equal::Error => (short(level), time),
    };
    let nothing = || "–".to_owned();
    let Some(value) = answer.value else {
        return [level_text, method.name.clone(), "not reached".to_owned(), nothing(), nothing(), nothing()];
    };
    let mark = if answer.suffices { "" } else { " †" };
    let (reached, repeats) = answer.reached;
    let some =
        if reached < repeats { format!(" (in {reached} of {repeats} repeats)") } else { String::new() };
    [
        level_text,
        method.name.clone(),
        format!("{}{mark}{some}", write(value.median)),
        range(&value, write),
        answer.ratio.map_or_else(nothing, |ratio| short(ratio.median)),
        answer.ratio.map_or_else(nothing, |ratio| range(&ratio, short)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pareto::curves::scene_curves;
    use crate::pareto::made_up::row;

    /// `vlm` errs half as much as `thesis` at any time, and is four times faster at any error: both fall as 1/sqrt(t).
    /// In repeat 1 the yardstick alone takes twice as long.
    fn scene() -> SceneCurves {
        let mut rows = Vec::new();
        for repeat in 0..2 {
            for (knob, seconds) in [("n=1", 0.01), ("n=2", 1.0)] {
                let slow = if repeat == 1 { 2.0 } else { 1.0 };
                rows.push(row("s", "c", "thesis", knob, repeat, slow * seconds, 0.05 / seconds.sqrt()));
                rows.push(row("s", "c", "vlm", knob, repeat, seconds, 0.025 / seconds.sqrt()));
            }
        }
        scene_curves(&rows).remove(0)
    }

    fn near(spread: Option<Spread>, low: f64, high: f64) {
        let spread = spread.unwrap();
        assert!(
            (spread.low / low - 1.0).abs() < 1e-9 && (spread.high / high - 1.0).abs() < 1e-9,
            "{spread:?}"
        );
        assert!((spread.median / (0.5 * (low + high)) - 1.0).abs() < 1e-9, "{spread:?}");
    }

    #[test]
    fn ratios_pair_the_repeats() {
        let scene = scene();
        let [thesis, vlm] = scene.methods.as_slice() else { panic!("two methods") };
        let at_time = ask(Equal::Time, vlm, Some(thesis), 0.1);
        near(at_time.value, 0.025 / 0.1f64.sqrt(), 0.025 / 0.1f64.sqrt());
        near(at_time.ratio, 0.5 / 2f64.sqrt(), 0.5);
        let at_error = ask(Equal::Error, vlm, Some(thesis), 0.1);
        near(at_error.value, 0.0625, 0.0625);
        near(at_error.ratio, 0.125, 0.25);
        near(ask(Equal::Time, thesis, Some(thesis), 0.1).ratio, 1.0, 1.0);
    }

    #[test]
    fn what_is_not_reached_says_so() {
        let scene = scene();
        let [thesis, vlm] = scene.methods.as_slice() else { panic!("two methods") };
        let answer = ask(Equal::Error, thesis, Some(thesis), 0.03);
        assert_eq!((answer.value, answer.ratio, answer.reached), (None, None, (0, 2)));
        let alone = ask(Equal::Error, vlm, Some(thesis), 0.03);
        assert!(alone.value.is_some() && alone.ratio.is_none());
        let half = ask(Equal::Time, thesis, Some(thesis), 0.015);
        assert_eq!(half.reached, (1, 2));
        let text = table(Equal::Error, &scene);
        assert!(text.contains("| 0.0500 | thesis | 1.50 s |"), "{text}");
        let text = table(Equal::Time, &scene);
        assert!(text.contains("| 10.0 ms | thesis | 0.500 (in 1 of 2 repeats) |"), "{text}");
    }

    #[test]
    fn a_truth_that_does_not_suffice_leaves_its_mark() {
        let mut rows =
            vec![row("s", "c", "thesis", "", 0, 0.01, 0.5), row("s", "c", "vlm", "", 0, 0.01, 0.5)];
        assert!(!table(Equal::Time, &scene_curves(&rows)[0]).contains('†'));
        rows[1].truth_suffices = false;
        let text = table(Equal::Time, &scene_curves(&rows)[0]);
        assert!(text.contains("| vlm | 0.500 † |") && text.contains("| thesis | 0.500 |"), "{text}");
    }
}

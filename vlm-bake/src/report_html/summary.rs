//! The verdict in plain words, and what to change first.

use super::advice::Remedies;
use super::checked::Checked;
use super::objects::{ObjectFigures, percent};
use super::places::{Trouble, WorstPlace};
use super::text::{area, length, node, plural};
use crate::report::Report;
use crate::tag::TagReason;

/// Uncovered surface up to this share passes without a word.
const UNCOVERED: f64 = 0.01;

/// Tags up to this share of the lights' area, and of the surface, pass without a word.
const TAGGED: f64 = 0.03;

/// The mean offset may be this many times the decimation error and the clearance together.
const OFFSET: f64 = 1.5;

/// Things to change that are listed.
const MOST: usize = 5;

/// How well a bake went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Nothing to do.
    Good,
    /// Usable, and can be better.
    Look,
    /// Lights shine where they must not.
    Bad,
}

/// The verdict.
pub struct Summary {
    /// How well it went.
    pub level: Level,
    /// In a few words.
    pub headline: String,
    /// In a sentence or two.
    pub text: String,
    /// What to change, the most rewarding first.
    pub changes: Vec<String>,
}

/// Sums up a bake.
pub fn summary(
    report: &Report,
    checked: &Checked,
    objects: &[ObjectFigures],
    places: &[WorstPlace],
    remedies: &Remedies,
) -> Summary {
    let changes = changes(report, checked, objects, places, remedies);
    let (level, headline) = match (checked.open, changes.len()) {
        (0, 0) => (Level::Good, "Fine: nothing worth changing".to_owned()),
        (0, _) => (
            Level::Look,
            "Usable: no light shines where it must not, but light is lost or displaced".to_owned(),
        ),
        _ => (
            Level::Bad,
            format!(
                "Not fine: {}",
                plural(checked.open, "light shines where it must not", "lights shine where they must not")
            ),
        ),
    };
    let hidden = match checked.open {
        0 => "Every one of them is hidden behind the surface that it stands for, or kept off it by a tag",
        _ => "The others are hidden behind the surface that they stand for, or kept off it by a tag",
    };
    let text = format!(
        "{} stand for {} of surface. {hidden}. {} of the lights' area carries a tag, {} of the surface is covered by tags; {} of the \
         surface has no light.",
        plural(report.lights, "light", "lights"),
        area(checked.visible_m2),
        percent(checked.tagged),
        percent(checked.covered_by_tags),
        percent(checked.uncovered),
    );
    Summary { level, headline, text, changes }
}

fn changes(
    report: &Report,
    checked: &Checked,
    objects: &[ObjectFigures],
    places: &[WorstPlace],
    remedies: &Remedies,
) -> Vec<String> {
    let found = [
        open_lights(checked.open, places, remedies),
        uncovered(checked, objects, remedies),
        missing(objects),
        tagged(report, checked),
        budget(report),
        offset(report, checked),
    ];
    found.into_iter().flatten().take(MOST).collect()
}

fn open_lights(open: usize, places: &[WorstPlace], remedies: &Remedies) -> Option<String> {
    let worst = places.iter().find(|p| !p.tagged && p.trouble <= Trouble::Sliver).filter(|_| open > 0)?;
    Some(format!(
        "{} at {}: see the first of the worst places. {}",
        worst.title(),
        node(&worst.object),
        worst.advice(remedies)
    ))
}

fn uncovered(checked: &Checked, objects: &[ObjectFigures], remedies: &Remedies) -> Option<String> {
    let share = checked.uncovered;
    let most = objects.iter().max_by(|a, b| a.uncovered_m2.total_cmp(&b.uncovered_m2))?;
    (share > UNCOVERED).then(|| {
        format!(
            "{} of the surface bounces no light, most of it ({}) on {}: {}.",
            percent(share),
            area(most.uncovered_m2),
            node(&most.path),
            remedies.finer(node(&most.path))
        )
    })
}

/// The largest object that misses the rule of 2 %, if such objects matter in the scene.
fn missing(objects: &[ObjectFigures]) -> Option<String> {
    let missed: Vec<&ObjectFigures> = objects.iter().filter(|o| !o.why_missed().is_empty()).collect();
    let worst = missed.iter().copied().max_by(|a, b| {
        let lost = |o: &ObjectFigures| reflecting(o) * (o.flux_ratio - 1.0).abs().max(o.albedo_error());
        lost(a).total_cmp(&lost(b))
    })?;
    let lost: f64 = missed.iter().copied().map(reflecting).sum();
    let all: f64 = objects.iter().map(reflecting).sum();
    (lost > 0.01 * all).then(|| {
        format!(
            "{} of {} not keep albedo and flux within 2 %; it matters most at {} (flux {}, albedo off by {}): {}.",
            plural(missed.len(), "object", "objects"),
            if missed.len() == 1 { format!("{} does", objects.len()) } else { format!("{} do", objects.len()) },
            node(&worst.path),
            percent(worst.flux_ratio),
            percent(worst.albedo_error()),
            worst.why_missed()
        )
    })
}

/// Reflecting area of an object: area times albedo.
fn reflecting(object: &ObjectFigures) -> f64 {
    object.visible_m2 * f64::from(object.albedo.element_sum())
}

fn tagged(report: &Report, checked: &Checked) -> Option<String> {
    let most = report.tags.iter().max_by(|a, b| a.covers_m2.total_cmp(&b.covers_m2))?;
    (checked.tagged.max(checked.covered_by_tags) > TAGGED).then(|| {
        let remedy = match most.reason {
            TagReason::Authored => "An artist asked for it",
            TagReason::TwoSided => {
                "If that is not meant to be a sheet, make it a closed solid and its material single-sided"
            }
            TagReason::Thin => "Make it thicker, or give it more lights",
            TagReason::Uncleared => "Smooth or simplify its shape, or give it more lights",
        };
        format!(
            "{} of the lights' area carries a tag, and {} of the surface ignores them, most of it at {}. {remedy}.",
            percent(checked.tagged),
            percent(checked.covered_by_tags),
            node(&most.object)
        )
    })
}

fn budget(report: &Report) -> Option<String> {
    (!report.missed_because.is_empty()).then(|| {
        format!(
            "{} lights were asked and {} made: {}.",
            report.asked_lights, report.lights, report.missed_because
        )
    })
}

fn offset(report: &Report, checked: &Checked) -> Option<String> {
    let allowed = OFFSET * (report.decimation.error_m + checked.required_m);
    (report.offset.mean_m > allowed).then(|| {
        format!(
            "Lights lie {} deep on average, where {} would do: sharp corners, hollows and folds push them down. More lights follow the \
             surface more closely.",
            length(report.offset.mean_m),
            length(allowed)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::AreaReport;
    use crate::verify::SelfLight;

    const REMEDIES: Remedies = Remedies { required_m: 1e-3, more_lights: 200, can_steer: true };

    const CLEAN: Checked = Checked {
        open: 0,
        self_lighting: 0,
        depth_m: 0.0,
        out: 0,
        required_m: 1e-3,
        samples: 1000,
        self_light: SelfLight { p999: 0.0, max: 0.0 },
        visible_m2: 10.0,
        uncovered: 0.0,
        tagged: 0.0,
        covered_by_tags: 0.0,
    };

    fn report() -> Report {
        Report {
            lights: 100,
            asked_lights: 100,
            area: AreaReport { lights_m2: 10.0, ..AreaReport::default() },
            ..Report::default()
        }
    }

    #[test]
    fn a_clean_bake_has_nothing_to_change() {
        let clean = summary(&report(), &CLEAN, &[], &[], &REMEDIES);
        assert_eq!((clean.level, clean.changes.len()), (Level::Good, 0));
    }

    #[test]
    fn open_lights_are_bad_and_lost_light_is_worth_a_look() {
        assert_eq!(summary(&report(), &Checked { open: 1, ..CLEAN }, &[], &[], &REMEDIES).level, Level::Bad);
        let lossy = Checked { uncovered: 0.1, ..CLEAN };
        let objects =
            [ObjectFigures { path: "Room/Chair".to_owned(), uncovered_m2: 1.0, ..ObjectFigures::default() }];
        let lossy = summary(&report(), &lossy, &objects, &[], &REMEDIES);
        assert_eq!(lossy.level, Level::Look);
        assert!(
            lossy.changes[0].contains("10 %") && lossy.changes[0].contains("Chair"),
            "{:?}",
            lossy.changes
        );
        let mut deep = report();
        deep.offset.mean_m = 1.0;
        assert!(summary(&deep, &CLEAN, &[], &[], &REMEDIES).changes[0].contains("deep"));
    }
}

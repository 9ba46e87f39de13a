//! What the check of the lights found, in figures.

use crate::report::Report;
use crate::verify::{FindingKind, SelfLight, Verification};

/// The check summed up. All but the lights that fail is the bake's own.
#[derive(Clone, Copy, Debug, Default)]
pub struct Checked {
    /// Lights that fail and that no tag keeps away.
    pub open: usize,
    /// Of these, lights that light their own surface.
    pub self_lighting: usize,
    /// How much deeper the worst of those would have to lie, metres.
    pub depth_m: f64,
    /// Lights that come out of their object.
    pub out: usize,
    /// Required clearance, metres.
    pub required_m: f64,
    /// Surface points looked at.
    pub samples: u64,
    /// The light that surface receives from lights that stand for it.
    pub self_light: SelfLight,
    /// Area of the surface that reflects or emits, square metres.
    pub visible_m2: f64,
    /// Share of it for which no light stands.
    pub uncovered: f64,
    /// Share of the lights' area that carries a tag.
    pub tagged: f64,
    /// Share of the surface that bears a tag.
    pub covered_by_tags: f64,
}

impl Checked {
    /// Sums up.
    pub fn of(verification: &Verification, report: &Report) -> Self {
        let area = &report.area;
        let of = |kind: FindingKind| verification.untagged().filter(move |f| f.kind == kind);
        let share = |part: f64, whole: f64| if whole > 0.0 { (part / whole).clamp(0.0, 1.0) } else { 0.0 };
        Self {
            open: verification.untagged().count(),
            self_lighting: of(FindingKind::LightsItself).count(),
            depth_m: of(FindingKind::LightsItself).map(|f| f.depth_m).fold(0.0, f64::max),
            out: of(FindingKind::PokesOut).count(),
            required_m: report.clearance.required_m,
            samples: report.clearance.samples,
            self_light: report.clearance.self_light,
            visible_m2: area.visible_m2,
            uncovered: share(area.uncovered_m2, area.visible_m2),
            tagged: share(area.tagged_m2, area.lights_m2),
            covered_by_tags: share(area.covered_by_tags_m2, area.visible_m2),
        }
    }
}

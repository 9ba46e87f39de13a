//! What the check of the lights found, in figures.

use super::stand_in::{SelfLight, Verification};

/// The check summed up.
#[derive(Clone, Copy, Debug, Default)]
pub struct Checked {
    /// Lights that fail and that no tag keeps away.
    pub open: usize,
    /// How far the worst of them would have to move, metres.
    pub depth_m: f64,
    /// Required clearance, metres.
    pub required_m: f64,
    /// The light that surface receives from its own region.
    pub self_light: SelfLight,
    /// Area of the surface that reflects or emits, square metres.
    pub visible_m2: f64,
    /// Part of it for which no light stands.
    pub uncovered_m2: f64,
}

impl Checked {
    /// Sums up.
    pub fn of(verification: &Verification) -> Self {
        let open = || verification.findings.iter().filter(|f| !f.tagged);
        let points = verification.points.iter().zip(&verification.light_of_point);
        Self {
            open: open().count(),
            depth_m: open().map(|f| f.depth_m).fold(0.0, f64::max),
            required_m: verification.required_m,
            self_light: verification.self_light,
            visible_m2: verification.points.iter().map(|p| p.area).sum(),
            uncovered_m2: points.filter(|(_, light)| light.is_none()).map(|(p, _)| p.area).sum(),
        }
    }

    /// Share of the surface for which no light stands.
    pub fn uncovered(&self) -> f64 {
        self.uncovered_m2 / self.visible_m2.max(f64::MIN_POSITIVE)
    }
}

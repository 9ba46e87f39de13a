//! Runs a form factor over the generated cases and bins its errors.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use rayon::prelude::*;

use super::bins::Errors;
use super::case::Case;
use super::generate::{Kind, generate};
use super::reference::{Truth, truth};

/// Cases that are made, evaluated and binned together: also what one GPU dispatch takes.
pub const BATCH: u64 = 1 << 16;

/// Lights below this many metres are subnormal numbers of few digits, which some GPUs take for 0: only the range of
/// their results is checked.
const SMALLEST_MEASURED: f64 = 1e-36;

/// Where in the table a case belongs. Ratios are exclusive upper bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Bin {
    /// Upper bound of the aspect ratio: 10, 100 or more.
    pub aspect: Aspect,
    /// The horizon cuts the light.
    pub crosses: bool,
    /// Distance over longest edge.
    pub reach: Reach,
}

/// Longest edge over height.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Aspect {
    /// Below 10.
    Below10,
    /// 10 to 100.
    To100,
    /// Above what the baker makes.
    Above100,
}

/// Distance from the receiver to the light's nearest point, over its longest edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Reach {
    /// Below 1e-3.
    Touching,
    /// 1e-3 to 1/30.
    Close,
    /// 1/30 to 1.
    Near,
    /// 1 to 100.
    Middle,
    /// Above 100.
    Far,
}

/// The errors of one bin.
#[derive(Clone, Debug, Default)]
pub struct BinErrors {
    /// `|F - truth| / U`.
    pub of_uncosined: Errors,
    /// The same less what rounding the receiver's place to f32 explains; which is how far the truth moves with that rounding.
    pub beyond_floor: Errors,
    /// `|F - truth| / truth` where both cosines exceed 0.1 and the whole light is seen.
    pub relative: Errors,
}

/// What a form factor did with all the cases.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Errors by bin.
    pub bins: BTreeMap<Bin, BinErrors>,
    /// Cases whose result was not within 0 to 1, or NaN.
    pub out_of_range: u64,
    /// The first of them.
    pub first_out_of_range: Option<u64>,
    /// NaN went in and something other than 0 came out.
    pub lit_by_nan: u64,
}

/// Evaluates cases `0..count` by batches; `evaluate` gives one form factor per case.
pub fn run(count: u64, evaluate: impl Fn(&[Case]) -> Vec<f32> + Sync) -> Report {
    (0..count.div_ceil(BATCH))
        .into_par_iter()
        .map(|batch| run_batch(batch * BATCH..((batch + 1) * BATCH).min(count), &evaluate))
        .reduce(Report::default, |all, more| all.merge(&more))
}

fn run_batch(indices: std::ops::Range<u64>, evaluate: &(impl Fn(&[Case]) -> Vec<f32> + Sync)) -> Report {
    let cases: Vec<(Kind, Case)> = indices.clone().map(generate).collect();
    let bare: Vec<Case> = cases.iter().map(|&(_, case)| case).collect();
    let mut report = Report::default();
    for ((index, (kind, case)), result) in indices.zip(cases).zip(evaluate(&bare)) {
        report.check_range(index, &case, result);
        if kind == Kind::Broken || case.size() < SMALLEST_MEASURED {
            continue;
        }
        if let Some(truth) = truth(&case).filter(|truth| truth.uncosined > 0.0) {
            report.add(index, &case, &truth, f64::from(result));
        }
    }
    report
}

impl Report {
    fn check_range(&mut self, index: u64, case: &Case, result: f32) {
        if !(0.0..=1.0).contains(&result) {
            self.out_of_range += 1;
            self.first_out_of_range.get_or_insert(index);
        }
        let has_nan = bytemuck::cast_ref::<Case, [f32; 15]>(case).iter().any(|v| v.is_nan());
        self.lit_by_nan += u64::from(has_nan && result != 0.0);
    }

    fn add(&mut self, index: u64, case: &Case, truth: &Truth, result: f64) {
        let error = (result - truth.form_factor).abs();
        let errors = self.bins.entry(bin_of(case, truth)).or_default();
        errors.of_uncosined.add(error / truth.uncosined, index);
        // Below this the floor makes no difference to any gate.
        let floor = if error > 1e-6 * truth.uncosined { rounding_floor(case, truth) } else { 0.0 };
        errors.beyond_floor.add((error - floor).max(0.0) / truth.uncosined, index);
        if truth.is_well_seen {
            errors.relative.add(error / truth.form_factor, index);
        }
    }

    fn merge(mut self, other: &Self) -> Self {
        for (bin, more) in &other.bins {
            let errors = self.bins.entry(*bin).or_default();
            errors.of_uncosined.merge(&more.of_uncosined);
            errors.beyond_floor.merge(&more.beyond_floor);
            errors.relative.merge(&more.relative);
        }
        self.out_of_range += other.out_of_range;
        self.lit_by_nan += other.lit_by_nan;
        self.first_out_of_range =
            [self.first_out_of_range, other.first_out_of_range].into_iter().flatten().min();
        self
    }

    /// The errors of all bins that `wanted` picks, as one distribution.
    #[must_use]
    pub fn over(&self, wanted: impl Fn(&Bin) -> bool) -> BinErrors {
        let mut all = BinErrors::default();
        for (_, errors) in self.bins.iter().filter(|(bin, _)| wanted(bin)) {
            all.of_uncosined.merge(&errors.of_uncosined);
            all.beyond_floor.merge(&errors.beyond_floor);
            all.relative.merge(&errors.relative);
        }
        all
    }

    /// A Markdown table, one row per bin.
    #[must_use]
    pub fn table(&self) -> String {
        let mut table = String::from(
            "| aspect | horizon | distance/size | cases | err/U p50 | p99 | p99.99 | max | beyond floor p99.99 | max | relative p99.99 |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
        );
        for (bin, errors) in &self.bins {
            let BinErrors { of_uncosined: e, beyond_floor: f, relative: r } = errors;
            // Writing to a string cannot fail.
            let _ = writeln!(
                table,
                "| {:?} | {} | {:?} | {} | {:.1e} | {:.1e} | {:.1e} | {:.1e} | {:.1e} | {:.1e} | {:.1e} |",
                bin.aspect,
                if bin.crosses { "crosses" } else { "clear" },
                bin.reach,
                e.count,
                e.quantile(0.5),
                e.quantile(0.99),
                e.quantile(0.9999),
                e.max.0,
                f.quantile(0.9999),
                f.max.0,
                r.quantile(0.9999),
            );
        }
        table
    }
}

fn bin_of(case: &Case, truth: &Truth) -> Bin {
    let aspect = match case.aspect() {
        a if a < 10.0 => Aspect::Below10,
        a if a <= 100.0 => Aspect::To100,
        _ => Aspect::Above100,
    };
    let reach = match case.distance() / case.size() {
        d if d < 1e-3 => Reach::Touching,
        d if d < 1.0 / 30.0 => Reach::Close,
        d if d < 1.0 => Reach::Near,
        d if d < 100.0 => Reach::Middle,
        _ => Reach::Far,
    };
    Bin { aspect, crosses: truth.crosses, reach }
}

/// How far the truth moves when the receiver moves by what four roundings to f32 of its distance to the farthest corner
/// may move it: no f32 form can be expected to do better, however exact it is from there on.
fn rounding_floor(case: &Case, truth_here: &Truth) -> f64 {
    let farthest =
        case.corners.iter().map(|v| (v.as_dvec3() - case.x.as_dvec3()).length()).fold(0.0, f64::max);
    let step = 4.0 * 2f64.powi(-24) * farthest;
    super::reference::truths_around(case, step)
        .iter()
        .map(|moved| (moved - truth_here.form_factor).abs())
        .fold(0.0, f64::max)
}

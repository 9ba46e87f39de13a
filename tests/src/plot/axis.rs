//! Axes: ranges, ticks and their labels.

/// How an axis maps values to places.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences take equal lengths.
    #[default]
    Linear,
    /// Equal ratios take equal lengths; only values above 0 can be shown.
    Log,
}

/// One axis of a figure.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// The quantity and its unit.
    pub label: String,
    /// How values map to places.
    pub scale: Scale,
    /// First and last value; without it the axis covers what the curves hold, with a margin.
    pub range: Option<(f64, f64)>,
}

/// A place on an axis that has a grid line; the major ones have a label.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tick {
    pub value: f64,
    pub label: Option<String>,
}

/// A logarithmic axis shows at least this many decades, so that two labels fall into it.
const FEWEST_DECADES: f64 = 0.6;
/// Share of the axis that stays free at either end.
const MARGIN: f64 = 0.05;
/// A linear axis has about this many labels.
const LINEAR_STEPS: f64 = 6.0;

impl Axis {
    /// An axis of decades.
    #[must_use]
    pub fn log(label: &str) -> Self {
        Self { label: label.to_owned(), scale: Scale::Log, range: None }
    }

    /// An axis of equal steps.
    #[must_use]
    pub fn linear(label: &str) -> Self {
        Self { label: label.to_owned(), scale: Scale::Linear, range: None }
    }

    /// The value in the units in which the axis is even.
    pub(crate) fn even(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => value,
            Scale::Log => value.log10(),
        }
    }

    /// True if the axis, with this range or without one yet, has a place for the value.
    pub(crate) fn shows(&self, value: f64, range: Option<(f64, f64)>) -> bool {
        // Rounding of the margins must not hide the outermost point.
        let inside = |(low, high): (f64, f64)| {
            let slack = 1e-9 * (self.even(high) - self.even(low)).abs();
            self.even(value) >= self.even(low) - slack && self.even(value) <= self.even(high) + slack
        };
        value.is_finite() && (self.scale == Scale::Linear || value > 0.0) && range.is_none_or(inside)
    }

    /// First and last value that the axis shows, given what the curves hold.
    pub(crate) fn cover(&self, values: impl Iterator<Item = f64>) -> (f64, f64) {
        if let Some(range) = self.range {
            return range;
        }
        let shown = values.filter(|&value| self.shows(value, None)).map(|value| self.even(value));
        let (low, high) = shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let fewest = if self.scale == Scale::Log { FEWEST_DECADES } else { 1e-9 * high.abs().max(1.0) };
        let wanted = ((high - low) * (1.0 + 2.0 * MARGIN)).max(fewest);
        let middle = 0.5 * (low + high);
        let (low, high) = (middle - 0.5 * wanted, middle + 0.5 * wanted);
        match self.scale {
            Scale::Linear => (low, high),
            Scale::Log => (10f64.powf(low), 10f64.powf(high)),
        }
    }

    /// Where the value lies: 0 at the range's first value, 1 at its last.
    pub(crate) fn place(&self, value: f64, (low, high): (f64, f64)) -> f64 {
        (self.even(value) - self.even(low)) / (self.even(high) - self.even(low))
    }

    /// Grid lines of a range, ascending.
    pub(crate) fn ticks(&self, range: (f64, f64)) -> Vec<Tick> {
        let ticks = match self.scale {
            Scale::Linear => linear_ticks(range),
            Scale::Log => log_ticks(range),
        };
        ticks.into_iter().filter(|tick| self.shows(tick.value, Some(range))).collect()
    }
}

fn linear_ticks((low, high): (f64, f64)) -> Vec<Tick> {
    let rough = (high - low) / LINEAR_STEPS;
    let decade = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade).into_iter().find(|&s| s >= rough).unwrap_or(rough);
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let multiples = (low / step).floor() as i64..=(high / step).ceil() as i64;
    let tick =
        |i: i64| Tick { value: i as f64 * step, label: Some(format!("{:.decimals$}", i as f64 * step)) };
    multiples.map(tick).collect()
}

/// Which digits of a decade get a label: the fewer decades, the more.
fn labelled_digits(decades: f64) -> &'static [u32] {
    if decades <= 1.0 {
        &[1, 2, 3, 4, 5, 6, 8]
    } else if decades <= 3.2 {
        &[1, 2, 5]
    } else {
        &[1]
    }
}

fn log_ticks((low, high): (f64, f64)) -> Vec<Tick> {
    let decades = (high / low).log10();
    // More than ten labels are more than anybody reads.
    let every = ((decades / 10.0).ceil() as i32).max(1);
    let digits: &[u32] = if decades > 9.0 { &[1] } else { &[1, 2, 3, 4, 5, 6, 7, 8, 9] };
    let labelled = labelled_digits(decades);
    let exponents = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let plain = low >= 0.99e-4 && high <= 1.01e5;
    let ticks = exponents.flat_map(|exponent| {
        digits.iter().map(move |&digit| {
            let has_label = labelled.contains(&digit) && exponent.rem_euclid(every) == 0;
            let value = f64::from(digit) * 10f64.powi(exponent);
            Tick { value, label: has_label.then(|| log_label(digit, exponent, plain)) }
        })
    });
    ticks.collect()
}

fn log_label(digit: u32, exponent: i32, plain: bool) -> String {
    if plain {
        let decimals = (-exponent).max(0) as usize;
        return format!("{:.decimals$}", f64::from(digit) * 10f64.powi(exponent));
    }
    let power: String = exponent.to_string().chars().map(superscript).collect();
    if digit == 1 { format!("10{power}") } else { format!("{digit}·10{power}") }
}

fn superscript(c: char) -> char {
    match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' | '4'..='9' => char::from_u32(u32::from('⁰') + u32::from(c) - u32::from('0')).unwrap_or(c),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, range: (f64, f64)) -> Vec<String> {
        axis.ticks(range).into_iter().filter_map(|tick| tick.label).collect()
    }

    #[test]
    fn log_labels_fit_the_number_of_decades() {
        let axis = Axis::log("x");
        assert_eq!(labels(&axis, (0.009, 2.5)), ["0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1", "2"]);
        assert_eq!(labels(&axis, (5e-9, 2e-5)), ["10⁻⁸", "10⁻⁷", "10⁻⁶", "10⁻⁵"]);
        assert_eq!(labels(&axis, (1e-20, 1e5)).len(), 8);
        assert_eq!(
            labels(&axis, (2e12, 1.5e13)),
            ["2·10¹²", "3·10¹²", "4·10¹²", "5·10¹²", "6·10¹²", "8·10¹²", "10¹³"]
        );
    }

    #[test]
    fn linear_labels_are_round() {
        assert_eq!(labels(&Axis::linear("x"), (-0.05, 1.05)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(
            labels(&Axis::linear("x"), (0.0, 3000.0)),
            ["0", "500", "1000", "1500", "2000", "2500", "3000"]
        );
    }

    #[test]
    fn ranges_cover_what_can_be_shown_and_at_least_two_labels() {
        let axis = Axis::log("x");
        let (low, high) = axis.cover([0.1, 10.0, 0.0, f64::NAN].into_iter());
        assert!(low < 0.1 && low > 0.05 && high > 10.0 && high < 20.0);
        for single in [1.0, 0.15, 7.3e-7, 9.0] {
            assert!(labels(&axis, axis.cover([single].into_iter())).len() >= 2, "{single}");
        }
        assert_eq!(Axis { range: Some((1.0, 2.0)), ..axis.clone() }.cover([5.0].into_iter()), (1.0, 2.0));
        assert!((axis.place(1.0, (0.1, 10.0)) - 0.5).abs() < 1e-12);
        assert!(!axis.shows(0.0, None) && !axis.shows(11.0, Some((0.1, 10.0))));
    }
}

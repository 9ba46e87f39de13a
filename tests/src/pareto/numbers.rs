//! Numbers as people read them.

use super::curves::Spread;

/// Three significant digits; powers of ten where a plain number would be long.
#[must_use]
pub fn short(value: f64) -> String {
    let size = value.abs();
    if !value.is_finite() {
        return value.to_string();
    }
    if size == 0.0 {
        return "0".to_owned();
    }
    if !(1e-4..1e6).contains(&size) {
        return format!("{value:.1e}");
    }
    // What rounds up to the next power of ten has one decimal less.
    let digits = format!("{size:.2e}");
    let exponent: i32 = digits.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    format!("{value:.0$}", (2 - exponent).max(0) as usize)
}

/// A time with its unit.
#[must_use]
pub fn time(seconds: f64) -> String {
    match seconds {
        s if s >= 1.0 => format!("{} s", short(s)),
        s if s >= 1e-3 || s == 0.0 => format!("{} ms", short(s * 1e3)),
        s => format!("{} µs", short(s * 1e6)),
    }
}

/// Least to greatest, in the form that `write` gives.
#[must_use]
pub fn range(spread: &Spread, write: fn(f64) -> String) -> String {
    format!("{} .. {}", write(spread.low), write(spread.high))
}

/// Digits of a ladder of round numbers.
const LADDERS: [&[f64]; 3] = [&[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];

/// Round numbers between two positive ones, ascending, at most `most`; without any the middle in log, if both are
/// finite.
#[must_use]
pub fn levels(low: f64, high: f64, most: usize) -> Vec<f64> {
    let positive = low > 0.0 && high >= low && high.is_finite();
    if !positive {
        return Vec::new();
    }
    let exponents = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let on = |ladder: &[f64]| -> Vec<f64> {
        let all =
            exponents.clone().flat_map(|e| ladder.iter().map(move |digit| round(digit * 10f64.powi(e))));
        all.filter(|level| (low..=high).contains(level)).collect()
    };
    let found = LADDERS.iter().map(|ladder| on(ladder)).find(|levels| levels.len() <= most);
    let found = found.unwrap_or_else(|| {
        let decades = on(&[1.0]);
        let every = decades.len().div_ceil(most.max(1));
        decades.into_iter().step_by(every).collect()
    });
    if found.is_empty() { vec![(low * high).sqrt()] } else { found }
}

/// Takes away what the powers of ten left behind the digits.
fn round(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let cases =
            [(0.12345, "0.123"), (0.0999999, "0.100"), (1234.5, "1234"), (-0.05, "-0.0500"), (9.999, "10.0")];
        for (value, text) in cases {
            assert_eq!(short(value), text);
        }
        assert_eq!((short(0.0), short(2.4e-7), short(f64::NAN)), ("0".into(), "2.4e-7".into(), "NaN".into()));
    }

    #[test]
    fn times_have_units() {
        assert_eq!([2.0, 0.012, 3e-5, 0.0].map(time), ["2.00 s", "12.0 ms", "30.0 µs", "0 ms"]);
    }

    #[test]
    fn levels_are_round_and_few() {
        assert_eq!(levels(0.009, 0.6, 6), [0.01, 0.02, 0.05, 0.1, 0.2, 0.5]);
        assert_eq!(levels(0.0009, 0.6, 6), [0.001, 0.003, 0.01, 0.03, 0.1, 0.3]);
        assert_eq!(levels(1e-9, 1.0, 5), [1e-9, 1e-7, 1e-5, 1e-3, 1e-1]);
        assert_eq!(levels(4.0, 4.5, 6).len(), 1);
        assert_eq!(levels(0.0, 4.5, 6), [0.0; 0]);
    }
}

//! Exponents of power laws: the slope of a line through points in log-log, by least squares.

/// The exponent `p` of `y = c x^p` that fits the points best, in logarithms. Points that are not both above 0 and finite
/// have no logarithm and are left out; `None` if fewer than two different x are left.
#[must_use]
pub fn exponent(points: impl IntoIterator<Item = (f64, f64)>) -> Option<f64> {
    let usable = |v: f64| v > 0.0 && v.is_finite();
    let logs: Vec<(f64, f64)> =
        points.into_iter().filter(|&(x, y)| usable(x) && usable(y)).map(|(x, y)| (x.ln(), y.ln())).collect();
    let count = logs.len() as f64;
    let mean_x = logs.iter().map(|p| p.0).sum::<f64>() / count;
    let mean_y = logs.iter().map(|p| p.1).sum::<f64>() / count;
    let spread: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    let common: f64 = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    (spread > 1e-12).then(|| common / spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(power: f64, noise: f64) -> impl Iterator<Item = (f64, f64)> {
        (0..5).map(move |i| {
            let x = 10f64.powi(i + 3);
            let wobble = if i % 2 == 0 { 1.0 + noise } else { 1.0 / (1.0 + noise) };
            (x, 3e-6 * x.powf(power) * wobble)
        })
    }

    #[test]
    fn known_exponents_are_found() {
        for power in [0.0, 0.5, 1.0, 1.3, 3.0, -1.0] {
            let found = exponent(law(power, 0.0)).unwrap();
            assert!((found - power).abs() < 1e-12, "{power}: {found}");
            let noisy = exponent(law(power, 0.1)).unwrap();
            assert!((noisy - power).abs() < 0.03, "{power}: {noisy}");
        }
    }

    #[test]
    fn a_constant_added_to_a_law_flattens_it() {
        let flat = exponent(law(1.0, 0.0).map(|(x, y)| (x, y + 1.0))).unwrap();
        assert!(flat < 0.7, "the negative control: {flat}");
    }

    #[test]
    fn least_squares_and_not_the_ends() {
        // (0,0), (1,1), (2,1) in log2: by hand (0-1)(0-2/3) + 0 + (2-1)(1-2/3) = 1, over 2.
        let found = exponent([(1.0, 1.0), (2.0, 2.0), (4.0, 2.0)]).unwrap();
        assert!((found - 0.5).abs() < 1e-12, "{found}");
    }

    #[test]
    fn what_has_no_slope_has_none() {
        assert_eq!(exponent([]), None);
        assert_eq!(exponent([(2.0, 1.0)]), None);
        assert_eq!(exponent([(2.0, 1.0), (2.0, 3.0)]), None);
        assert_eq!(exponent([(2.0, 1.0), (4.0, 0.0), (0.0, 4.0), (8.0, f64::NAN)]), None);
    }
}

//! The arctangent as a polynomial: WGSL lets the built-in one err by 4096 units in the last place.

use super::real::Real;

/// `Q(t)`, with `t Q(t) = atan(sqrt t) / sqrt t - 1`, for `t` from 0 to 1.25; lowest power first.
///
/// A minimax fit of the value, to 1.2e-8, and of the slope, to 8e-8: differences of angles use the slope. A fit of the
/// value alone, two terms shorter, errs by 2e-6 in the slope, which shows in thin lights.
const Q: [f32; 10] = [
    -0.333_333_25,
    0.199_994_1,
    -0.142_742_28,
    0.110_120_69,
    -0.086_164_1,
    0.062_707_93,
    -0.037_888_978,
    0.016_734_54,
    -0.004_614_270_3,
    0.000_583_785_7,
];

/// `g(t) = t Q(t)`, the arctangent's excess.
#[inline(always)]
pub fn arctangent_excess<R: Real>(t: R) -> R {
    let mut q = t.splat(Q[9]);
    for k in (0..9).rev() {
        q = q.times_plus(t, t.splat(Q[k]));
    }
    q * t
}

/// `g(t) = t Q(t)` and its divided difference `(g(u) - g(t)) / (u - t)`, which stays exact where `u` comes close to `t`.
///
/// Horner's rule twice: the divided difference of a polynomial runs along its own partial sums.
#[inline(always)]
pub fn excess_and_slope<R: Real>(t: R, u: R) -> (R, R) {
    let mut slope = t.splat(Q[9]);
    let mut q = slope.times_plus(t, t.splat(Q[8]));
    for k in (0..8).rev() {
        slope = slope.times_plus(u, q);
        q = q.times_plus(t, t.splat(Q[k]));
    }
    (q * t, slope.times_plus(u, q))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fits_value_and_slope() {
        for i in 1..=1250 {
            let t = f64::from(i) / 1000.0;
            let exact = |t: f64| t.sqrt().atan() / t.sqrt() - 1.0;
            assert!(
                (f64::from(arctangent_excess(t as f32)) - exact(f64::from(t as f32))).abs() < 6e-8,
                "{t}"
            );
            let slope = (exact(t + 1e-4) - exact(t - 1e-4)) / 2e-4;
            let (_, found) = excess_and_slope((t - 1e-4) as f32, (t + 1e-4) as f32);
            assert!((f64::from(found) - slope).abs() < 3e-7, "{t}: {found} {slope}");
        }
    }
}

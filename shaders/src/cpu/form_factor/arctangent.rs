//! The arctangent as a polynomial: WGSL lets the built-in one err by 4096 units in the last place.

use super::real::Real;

/// `Q(t)`, with `t Q(t) = atan(sqrt t) / sqrt t - 1` for `t` from 0 to 1, to 1.5e-8; lowest power first.
///
/// Minimax fit. Degree 6 would err by 1e-7, which shows beside the rounding errors; degree 8 gains nothing in f32.
const Q: [f32; 8] = [
    -0.333_331_67,
    0.199_941_37,
    -0.142_142_1,
    0.106_789_43,
    -0.075_805_85,
    0.043_553_628,
    -0.016_581_241,
    0.002_974_605_2,
];

/// `g(t) = t Q(t)`, the arctangent's excess.
#[inline(always)]
pub fn arctangent_excess<R: Real>(t: R) -> R {
    let mut q = t.splat(Q[7]);
    for k in (0..7).rev() {
        q = q.times_plus(t, t.splat(Q[k]));
    }
    q * t
}

/// `g(t) = t Q(t)` and its divided difference `(g(u) - g(t)) / (u - t)`, which stays exact where `u` comes close to `t`.
///
/// Horner's rule twice: the divided difference of a polynomial runs along its own partial sums.
#[inline(always)]
pub fn excess_and_slope<R: Real>(t: R, u: R) -> (R, R) {
    let mut slope = t.splat(Q[7]);
    let mut q = slope.times_plus(t, t.splat(Q[6]));
    for k in (0..6).rev() {
        slope = slope.times_plus(u, q);
        q = q.times_plus(t, t.splat(Q[k]));
    }
    (q * t, slope.times_plus(u, q))
}

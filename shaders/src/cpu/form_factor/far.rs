//! A whole triangle, each of whose edges is seen under at most 45 degrees: nearly all pairs of a light and a point.

use super::arctangent::excess_and_slope;
use super::light::LightGeometry;
use super::real::{Real, Vector};

/// Least product of two corners' distances, light units: a receiver that nearly touches a corner may see all edges under
/// small angles, but there `1 / r^2` differs too much from corner to corner for its differences to be small.
const CLOSEST: f32 = 0.1;

/// `-2 pi F` of the unclipped triangle as seen from the origin, its first corner at `r` (light units), and whether all
/// its edges are seen under at most 45 degrees and none of its corners is close; if not, the sum is worth nothing.
///
/// Lambert's sum over the edges is `S = sum_ij w_ij n . (r_i x r_j)` with `w_ij = Theta_ij / |r_i x r_j|`. The first
/// corner is `r`, the others `r + h - p a` and `r + h + q a` with base `a`, altitude `h` and `p + q = 1`. With
/// `A = r x a`, `H = r x h` and `N = h x a` the three cross products are `H - p A`, `N + A` and `-(H + q A)`, so
/// ```text
/// S = w12 n.N + (w01 - w20) n.H + (w12 - p w01 - q w20) n.A
/// ```
/// Each `w` is about `1/r^2`; only differences meet the large `A` and `H`, so nothing of size `size / r` is left to
/// cancel, which is what makes the textbook sum fail.
///
/// **The foot `f = r + h` of the altitude splits the base.** Angles along the base add, so `w12 = p w1f + q wf2`, and the
/// second difference falls into first differences between an edge and its neighbour, one altitude away:
/// ```text
/// w12 - p w01 - q w20 = p (w1f - w01) + q (wf2 - w20)
/// ```
/// So in a thin triangle every term is as small as the altitude, before anything is rounded. Write `w = (1 + g) / d`,
/// `d = r_i . r_j`, `g = t Q(t)` the arctangent's excess of `t = |r_i x r_j|^2 / d^2`. With `rho = r.r`, `y = r.a`,
/// `b = r.h` and `T = b + h.h`,
/// ```text
/// d01 = rho + b - p y     d20 = rho + b + q y     d1f = d01 + T     df2 = d20 + T
/// s01 = B + 2 p b y + p^2 A.A     s1f - s01 = p^2 a.a (b + T) - 2 p b y - B     B = H.H = rho h.h - b^2
/// s20 = B - 2 q b y + q^2 A.A     sf2 - s20 = q^2 a.a (b + T) + 2 q b y - B     A.A = rho a.a - y^2
/// w1f - w01 = ((g1f - g01) - (1 + g01) T / d01) / d1f      g1f - g01 = (t1f - t01) times a divided difference
/// ```
///
/// **The product of both cosines is taken out.** `r x (r x N) = r (r.N) - rho N` gives, for every `X`,
/// ```text
/// S = X (n.r) (N.r) + n.N (w12 - rho X) + n.H (w01 - w20 - y X) + n.A (p (w1f - w01) + q (wf2 - w20) + b X)
/// ```
/// With `X = 1 / (d01 d20)` each bracket is smaller than its first part by `size / r`, and has a closed form:
/// ```text
/// w12 - rho X   = X [p q rho y^2 / (d1f df2) + E (p/d1f + q/df2)] + p g1f/d1f + q gf2/df2,  E = (b - p y)(b + q y) - rho h.h
/// w01 - w20 - y X = g01/d01 - g20/d20
/// 1/d-part of the last = b X [p (T - y)/d1f + q (T + y)/df2] - h.h [p/(d01 d1f) + q/(d20 df2)]
/// ```
/// so that far away the error is relative to F, not to U.
#[inline(always)]
pub fn far_triangle<R: Real>(
    light: &LightGeometry,
    r: Vector<R>,
    n: Vector<R>,
    n_r: R,
    normal_r: R,
) -> (R, R::Mask) {
    let (base, altitude, normal) = (r.splat(light.base), r.splat(light.altitude), r.splat(light.normal));
    let (p, q) = (n_r.splat(light.before), n_r.splat(light.after));
    let (base_squared, altitude_squared) = (n_r.splat(light.base_squared), n_r.splat(light.altitude_squared));
    let around = n.cross(r);
    let (n_base, n_altitude) = (around.dot(base), around.dot(altitude));
    let rho = r.dot(r);
    let y = r.dot(base);
    let b = r.dot(altitude);
    let to_foot = b + altitude_squared;

    let d = rho + b;
    let (py, qy) = (p * y, q * y);
    let (d01, d20) = (d - py, d + qy);
    let (d1f, df2) = (d01 + to_foot, d20 + to_foot);
    // One division for two reciprocals.
    let (pair_1, pair_2) = (n_r.one() / (d01 * d1f), n_r.one() / (d20 * df2));
    let (i01, i1f, i20, if2) = (pair_1 * d1f, pair_1 * d01, pair_2 * df2, pair_2 * d20);

    let b_squared = rho.times_plus(altitude_squared, -(b * b));
    let a_squared = rho.times_plus(base_squared, -(y * y));
    let rise = base_squared * (b + to_foot);
    let twice_b = b + b;
    let (away_1, away_2) = (twice_b.times_plus(py, b_squared), (-twice_b).times_plus(qy, b_squared));
    let (pp, qq) = (p * p, q * q);
    let half_1 = Half::new(
        pp.times_plus(a_squared, away_1),
        pp.times_plus(rise, -away_1),
        [i01, i1f, pair_1],
        to_foot,
    );
    let half_2 = Half::new(
        qq.times_plus(a_squared, away_2),
        qq.times_plus(rise, -away_2),
        [i20, if2, pair_2],
        to_foot,
    );

    let x = i01 * i20;
    let (p_i1f, q_if2) = (p * i1f, q * if2);
    let e = (b - py).times_plus(b + qy, -(rho * altitude_squared));
    let bend = (rho * (p_i1f * y)).times_plus(q_if2 * y, e * (p_i1f + q_if2));
    let over_normal = x.times_plus(bend, p_i1f.times_plus(half_1.foot, q_if2 * half_2.foot));
    let over_altitude = half_1.edge.times_plus(i01, -(half_2.edge * i20));
    let steps = p_i1f.times_plus(half_1.step, q_if2 * half_2.step);
    let tilt = p_i1f.times_plus(to_foot - y, q_if2 * (to_foot + y));
    let width = p_i1f.times_plus(i01, q_if2 * i20);
    let over_base = (b * x).times_plus(tilt, (-altitude_squared).times_plus(width, steps));

    let rest = n_altitude.times_plus(over_altitude, n_base * over_base);
    let rest = n.dot(normal).times_plus(over_normal, rest);
    let sum = (x * n_r).times_plus(normal_r, rest);
    let closest = n_r.splat(CLOSEST);
    let is_far = closest.below(d01) & closest.below(d20) & closest.below(d1f) & closest.below(df2);
    (sum, is_far & half_1.is_small & half_2.is_small)
}

/// One half of the triangle, from the edge at the first corner to the base.
struct Half<R: Real> {
    /// `g` of the edge.
    edge: R,
    /// `g` of its part of the base.
    foot: R,
    /// `(g_foot - g_edge) - g_edge T / d_edge`.
    step: R,
    /// Both are seen under at most 45 degrees.
    is_small: R::Mask,
}

impl<R: Real> Half<R> {
    /// `s` is `|r_i x r_j|^2` of the edge and `i` its `1/d`, `s_step` what the base's part has more and `i_foot` its `1/d`,
    /// `pair` the product of both `1/d`.
    #[inline(always)]
    fn new(s: R, s_step: R, [i, i_foot, pair]: [R; 3], to_foot: R) -> Self {
        let t = s * (i * i);
        // t_foot - t = s_step / d_foot^2 - s T (1/d + 1/d_foot) / (d d_foot)
        let t_step = (s_step * i_foot).times_plus(i_foot, -(s * to_foot) * (pair * (i + i_foot)));
        let t_foot = t + t_step;
        let (edge, slope) = excess_and_slope(t, t_foot);
        let g_step = t_step * slope;
        let step = (-edge * to_foot).times_plus(i, g_step);
        let one = t.one();
        Self { edge, foot: edge + g_step, step, is_small: t.up_to(one) & t_foot.up_to(one) }
    }
}

//! A whole triangle, each of whose edges is seen under at most 45 degrees: nearly all pairs of a light and a point.

use glam::Vec3;

use super::arithmetic::{along, arctangent_excess, cross, dot, mul_add};
use super::light::LightGeometry;

/// Least product of two corners' distances, light units: a receiver that nearly touches a corner may see all edges under
/// small angles, but there `1 / r^2` differs too much from corner to corner for its differences to be small.
const CLOSEST: f32 = 0.1;

/// `-2 pi F` of the unclipped triangle as seen from the origin, its first corner at `r` (light units), and whether all
/// its edges are seen under at most 45 degrees and none of its corners is close; if not, the sum is worth nothing.
///
/// Lambert's sum over the edges is `S = sum_ij w_ij n . (r_i x r_j)` with `w_ij = Theta_ij / |r_i x r_j|`. The first
/// corner is `r`, the others `r + h - p a` and `r + h + q a` with base `a`, altitude `h` and `p + q = 1`. With `A = r x a`,
/// `H = r x h` and `N = h x a` the three cross products are `H - p A`, `N + A` and `-(H + q A)`, so
/// ```text
/// S = w12 n.N + (w01 - w20) n.H + (w12 - p w01 - q w20) n.A
/// ```
/// Each `w` is about `1/r^2`, and only their differences meet the large `A` and `H`: nothing of size `size / r` is left to
/// cancel, which is what makes the textbook sum fail, and nothing as large as the edges of a thin triangle meets a first
/// difference, which is what the sum by edges suffers from. The differences must not be formed by subtraction. With
/// `d_ij = r_i . r_j`, `t = |r_i x r_j|^2 / d^2` and `atan(sqrt t) = sqrt t (1 + t Q(t))`,
/// ```text
/// w = 1/d + g,   g = t Q(t) / d
/// D = r.r + r.h,   y = r.a,   d01 = D - p y,   d20 = D + q y,   d12 = d01 + d20 - D + h.(r + h) - p q a.a
/// 1/d01 - 1/d20           = y / (d01 d20)
/// 1/d12 - p/d01 - q/d20   = -(D h.(r + h) + p q (y^2 - D a.a)) / (d01 d12 d20)      as p/d01 + q/d20 = D/(d01 d20)
/// ```
/// and the differences of `g` are of third order and may be subtracted.
#[inline(always)]
pub fn far_triangle<const FUSED: bool>(light: &LightGeometry, r: Vec3, n: Vec3) -> (f32, bool) {
    let LightGeometry { base, before, altitude, after, normal, .. } = *light;
    let r_base = cross::<FUSED>(r, base);
    let r_altitude = cross::<FUSED>(r, altitude);
    let c01 = along::<FUSED>(r_altitude, -before, r_base);
    let c20 = along::<FUSED>(r_altitude, after, r_base);
    let c12 = normal + r_base;

    let y = dot::<FUSED>(r, base);
    let h = dot::<FUSED>(r, altitude);
    let to_foot = h + light.altitude_squared;
    let d = dot::<FUSED>(r, r) + h;
    let d01 = mul_add::<FUSED>(-before, y, d);
    let d20 = mul_add::<FUSED>(after, y, d);
    let shares = before * after;
    let base_squared = dot::<FUSED>(base, base);
    let d12 = mul_add::<FUSED>(-shares, base_squared, (d01 + d20) - d + to_foot);

    let (i01, i12, i20) = (1.0 / d01, 1.0 / d12, 1.0 / d20);
    let t01 = dot::<FUSED>(c01, c01) * i01 * i01;
    let t12 = dot::<FUSED>(c12, c12) * i12 * i12;
    let t20 = dot::<FUSED>(c20, c20) * i20 * i20;
    let g01 = arctangent_excess::<FUSED>(t01) * i01;
    let g12 = arctangent_excess::<FUSED>(t12) * i12;
    let g20 = arctangent_excess::<FUSED>(t20) * i20;

    let i01_i20 = i01 * i20;
    let first = mul_add::<FUSED>(y, i01_i20, g01 - g20);
    let bend = mul_add::<FUSED>(d, to_foot, shares * mul_add::<FUSED>(y, y, -(d * base_squared)));
    let bend_g = mul_add::<FUSED>(-before, g01, mul_add::<FUSED>(-after, g20, g12));
    let second = mul_add::<FUSED>(-bend * i12, i01_i20, bend_g);

    let tail = mul_add::<FUSED>(dot::<FUSED>(n, r_altitude), first, dot::<FUSED>(n, r_base) * second);
    let sum = mul_add::<FUSED>(dot::<FUSED>(n, normal), i12 + g12, tail);
    let is_far =
        (d01 > CLOSEST) & (d12 > CLOSEST) & (d20 > CLOSEST) & (t01 <= 1.0) & (t12 <= 1.0) & (t20 <= 1.0);
    (sum, is_far)
}

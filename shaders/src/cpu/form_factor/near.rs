//! What is close to the point or crosses its horizon: the whole light, or the one or two triangles that
//! [`super::clip`] leaves of it.

use std::f32::consts::FRAC_PI_2;

use super::arctangent::{arctangent_excess, excess_and_slope};
use super::clip::Polygon;
use super::light::LightGeometry;
use super::real::{Real, Vector, turn};

/// Keeps quotients finite where a corner or an edge meets the point; far below anything that f32 resolves there.
const TINY: f32 = 1e-30;

/// Least square of the distance to a corner, over altitude times base and the sine of the corner's angle, for the sum by
/// differences: closer, weights differ so much from corner to corner that their differences are no smaller than what they
/// come from. Higher values leave thin triangles to the plain sum's cancellation, lower ones compact triangles to that of
/// large weights.
const NEAREST_OVER_AREA: f32 = 0.3;

/// The same for an edge that is seen under more than 90 degrees and may pass closer than its ends.
const NEAREST_EDGE: f32 = 0.12;

/// How far beyond 1 the arctangent's fit may be used: the edges of a thin triangle seen under nearly 90 degrees lie on
/// either side of it.
const GREATEST_ARGUMENT: f32 = 1.2;

/// `-pi F` of a whole light above the horizon; `corners` are the light's, light units.
///
/// By differences where they are good, else the plain sum over the edges: so close that nothing cancels.
#[inline(always)]
pub fn whole_sum<R: Real>(light: &LightGeometry, corners: [Vector<R>; 3], n: Vector<R>) -> R {
    let triangle = Triangle::whole(light, corners);
    let (sum, is_good) = triangle.sum(n);
    if !sum.any(!is_good) {
        return sum;
    }
    let [e01, e02] = light.edges();
    let edges = [n.splat(e01), triangle.base, -n.splat(e02)];
    let never = sum.below(sum);
    R::select(is_good, sum, plain_sum(corners, edges, [never; 3], n))
}

/// `-pi F` of what the horizon leaves of a light.
#[inline(always)]
pub fn polygon_sum<R: Real>(light: &LightGeometry, polygon: &Polygon<R>, n: Vector<R>) -> R {
    let [q0, q1, q2, q3] = polygon.corners;
    let [e0, e1, e2, e3] = polygon.edges;
    let is_quad = polygon.is_quad;
    let diagonal = e0 + e1;
    let last = Vector::select(is_quad, -diagonal, e3);
    let first = Triangle::part(light, [q0, q1, q2], [e0, e1, last], polygon.shares[0]);
    let (mut sum, mut is_good) = first.sum(n);
    if sum.any(is_quad) {
        let second = Triangle::part(light, [q0, q2, q3], [diagonal, e2, e3], polygon.shares[1]);
        let (sum_2, is_good_2) = second.sum(n);
        sum = sum + R::select(is_quad, sum_2, sum.zero());
        is_good = is_good & (is_good_2 | !is_quad);
    }
    if !sum.any(!is_good) {
        return sum;
    }
    R::select(is_good, sum, plain_sum(polygon.corners, polygon.edges, polygon.is_horizon, n))
}

/// A triangle above the horizon, by base and altitude as [`LightGeometry`], light units.
#[derive(Clone, Copy, Debug)]
struct Triangle<R: Real> {
    /// As seen from the point; the first lies opposite the base.
    corners: [Vector<R>; 3],
    base: Vector<R>,
    before: R,
    altitude: Vector<R>,
    after: R,
    normal: Vector<R>,
    base_squared: R,
}

impl<R: Real> Triangle<R> {
    #[inline(always)]
    fn whole(light: &LightGeometry, corners: [Vector<R>; 3]) -> Self {
        let r = corners[0];
        Self {
            corners,
            base: r.splat(light.base),
            before: r.x.splat(light.before),
            altitude: r.splat(light.altitude),
            after: r.x.splat(light.after),
            normal: r.splat(light.normal),
            base_squared: r.x.splat(light.base_squared),
        }
    }

    /// `edges` run from each corner to the next; `share` is its area over the light's.
    ///
    /// The altitude comes from the area and not from the edges, whose long sides would leave it no digits.
    #[inline(always)]
    fn part(light: &LightGeometry, corners: [Vector<R>; 3], edges: [Vector<R>; 3], share: R) -> Self {
        let [e0, e1, e2] = edges;
        let (l0, l1, l2) = (e0.dot(e0), e1.dot(e1), e2.dot(e2));
        let base_is_2 = l0.below(l2) & l1.below(l2);
        let base_is_1 = !base_is_2 & l0.below(l1);
        let which = [base_is_1, base_is_2];
        let [base, to_apex, from_apex] = Vector::turn(which, edges);
        let [before, after, apex] = Vector::turn(which, corners);
        let [base_squared, _, _] = turn(which, [l0, l1, l2]);
        let inverse = share.one() / base_squared.at_least(TINY);
        let normal = base.splat(light.normal) * share;
        Self {
            corners: [apex, before, after],
            base,
            before: -from_apex.dot(base) * inverse,
            altitude: base.cross(normal) * inverse,
            after: -to_apex.dot(base) * inverse,
            normal,
            base_squared,
        }
    }

    /// `-pi F`, and whether it is any good.
    ///
    /// [`super::far::far_triangle`] without the cosines' product and by half angles, which reach twice as far:
    /// `W = w/2 = atan(|c| / k) / |c|` with `k = |r_i| |r_j| + r_i . r_j`. With `f = r + h` the foot of the altitude and
    /// `W12 = p W1f + q Wf2`,
    /// ```text
    /// S/2 = n.N W12 + n.H (W01 - W20) + n.A (p (W1f - W01) + q (Wf2 - W20))
    /// ```
    #[inline(always)]
    fn sum(&self, n: Vector<R>) -> (R, R::Mask) {
        let Self { corners: [r0, r1, r2], base, before: p, altitude, after: q, normal, base_squared } = *self;
        let foot = r0 + altitude;
        let squares = [r0.dot(r0), r1.dot(r1), r2.dot(r2)];
        let lengths = [squares[0].root(), squares[1].root(), squares[2].root()];
        let foot_square = foot.dot(foot);
        let foot_length = foot_square.root();
        let r_base = r0.cross(base);
        let r_altitude = r0.cross(altitude);
        let apex = Apex {
            r: r0,
            length: lengths[0],
            // |f| - |r|
            stretch: altitude.dot(foot + r0) / (foot_length + lengths[0]).at_least(TINY),
            altitude,
            base,
            r_altitude,
            foot_base: r_base + normal,
            normal,
        };
        let area = (altitude.dot(altitude) * base_squared).root();
        let reach = area * area.splat(NEAREST_OVER_AREA);
        let edge_reach = area * area.splat(NEAREST_EDGE);
        let half_1 = apex.half(r1, lengths[1], -p, edge_reach);
        let half_2 = apex.half(r2, lengths[2], q, edge_reach);

        // k20 - k01 = |r| (|r2| - |r1|) + r.a
        let spread = base.dot(r1 + r2) / (lengths[1] + lengths[2]).at_least(TINY);
        let k_step = lengths[0].times_plus(spread, r0.dot(base));
        let by_difference =
            (k_step * half_1.inverse).times_plus(half_2.inverse, half_1.excess - half_2.excess);
        let across =
            R::select(half_1.is_small & half_2.is_small, by_difference, half_1.weight - half_2.weight);
        let steps = p.times_plus(half_1.step, q * half_2.step);
        let along_base = p.times_plus(half_1.weight, q.times_plus(half_2.weight, steps));

        let tail = n.dot(r_altitude).times_plus(across, n.dot(r_base) * steps);
        let sum = n.dot(normal).times_plus(along_base, tail);
        let is_far = reach.below(squares[0])
            & (reach * half_1.sine).below(squares[1])
            & (reach * half_2.sine).below(squares[2]);
        let is_far = is_far & reach.below(foot_square);
        (sum, is_far & half_1.is_good & half_2.is_good)
    }
}

/// What both halves of a triangle share.
struct Apex<R: Real> {
    r: Vector<R>,
    length: R,
    /// `|f| - |r|`.
    stretch: R,
    altitude: Vector<R>,
    base: Vector<R>,
    r_altitude: Vector<R>,
    /// `f x a = r x a + N`.
    foot_base: Vector<R>,
    normal: Vector<R>,
}

/// The edge from the apex to one end of the base.
struct Half<R: Real> {
    /// `W = w/2` of the edge.
    weight: R,
    /// `W` of the part of the base from its end to the foot, less `weight`.
    step: R,
    /// `1/k` of the edge, where `is_small`.
    inverse: R,
    /// `W - 1/k` of the edge, where `is_small`.
    excess: R,
    /// Sine of the triangle's angle at the base's end.
    sine: R,
    /// Both angles are at most 90 degrees.
    is_small: R::Mask,
    /// Both arguments lie within the arctangent's fit.
    is_good: R::Mask,
}

impl<R: Real> Apex<R> {
    /// `end` is the base's end at `foot + share base`.
    ///
    /// With `c = r x end = H + m A`, `c_f = f x end = m (A + N)` and `m = share`,
    /// ```text
    /// k_f - k = |end| (|f| - |r|) + end.h        |c_f|^2 - |c|^2 = (m N - H) . (c_f + c)
    /// up to 90 degrees   W = (1 + g(t)) i,               i = 1/k,       t = |c|^2 i^2
    /// above              W = pi / (2 |c|) - (1 + g(t)) i,  i = k / |c|^2,  t = k i
    /// ```
    #[inline(always)]
    fn half(&self, end: Vector<R>, end_length: R, share: R, edge_reach: R) -> Half<R> {
        let k_step = end_length.times_plus(self.stretch, end.dot(self.altitude));
        let edge = self.altitude.along(share, self.base);
        // From the nearer end, as the other would leave it no digits.
        let c = Vector::select(self.length.below(end_length), self.r, end).cross(edge);
        let c_foot = self.foot_base * share;
        let c_foot_edge = share * share * self.base.dot(self.base);
        let s = c.dot(c);
        let s_step = (self.normal * share - self.r_altitude).dot(c_foot + c);
        let k = half_angle_k(s, self.length * end_length, self.r.dot(end));
        let (k_foot, s_foot) = ((k + k_step).at_least(TINY), (s + s_step).at_least(TINY));
        let (k, s) = (k.at_least(TINY), s.at_least(TINY));

        let is_small = s.up_to(k * k) & s_foot.up_to(k_foot * k_foot);
        let inverse = k.one() / R::select(is_small, k, s);
        let inverse_foot = k.one() / R::select(is_small, k_foot, s_foot);
        // (i_f - i) / (i i_f): -(k_f - k), or k_f s - k s_f.
        let i_change = R::select(is_small, -k_step, k_step.times_plus(s, -(k * s_step)));
        let i_step = i_change * inverse * inverse_foot;
        let i = R::select(is_small, inverse, k * inverse);
        let i_foot = R::select(is_small, inverse_foot, k_foot * inverse_foot);
        let t = R::select(is_small, s * inverse * inverse, k * i);
        let t_step = R::select(
            is_small,
            (s_step * i_foot).times_plus(i_foot, s * i_step * (i + i_foot)),
            k_step.times_plus(i_foot, k * i_step),
        );
        let (excess, slope) = excess_and_slope(t, t + t_step);
        let core = excess.times_plus(i, i);
        let core_step = i_step.times_plus(excess, i_step) + i_foot * t_step * slope;
        let (c_length, foot_length) = (s.root(), s_foot.root());
        let right = k.splat(FRAC_PI_2) / c_length;
        let right_step = -right * s_step / (foot_length * (c_length + foot_length));
        let limit = k.splat(GREATEST_ARGUMENT);
        // Seen under more than 90 degrees, an edge may pass closer than its ends.
        let edge_squared = edge.dot(edge).at_least(TINY);
        let passes_far = (edge_reach * edge_squared).below(s) & (edge_reach * c_foot_edge).below(s_foot);
        Half {
            weight: R::select(is_small, core, right - core),
            step: R::select(is_small, core_step, right_step - core_step),
            inverse,
            excess: excess * i,
            sine: (self.altitude.dot(self.altitude) / edge_squared).root(),
            is_small,
            is_good: t.up_to(limit) & (t + t_step).up_to(limit) & (is_small | passes_far),
        }
    }
}

/// Half the angle under which an edge is seen, and that angle over `|c|`.
struct HalfAngle<R> {
    angle: R,
    weight: R,
}

impl<R: Real> HalfAngle<R> {
    /// `atan(|c| / k)` with `c = p x q`, `s = |c|^2` and `k = |p| |q| + p . q`; `reach` is `|p| |q|`, `d` is `p . q`.
    #[inline(always)]
    fn new(s: R, reach: R, d: R) -> Self {
        let k = half_angle_k(s, reach, d);
        let is_small = s.up_to(k * k);
        let length = s.root();
        let inverse = s.one() / k.at_least(TINY);
        let inverse_length = s.one() / length.at_least(TINY);
        let ratio = R::select(is_small, length * inverse, k * inverse_length);
        let excess = arctangent_excess(ratio * ratio);
        let first = ratio.times_plus(excess, ratio);
        let large = s.splat(FRAC_PI_2) - first;
        Self {
            angle: R::select(is_small, first, large),
            weight: R::select(is_small, excess.times_plus(inverse, inverse), large * inverse_length),
        }
    }
}

/// `k = |p| |q| + p . q`; beyond a right angle that cancels, but `k (|p| |q| - p . q) = |p x q|^2` does not.
#[inline(always)]
fn half_angle_k<R: Real>(s: R, reach: R, d: R) -> R {
    R::select(d.below(d.zero()), s / (reach - d), reach + d)
}

/// `-pi F` as Lambert's sum over the edges, `sum W_i n . c_i`.
///
/// An edge along the horizon, as `is_horizon` marks them, adds `-|n|` times half its angle: `c` is parallel to `n`, which
/// its rounded numbers do not know. A point just above the light sees that edge pass it closely.
#[inline(always)]
fn plain_sum<R: Real, const N: usize>(
    corners: [Vector<R>; N],
    edges: [Vector<R>; N],
    is_horizon: [R::Mask; N],
    n: Vector<R>,
) -> R {
    let mut lengths = [n.x; N];
    for i in 0..N {
        lengths[i] = corners[i].dot(corners[i]).root();
    }
    let normal_length = n.dot(n).root();
    let mut sum = n.x.zero();
    for i in 0..N {
        let (p, q) = (corners[i], corners[(i + 1) % N]);
        // From the nearer end: from the other it would be rounded to that one's distance.
        let c = Vector::select(lengths[i].below(lengths[(i + 1) % N]), p, q).cross(edges[i]);
        let half = HalfAngle::new(c.dot(c), lengths[i] * lengths[(i + 1) % N], p.dot(q));
        let term = R::select(is_horizon[i], -(half.angle * normal_length), half.weight * n.dot(c));
        sum = sum + term;
    }
    sum
}

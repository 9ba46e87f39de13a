//! What is close to the point or crosses its horizon: the triangle clipped to a polygon of up to four edges.

use std::f32::consts::FRAC_PI_2;

use glam::Vec3;

use super::arithmetic::{along, arctangent_excess, cross, dot, mul_add};
use super::light::LightGeometry;

/// Keeps quotients finite where a corner or an edge meets the point; far below anything that f32 resolves there.
const TINY: f32 = 1e-30;

/// Least distance of a corner, light units, for the sum by differences: closer, `1 / r^2` differs so much from corner to
/// corner that the differences are no smaller than what they come from. More leaves thin lights to the plain sum's
/// cancellation.
const NEAREST_BY_DIFFERENCES: f32 = 0.25;

/// Up to four corners as seen from the point, and the edges between them: exact to their own length, not to that of
/// the corners.
#[derive(Clone, Copy, Debug)]
pub struct Polygon {
    /// Corner `i`; the last two agree in a triangle. Light units.
    pub corners: [Vec3; 4],
    /// From corner `i` to the next; the third is 0 in a triangle. Light units.
    pub edges: [Vec3; 4],
    /// Its area over the triangle's.
    pub share: f32,
    /// True for four corners.
    pub is_quad: bool,
}

/// How the light lies to the point's horizon, light units.
#[derive(Clone, Copy, Debug)]
pub struct Heights {
    /// Of the three corners.
    pub corners: [f32; 3],
    /// Along the three edges. Their sum is 0 to their own precision, not to that of the edges: all come from the rises
    /// along the base and the altitude. Cuts through a nearly level light would not close otherwise.
    pub rises: [f32; 3],
}

impl Heights {
    /// Seen from the origin, the light's first corner at `r`.
    #[inline(always)]
    pub fn new<const FUSED: bool>(light: &LightGeometry, r: Vec3, n: Vec3) -> Self {
        let first = dot::<FUSED>(n, r);
        let along_base = dot::<FUSED>(n, light.base);
        let along_altitude = dot::<FUSED>(n, light.altitude);
        let to_second = mul_add::<FUSED>(-light.before, along_base, along_altitude);
        let to_third = mul_add::<FUSED>(light.after, along_base, along_altitude);
        Self {
            corners: [first, first + to_second, first + to_third],
            rises: [to_second, along_base, -to_third],
        }
    }

    /// All corners above the horizon.
    #[inline(always)]
    pub fn all_above(&self) -> bool {
        let [z0, z1, z2] = self.corners;
        (z0 > 0.0) & (z1 > 0.0) & (z2 > 0.0)
    }

    /// At least one corner above the horizon.
    #[inline(always)]
    pub fn any_above(&self) -> bool {
        let [z0, z1, z2] = self.corners;
        (z0 > 0.0) | (z1 > 0.0) | (z2 > 0.0)
    }
}

/// The part of the light above the horizon; `r` are its corners in light units, of which one at least is above the
/// horizon.
///
/// Let A be the corner that is alone on its side of the horizon, and B, C the others. AB and AC cross the horizon at
/// `A + t_b AB` and `A + t_c AC`, `t_b = z_a / (z_a - z_b)`. Above it remain
/// ```text
/// all above      B, C, A, A                 edges BC,              CA,  0,          AB
/// A above        A + t_b AB, A + t_c AC, A, A     h,           t_c CA,  0,      t_b AB
/// A below        B, C, A + t_c AC, A + t_b AB    BC,     (1 - t_c) CA, -h, (1 - t_b) AB
/// ```
/// where `h = t_c AC - t_b AB = t_c BC + (t_c - t_b) AB` runs along the horizon; the second form cancels nothing, as
/// `t_c - t_b = t_b (z_c - z_b) / (z_a - z_c)`; where rounding puts a cut beyond its edge, that quotient means nothing and
/// the plain difference serves.
#[inline(always)]
pub fn clip_at_horizon<const FUSED: bool>(
    light: &LightGeometry,
    [r0, r1, r2]: [Vec3; 3],
    heights: &Heights,
) -> Polygon {
    let [e1, e2] = light.edges();
    let e12 = light.base;
    let above = heights.corners.map(|z| z > 0.0);
    let all = above[0] & above[1] & above[2];
    // The shortest edge is the first or the second: as AB, it keeps the two long ones next to one another.
    let second_is_shorter = light.after < light.before;
    let a_is_1 = !all & (above[1] != above[0]) & (above[1] != above[2]);
    let a_is_2 = (all & second_is_shorter) | (!all & (above[2] != above[0]) & (above[2] != above[1]));
    let pick = |at_0: Vec3, at_1: Vec3, at_2: Vec3| {
        let other = select3(a_is_1, at_1, at_0);
        select3(a_is_2, at_2, other)
    };
    let pick_scalar = |[z0, z1, z2]: [f32; 3]| select(a_is_2, z2, select(a_is_1, z1, z0));
    let [rise_01, rise_12, rise_20] = heights.rises;
    let (ab, bc, ca) = (pick(e1, e12, -e2), pick(e12, -e2, e1), pick(-e2, e1, e12));
    let (a, b, c) = (pick(r0, r1, r2), pick(r1, r2, r0), pick(r2, r0, r1));
    let z_a = pick_scalar(heights.corners);
    let (rise_ab, rise_bc, rise_ca) = (
        pick_scalar([rise_01, rise_12, rise_20]),
        pick_scalar([rise_12, rise_20, rise_01]),
        pick_scalar([rise_20, rise_01, rise_12]),
    );

    let a_above = z_a > 0.0;
    let t_b = select(all, 1.0, share_of(-z_a, rise_ab));
    let t_c = select(all, 1.0, share_of(z_a, rise_ca));
    // 1 - t, from the other end's height.
    let from_b = select(t_b > 0.0, share_of(z_a + rise_ab, rise_ab), 1.0);
    let from_c = select(t_c > 0.0, share_of(rise_ca - z_a, rise_ca), 1.0);
    let cuts_inside = (t_b < 1.0) & (t_c < 1.0) & (t_b > 0.0) & (t_c > 0.0);
    let h = along::<FUSED>(bc * t_c, select(cuts_inside, t_b * (rise_bc / rise_ca), t_c - t_b), ab);
    let (cut_b, cut_c) = (along::<FUSED>(a, t_b, ab), along::<FUSED>(a, -t_c, ca));
    let is_quad = !a_above;
    let (share_b, share_c) = (select(is_quad, from_b, t_b), select(is_quad, from_c, t_c));
    Polygon {
        corners: [
            select3(is_quad | all, b, cut_b),
            select3(is_quad | all, c, cut_c),
            select3(is_quad, cut_c, a),
            select3(is_quad, cut_b, a),
        ],
        edges: [select3(is_quad | all, bc, h), ca * share_c, select3(is_quad, -h, Vec3::ZERO), ab * share_b],
        share: select(is_quad, mul_add::<FUSED>(1.0 - share_b, share_c, share_b), share_b * share_c),
        is_quad,
    }
}

/// Half of `w = Theta / |c|` of one edge, and what its differences are made of.
#[derive(Clone, Copy, Debug)]
struct EdgeWeight {
    /// `1/k`, with `k = |p| |q| + p . q = |p| |q| (1 + cos Theta)`.
    inverse: f32,
    /// `w/2 - 1/k`, accurate where `is_far`.
    excess: f32,
    /// `w/2`.
    half: f32,
    /// Seen under at most 90 degrees.
    is_far: bool,
}

/// `Theta = 2 atan(|c| / k)`, `c = p x q`: one arctangent up to 1 serves every angle,
/// `w/2 = (1 + t Q(t)) / k` with `t = |c|^2 / k^2` up to 90 degrees, and `(pi/2 - atan(k / |c|)) / |c|` above.
#[inline(always)]
fn edge_weight<const FUSED: bool>(c: Vec3, k: f32) -> EdgeWeight {
    let s = dot::<FUSED>(c, c);
    let is_far = s <= k * k;
    let inverse = 1.0 / k.max(TINY);
    let inverse_length = 1.0 / s.sqrt().max(TINY);
    let ratio = select(is_far, s.sqrt() * inverse, k * inverse_length);
    let excess = arctangent_excess::<FUSED>(ratio * ratio);
    let excess_far = excess * inverse;
    let half_near = (FRAC_PI_2 - mul_add::<FUSED>(ratio, excess, ratio)) * inverse_length;
    EdgeWeight { inverse, excess: excess_far, half: select(is_far, inverse + excess_far, half_near), is_far }
}

/// `-pi F` of a polygon that lies above the horizon; `n_normal` is `n . N` of the whole triangle.
///
/// As in [`super::far::far_triangle`], with `W_i = w_i / 2` and `P_i = n . (c_0 + .. + c_i)`, of which `P_3` is known,
/// ```text
/// sum_i W_i n.c_i = W_3 P_3 + (W_0 - W_1) P_0 + (W_1 - W_2) P_1 + (W_2 - W_3) P_2
/// ```
/// and differences of `1/k` come from those of `k`: for edges pq and qs, with `D = s - p`,
/// `k_qs - k_pq = |q| (|s| - |p|) + q.D`, `|s| - |p| = D.(s + p) / (|s| + |p|)`.
/// A triangle goes straight from `W_1` to `W_3`. Where an edge is seen under more than 90 degrees nothing cancels, and
/// the plain sum is the better one: the point may be so close that the `P_i` are far larger than the `n.c_i`.
#[inline(always)]
pub fn polygon_sum<const FUSED: bool>(polygon: &Polygon, n: Vec3, n_normal: f32) -> f32 {
    let Polygon { corners: q, edges: e, share, is_quad } = *polygon;
    let length = q.map(|q| dot::<FUSED>(q, q).sqrt());
    let mut flux = [0.0; 4];
    let mut weight = [EdgeWeight { inverse: 0.0, excess: 0.0, half: 0.0, is_far: true }; 4];
    for i in 0..4 {
        let next = (i + 1) % 4;
        let k = mul_add::<FUSED>(length[i], length[next], dot::<FUSED>(q[i], q[next]));
        let c = cross::<FUSED>(q[i], e[i]);
        flux[i] = dot::<FUSED>(n, c);
        weight[i] = edge_weight::<FUSED>(c, k);
    }
    let step = |from: usize, to_weight: EdgeWeight, mid: usize, p: usize, s: Vec3, s_length: f32, d: Vec3| {
        let stretch = dot::<FUSED>(d, s + q[p]) / (s_length + length[p]).max(TINY);
        let k_step = mul_add::<FUSED>(length[mid], stretch, dot::<FUSED>(q[mid], d));
        let inverse_step = k_step * weight[from].inverse * to_weight.inverse;
        inverse_step + (weight[from].excess - to_weight.excess)
    };
    let step_01 = step(0, weight[1], 1, 0, q[2], length[2], -(e[2] + e[3]));
    let after_1 = EdgeWeight {
        inverse: select(is_quad, weight[2].inverse, weight[3].inverse),
        excess: select(is_quad, weight[2].excess, weight[3].excess),
        ..weight[2]
    };
    let (s, s_length) = (select3(is_quad, q[3], q[0]), select(is_quad, length[3], length[0]));
    let step_1 = step(1, after_1, 2, 1, s, s_length, select3(is_quad, e[1] + e[2], -e[0]));
    let step_23 = select(is_quad, step(2, weight[3], 3, 2, q[0], length[0], e[2] + e[3]), 0.0);

    let total = n_normal * share;
    let mut sum = weight[3].half * total;
    sum = mul_add::<FUSED>(step_01, flux[0], sum);
    sum = mul_add::<FUSED>(step_1, flux[0] + flux[1], sum);
    sum = mul_add::<FUSED>(step_23, total - flux[3], sum);
    let mut plain = weight[0].half * flux[0];
    for i in 1..4 {
        plain = mul_add::<FUSED>(weight[i].half, flux[i], plain);
    }
    let nearest = length[0].min(length[1]).min(length[2]).min(length[3]);
    let all_far = (nearest > NEAREST_BY_DIFFERENCES)
        & weight[0].is_far
        & weight[1].is_far
        & weight[2].is_far
        & weight[3].is_far;
    select(all_far, sum, plain)
}

/// `part / whole`, kept within 0 to 1; 0 for 0 / 0, an edge within the horizon.
#[inline(always)]
fn share_of(part: f32, whole: f32) -> f32 {
    let t = part / whole;
    select(t > 0.0, select(t < 1.0, t, 1.0), 0.0)
}

#[inline(always)]
fn select(condition: bool, yes: f32, no: f32) -> f32 {
    if condition { yes } else { no }
}

#[inline(always)]
fn select3(condition: bool, yes: Vec3, no: Vec3) -> Vec3 {
    Vec3::new(select(condition, yes.x, no.x), select(condition, yes.y, no.y), select(condition, yes.z, no.z))
}

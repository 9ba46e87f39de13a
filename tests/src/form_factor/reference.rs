//! The form factor in f64: the truth that every f32 form is measured against.
//!
//! The same differences as the kernel's (`vlm_shaders::cpu::form_factor`), as the textbook sum fails in f64 too where
//! lights are small and far; but clipped, cut into triangles and rounded differently, and with the library's arctangent.
//! A test shows its own error against a multi-precision evaluation of the textbook sum.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::case::Case;

/// What a case should give.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth {
    /// The form factor, 0 to 1.
    pub form_factor: f64,
    /// Its measure: `1/pi` times the integral of `dA / r^2` over the light, that is the form factor without its
    /// cosines and horizon, at most 1, to within some per cent; times the length of the normal.
    pub uncosined: f64,
    /// True if the horizon cuts the light.
    pub crosses: bool,
    /// True if the cosines at the receiver and at the light, both towards the light's centroid, exceed 0.1, and no
    /// part of the light is cut off.
    pub is_well_seen: bool,
}

/// The truth of `case`, or `None` where an input is not finite or the light has no area.
#[must_use]
pub fn truth(case: &Case) -> Option<Truth> {
    let view = View::new(case)?;
    Some(truth_of(view.corners, view.edges, view.normal, case.n.as_dvec3()))
}

/// The form factors with the receiver moved by `step` metres to either side along each axis.
#[must_use]
pub fn truths_around(case: &Case, step: f64) -> Vec<f64> {
    let Some(view) = View::new(case) else { return Vec::new() };
    let n = case.n.as_dvec3();
    let moves = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
    let step = step * view.scale;
    moves.map(|way| form_factor_of(view.corners.map(|r| r + way * step), view.edges, view.normal, n)).to_vec()
}

/// A case in units of the light's size, as seen from the receiver.
struct View {
    /// Units per metre.
    scale: f64,
    corners: [DVec3; 3],
    edges: [DVec3; 3],
    normal: DVec3,
}

impl View {
    fn new(case: &Case) -> Option<Self> {
        let x = case.x.as_dvec3();
        let [v0, v1, v2] = case.corners.map(|v| v.as_dvec3());
        // A power of two rounds nothing.
        let scale = (-case.size().log2().round()).exp2();
        let corners = [v0 - x, v1 - x, v2 - x].map(|r| r * scale);
        let (e1, e2) = ((v1 - v0) * scale, (v2 - v0) * scale);
        let normal = e1.cross(e2);
        let is_sound = normal.length() > 0.0 && corners.iter().all(|r| r.is_finite()) && case.n.is_finite();
        is_sound.then_some(Self { scale, corners, edges: [e1, e2 - e1, -e2], normal })
    }
}

/// The form factor alone; `corners` relative to the receiver, `edges` from each corner to the next.
fn form_factor_of(corners: [DVec3; 3], edges: [DVec3; 3], normal: DVec3, n: DVec3) -> f64 {
    let heights = corners.map(|r| n.dot(r));
    if normal.dot(corners[0]) >= 0.0 || heights.iter().all(|&z| z <= 0.0) {
        return 0.0;
    }
    let parts = parts_above(corners, edges, normal, heights);
    let sum: f64 = parts.iter().flatten().map(|part| part.sum(n)).sum();
    (-sum / TAU).clamp(0.0, 1.0)
}

/// `corners` relative to the receiver, `edges` from each corner to the next.
#[must_use]
pub fn truth_of(corners: [DVec3; 3], edges: [DVec3; 3], normal: DVec3, n: DVec3) -> Truth {
    let heights = corners.map(|r| n.dot(r));
    let above = heights.iter().filter(|&&z| z > 0.0).count();
    let crosses = above == 1 || above == 2;
    if normal.dot(corners[0]) >= 0.0 || above == 0 {
        return Truth { crosses, ..Truth::default() };
    }
    let mut pieces = MOST_PIECES;
    let uncosined = uncosined_share(corners[0], edges[0], -edges[2], normal.length(), &mut pieces);
    let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
    let cosine_here = n.dot(centre) / (centre.length() * n.length());
    let cosine_there = -normal.dot(centre) / (centre.length() * normal.length());
    Truth {
        form_factor: form_factor_of(corners, edges, normal, n),
        uncosined: uncosined.min(PI) / PI * n.length(),
        crosses,
        is_well_seen: above == 3 && cosine_here > 0.1 && cosine_there > 0.1,
    }
}

/// A triangle above the horizon.
#[derive(Clone, Copy, Debug)]
struct Part {
    r: DVec3,
    e1: DVec3,
    e2: DVec3,
    normal: DVec3,
}

/// One or two triangles that make up the visible part, edges by scaling those of the light.
fn parts_above(r: [DVec3; 3], e: [DVec3; 3], normal: DVec3, z: [f64; 3]) -> [Option<Part>; 2] {
    let lone = |is_above: bool| (0..3).find(|&i| (z[i] > 0.0) == is_above);
    let next = |i: usize| (i + 1) % 3;
    match z.iter().filter(|&&z| z > 0.0).count() {
        3 => {
            let i = (0..3).min_by(|&i, &j| e[i].length().total_cmp(&e[j].length())).unwrap_or(0);
            [Some(Part { r: r[i], e1: e[i], e2: -e[next(next(i))], normal }), None]
        }
        1 => {
            let a = lone(true).unwrap_or(0);
            let (b, c) = (next(a), next(next(a)));
            let (t_b, t_c) = (z[a] / (z[a] - z[b]), z[a] / (z[a] - z[c]));
            [Some(Part { r: r[a], e1: e[a] * t_b, e2: e[c] * -t_c, normal: normal * (t_b * t_c) }), None]
        }
        _ => {
            let a = lone(false).unwrap_or(0);
            let (b, c) = (next(a), next(next(a)));
            let (s_b, s_c) = (z[b] / (z[b] - z[a]), z[c] / (z[c] - z[a]));
            let to_c_cut = e[b] + e[c] * s_c;
            let to_b_cut = e[a] * -s_b;
            [
                Some(Part { r: r[b], e1: e[b], e2: to_c_cut, normal: normal * s_c }),
                Some(Part { r: r[b], e1: to_c_cut, e2: to_b_cut, normal: normal * (s_b * (1.0 - s_c)) }),
            ]
        }
    }
}

impl Part {
    fn sum(&self, n: DVec3) -> f64 {
        let Self { r, e1, e2, normal } = *self;
        let (r1, r2) = (r + e1, r + e2);
        let (x1, x2, x12) = (r.cross(e1), r.cross(e2), r1.cross(e2 - e1));
        let d01 = r.dot(r1);
        let (d20, d12) = (r.dot(r2), r1.dot(r2));
        let (w01, w12, w20) = (Weight::new(x1, d01), Weight::new(x12, d12), Weight::new(x2, d20));
        // Next to a corner, differences of 1/r^2 are as large as what they come from.
        let nearest = r.length().min(r1.length()).min(r2.length());
        if !(w01.is_far && w12.is_far && w20.is_far && nearest > 0.25) {
            return w01.w * n.dot(x1) + w12.w * n.dot(x12) - w20.w * n.dot(x2);
        }
        let first = r1.dot(e2) / (d01 * d12) + (w01.excess - w12.excess);
        let second = -r2.dot(e1) / (d12 * d20) + (w12.excess - w20.excess);
        w12.w * n.dot(normal) + first * n.dot(x1) + second * n.dot(x2)
    }
}

/// `w = Theta / |c|`, and `w - 1/d` to its own precision where the edge is seen under at most 45 degrees.
struct Weight {
    w: f64,
    excess: f64,
    is_far: bool,
}

impl Weight {
    fn new(c: DVec3, d: f64) -> Self {
        let length = c.length();
        let is_far = d > 0.0 && length <= d;
        if is_far {
            let excess = arctangent_excess((length / d).powi(2)) / d;
            return Self { w: 1.0 / d + excess, excess, is_far };
        }
        let theta = FRAC_PI_2 - (d / length).atan();
        Self { w: if length > 0.0 { theta / length } else { 0.0 }, excess: 0.0, is_far }
    }
}

/// `atan(sqrt t) / sqrt t - 1`.
fn arctangent_excess(t: f64) -> f64 {
    if t > 0.02 {
        let y = t.sqrt();
        return y.atan() / y - 1.0;
    }
    -(1..=9).rev().fold(0.0, |sum, k| (1.0 / f64::from(2 * k + 1) - sum) * t)
}

/// Enough for every light of aspect up to 100; a longer needle close by has its measure rounded to the coarser pieces.
const MOST_PIECES: u32 = 300;

/// `integral of dA / r^2`, by halving the longest edge until a piece is smaller than half its distance; `twice_area` of
/// the piece.
fn uncosined_share(r: DVec3, e1: DVec3, e2: DVec3, twice_area: f64, pieces: &mut u32) -> f64 {
    let centre = r + (e1 + e2) / 3.0;
    let e12 = e2 - e1;
    let (l1, l2, l12) = (e1.length_squared(), e2.length_squared(), e12.length_squared());
    let here = 0.5 * twice_area / centre.length_squared();
    if l1.max(l2).max(l12) <= 0.25 * centre.length_squared() || *pieces == 0 {
        return here;
    }
    *pieces -= 1;
    let half = 0.5 * twice_area;
    let (first, second) = if l12 >= l1 && l12 >= l2 {
        let middle = e1 + e12 * 0.5;
        ((r, e1, middle), (r, middle, e2))
    } else if l1 >= l2 {
        ((r, e1 * 0.5, e2), (r + e1 * 0.5, e1 * 0.5, e2 - e1 * 0.5))
    } else {
        ((r, e1, e2 * 0.5), (r + e2 * 0.5, e1 - e2 * 0.5, e2 * 0.5))
    };
    let sum = uncosined_share(first.0, first.1, first.2, half, pieces);
    // 1 is the most that counts.
    if sum >= PI { sum } else { sum + uncosined_share(second.0, second.1, second.2, half, pieces) }
}

//! The part of a light above the point's horizon: a polygon of up to four edges.

use super::light::LightGeometry;
use super::real::{Real, Vector, turn};

/// Up to four corners as seen from the point, and the edges between them: exact to their own length, not to that of
/// the corners. Light units.
#[derive(Clone, Copy, Debug)]
pub struct Polygon<R: Real> {
    /// Corner `i`; the last two agree in a triangle.
    pub corners: [Vector<R>; 4],
    /// From corner `i` to the next; the third is 0 in a triangle.
    pub edges: [Vector<R>; 4],
    /// Areas, over the whole light's, of the triangles of corners 0, 1, 2 and 0, 2, 3; the second is 0 in a triangle.
    pub shares: [R; 2],
    /// True for four corners.
    pub is_quad: R::Mask,
    /// Which edges run along the horizon.
    pub is_horizon: [R::Mask; 4],
}

/// How the light lies to the point's horizon, light units.
#[derive(Clone, Copy, Debug)]
pub struct Heights<R: Real> {
    /// Of the three corners.
    pub corners: [R; 3],
    /// Along the three edges. Their sum is 0 to their own precision, not to that of the edges: all come from the rises
    /// along the base and the altitude. Cuts through a nearly level light would not close otherwise.
    pub rises: [R; 3],
}

impl<R: Real> Heights<R> {
    /// Seen from the origin, the light's first corner at `r`.
    #[inline(always)]
    pub fn new(light: &LightGeometry, r: Vector<R>, n: Vector<R>) -> Self {
        let first = n.dot(r);
        let along_base = n.dot(r.splat(light.base));
        let along_altitude = n.dot(r.splat(light.altitude));
        let to_second = (-along_base).times_plus(first.splat(light.before), along_altitude);
        let to_third = along_base.times_plus(first.splat(light.after), along_altitude);
        Self {
            corners: [first, first + to_second, first + to_third],
            rises: [to_second, along_base, -to_third],
        }
    }

    /// The same from the nearest of the corners, which knows how high a tip next to the point is; the others' heights are
    /// rounded to their own distance. Where the two disagree about which corners are above the horizon, the first
    /// corner's word counts, by which the light came here.
    #[inline(always)]
    pub fn from_nearest(light: &LightGeometry, corners: [Vector<R>; 3], n: Vector<R>) -> Self {
        let [r0, r1, r2] = corners;
        let from_first = Self::new(light, r0, n);
        let [rise_01, _, rise_20] = from_first.rises;
        let (l0, l1, l2) = (r0.dot(r0), r1.dot(r1), r2.dot(r2));
        let second = l1.below(l0) & l1.up_to(l2);
        let third = l2.below(l0) & l2.below(l1);
        let z0 = R::select(third, n.dot(r2) + rise_20, n.dot(r1) - rise_01);
        let from_nearest = Self {
            corners: [
                z0,
                R::select(second, n.dot(r1), z0 + rise_01),
                R::select(third, n.dot(r2), z0 - rise_20),
            ],
            ..from_first
        };
        let ([a0, a1, a2], [b0, b1, b2]) = (from_first.above(), from_nearest.above());
        let agree = ((a0 & b0) | !(a0 | b0)) & ((a1 & b1) | !(a1 | b1)) & ((a2 & b2) | !(a2 | b2));
        let use_nearest = agree & (second | third);
        let [y0, y1, y2] = from_first.corners;
        let [z0, z1, z2] = from_nearest.corners;
        Self {
            corners: [
                R::select(use_nearest, z0, y0),
                R::select(use_nearest, z1, y1),
                R::select(use_nearest, z2, y2),
            ],
            ..from_first
        }
    }

    /// Which corners are above the horizon.
    #[inline(always)]
    pub fn above(&self) -> [R::Mask; 3] {
        let [z0, z1, z2] = self.corners;
        [z0.is_above(), z1.is_above(), z2.is_above()]
    }

    /// All corners above the horizon.
    #[inline(always)]
    pub fn all_above(&self) -> R::Mask {
        let [z0, z1, z2] = self.above();
        z0 & z1 & z2
    }

    /// At least one corner above the horizon.
    #[inline(always)]
    pub fn any_above(&self) -> R::Mask {
        let [z0, z1, z2] = self.above();
        z0 | z1 | z2
    }

    /// Exactly two corners above the horizon.
    #[inline(always)]
    pub fn two_above(&self) -> R::Mask {
        let [z0, z1, z2] = self.above();
        ((z0 & z1) | (z1 & z2) | (z2 & z0)) & !(z0 & z1 & z2)
    }
}

/// The part above the horizon of a light that crosses it; `corners` are the light's, light units.
///
/// Let A be the corner that is alone on its side of the horizon, and B, C the others. AB and AC cross the horizon at
/// `A + t_b AB` and `A + t_c AC`, `t_b = z_a / (z_a - z_b)`. Above it remain
/// ```text
/// A above        A + t_b AB, A + t_c AC, A, A     h,           t_c CA,  0,      t_b AB
/// A below        B, C, A + t_c AC, A + t_b AB    BC,     (1 - t_c) CA, -h, (1 - t_b) AB
/// ```
/// where `h = t_c AC - t_b AB = t_c BC + (t_c - t_b) AB` runs along the horizon; the second form cancels nothing, as
/// `t_c - t_b = t_b (z_c - z_b) / (z_a - z_c)`; where rounding puts a cut beyond its edge, that quotient means nothing and
/// the plain difference serves.
#[inline(always)]
pub fn clip_at_horizon<R: Real>(
    light: &LightGeometry,
    corners: [Vector<R>; 3],
    heights: &Heights<R>,
) -> Polygon<R> {
    let r0 = corners[0];
    let [e01, e02] = light.edges();
    let (e01, e02) = (r0.splat(e01), r0.splat(e02));
    let e12 = r0.splat(light.base);
    let [_, above_1, above_2] = heights.above();
    let two = heights.two_above();
    // Alone: above where one is, below where two are.
    let which = [(above_1 & !two) | (!above_1 & two), (above_2 & !two) | (!above_2 & two)];
    let [ab, bc, ca] = Vector::turn(which, [e01, e12, -e02]);
    let [a, b, c] = Vector::turn(which, corners);
    let [z_a, _, _] = turn(which, heights.corners);
    let [rise_ab, rise_bc, rise_ca] = turn(which, heights.rises);

    let (zero, one) = (z_a.zero(), z_a.one());
    let t_b = share_of(-z_a, rise_ab);
    let t_c = share_of(z_a, rise_ca);
    // 1 - t, from the other end's height.
    let from_b = R::select(t_b.is_above(), share_of(z_a + rise_ab, rise_ab), one);
    let from_c = R::select(t_c.is_above(), share_of(rise_ca - z_a, rise_ca), one);
    let cuts_inside = t_b.below(one) & t_c.below(one) & t_b.is_above() & t_c.is_above();
    let h = (bc * t_c).along(R::select(cuts_inside, t_b * (rise_bc / rise_ca), t_c - t_b), ab);
    let (cut_b, cut_c) = (a.along(t_b, ab), a.along(-t_c, ca));
    let (share_b, share_c) = (R::select(two, from_b, t_b), R::select(two, from_c, t_c));
    let nothing = h * zero;
    let never = zero.below(zero);
    Polygon {
        corners: [
            Vector::select(two, b, cut_b),
            Vector::select(two, c, cut_c),
            Vector::select(two, cut_c, a),
            Vector::select(two, cut_b, a),
        ],
        edges: [Vector::select(two, bc, h), ca * share_c, Vector::select(two, -h, nothing), ab * share_b],
        shares: [R::select(two, share_c, share_b * share_c), R::select(two, t_c * share_b, zero)],
        is_quad: two,
        is_horizon: [!two, never, two, never],
    }
}

/// `part / whole`, kept within 0 to 1; 0 for 0 / 0, an edge within the horizon.
#[inline(always)]
fn share_of<R: Real>(part: R, whole: R) -> R {
    let t = part / whole;
    R::select(t.is_above(), R::select(t.below(t.one()), t, t.one()), t.zero())
}

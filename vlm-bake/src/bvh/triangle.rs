//! One triangle: where a ray meets it, and its point nearest to another.

use glam::{Vec3, Vec3A};

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// In multiples of the ray's direction, above 0.
    pub distance: f32,
    /// Weights of the three corners; they sum to 1.
    pub barycentric: Vec3,
    /// True if the ray meets the counter-clockwise side.
    pub front: bool,
}

/// Where the ray `origin + t * direction`, `t > 0`, meets the triangle, whichever side it shows.
///
/// With corners relative to the origin, the volume spanned by the ray and an edge from `a` to `b` is
/// `direction . ((b - a) x (b + a)) / 2`; a ray inside the triangle sees the same sign for all three edges (Plücker
/// coordinates; Benthin 2006, section 3.1). Swapping `a` and `b` negates the volume exactly, also in floating point,
/// so a ray never slips through the edge that two triangles share.
#[must_use]
#[inline]
pub fn intersect(corners: &[Vec3A; 3], origin: Vec3A, direction: Vec3A) -> Option<TriangleHit> {
    let [v0, v1, v2] = [corners[0] - origin, corners[1] - origin, corners[2] - origin];
    let (e0, e1, e2) = (v2 - v1, v0 - v2, v1 - v0);
    let w0 = e0.cross(v2 + v1).dot(direction);
    let w1 = e1.cross(v0 + v2).dot(direction);
    let w2 = e2.cross(v1 + v0).dot(direction);
    let smallest = w0.min(w1).min(w2);
    let largest = w0.max(w1).max(w2);
    if smallest < 0.0 && largest > 0.0 {
        return None;
    }
    let normal = e2.cross(-e1);
    let cosine = normal.dot(direction);
    let distance = normal.dot(v0) / cosine;
    let sum = w0 + w1 + w2;
    // Zero for triangles without area and for rays in the plane; NaN fails the comparison.
    if cosine == 0.0 || sum == 0.0 || !(distance > 0.0 && distance.is_finite()) {
        return None;
    }
    Some(TriangleHit { distance, barycentric: Vec3::new(w0, w1, w2) / sum, front: cosine < 0.0 })
}

/// The point of the triangle nearest to `p`: by the region of the triangle's plane over which `p` lies
/// (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
#[must_use]
#[inline]
pub fn closest_point(corners: &[Vec3A; 3], p: Vec3A) -> Vec3A {
    let [a, b, c] = *corners;
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * share(d1, d1 - d3);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * share(d2, d2 - d6);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * share(d4 - d3, (d4 - d3) + (d5 - d6));
    }
    let area = va + vb + vc;
    a + ab * share(vb, area) + ac * share(vc, area)
}

/// `part / whole` for `0 <= part <= whole`, 0 for triangles without extent.
fn share(part: f32, whole: f32) -> f32 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

//! Triangles, segments and solid angles, in double precision.

use std::f64::consts::TAU;

use glam::DVec3;

use super::Triangle;

/// Twice the area, along the normal.
pub fn cross([a, b, c]: Triangle) -> DVec3 {
    (b - a).cross(c - a)
}

/// The unit normal, 0 for a triangle without area.
pub fn unit_normal(triangle: Triangle) -> DVec3 {
    cross(triangle).normalize_or_zero()
}

/// Longest edge over the height on it.
pub fn aspect([a, b, c]: Triangle) -> f64 {
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    longest / cross([a, b, c]).length()
}

/// The place of a triangle that is nearest to `x`: its foot if that lies inside, else the nearest place of an edge.
pub fn closest_on([a, b, c]: Triangle, x: DVec3) -> DVec3 {
    let n = cross([a, b, c]);
    let inside = |p: DVec3, q: DVec3| (q - p).cross(x - p).dot(n) >= 0.0;
    if n != DVec3::ZERO && inside(a, b) && inside(b, c) && inside(c, a) {
        return x - n * ((x - a).dot(n) / n.length_squared());
    }
    let on_edge = |p: DVec3, q: DVec3| {
        let along = q - p;
        let length = along.length_squared();
        p + along * if length > 0.0 { ((x - p).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 }
    };
    let mut edges = [on_edge(a, b), on_edge(b, c), on_edge(c, a)];
    edges.sort_by(|p, q| p.distance_squared(x).total_cmp(&q.distance_squared(x)));
    edges[0]
}

/// A straight walk.
pub struct Segment {
    from: DVec3,
    low: DVec3,
    high: DVec3,
    /// From start to end, not of unit length.
    pub direction: DVec3,
}

impl Segment {
    pub fn new(from: DVec3, to: DVec3) -> Self {
        Self { from, low: from.min(to), high: from.max(to), direction: to - from }
    }

    /// The share of the walk after which it passes through the triangle: its ends lie on both sides of the plane, and the line passes
    /// all three edges on the same side (signs of the volumes that it spans with them).
    pub fn meets(&self, [a, b, c]: Triangle) -> Option<f64> {
        if a.max(b).max(c).cmplt(self.low).any() || a.min(b).min(c).cmpgt(self.high).any() {
            return None;
        }
        let n = cross([a, b, c]);
        let (start, end) = ((self.from - a).dot(n), (self.from + self.direction - a).dot(n));
        if start * end >= 0.0 {
            return None;
        }
        let side = |p: DVec3, q: DVec3| (p - self.from).cross(q - self.from).dot(self.direction);
        let sides = [side(a, b), side(b, c), side(c, a)];
        let passes = sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0);
        passes.then(|| start / (start - end))
    }
}

/// How often the triangles wind around a place: 1 inside a closed surface seen from outside, 0 outside it, -1 in a room (the
/// solid angle of van Oosterom and Strackee 1983 over the full sphere).
pub fn winding(triangles: &[Triangle], place: DVec3) -> f64 {
    let solid_angle = |t: &Triangle| {
        let [a, b, c] = t.map(|p| p - place);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let volume = a.dot(b.cross(c));
        let whole = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * volume.atan2(whole)
    };
    triangles.iter().map(solid_angle).sum::<f64>() / (2.0 * TAU)
}

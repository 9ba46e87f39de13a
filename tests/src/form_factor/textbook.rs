//! The form factor as textbooks and other renderers write it, in single precision: what the kernel is measured against.

use std::f32::consts::TAU;

use glam::Vec3;

use super::case::Case;

/// How the angle under which an edge is seen is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeForm {
    /// `acos(p . q)` of unit vectors: Baum, Rushmeier, Winget 1989.
    Acos,
    /// `atan2(|p x q|, p . q)`.
    Atan2,
    /// The rational fit of Heitz, Dupuy, Hill, Neubelt, "Real-time polygonal-light shading with linearly transformed
    /// cosines", 2016, as in the authors' published shader.
    LtcFit,
}

/// The form factor of a case, see [`textbook_form_factor`].
#[must_use]
pub fn textbook(form: EdgeForm, case: &Case) -> f32 {
    let [a, b, c] = case.corners;
    textbook_form_factor(form, case.corners, (b - a).cross(c - a), case.x, case.n)
}

/// `1/(2 pi)` times the sum over the edges of the polygon above the horizon of `Theta n . unit(p_i x p_j)`, each edge by
/// `form`, in single precision throughout. `normal` is the light's, of any length.
#[must_use]
pub fn textbook_form_factor(form: EdgeForm, corners: [Vec3; 3], normal: Vec3, x: Vec3, n: Vec3) -> f32 {
    let r = corners.map(|v| v - x);
    if normal.dot(r[0]) >= 0.0 {
        return 0.0;
    }
    let (polygon, count) = clip(r, n);
    let unit = polygon.map(|p| p / p.length());
    let mut sum = 0.0;
    for i in 0..count {
        sum += edge(form, unit[i], unit[(i + 1) % count], n);
    }
    (-sum / TAU).clamp(0.0, 1.0)
}

fn edge(form: EdgeForm, p: Vec3, q: Vec3, n: Vec3) -> f32 {
    let cross = p.cross(q);
    let length = cross.length();
    let theta_over_length = match form {
        EdgeForm::Acos if length > 0.0 => p.dot(q).clamp(-1.0, 1.0).acos() / length,
        EdgeForm::Atan2 if length > 0.0 => length.atan2(p.dot(q)) / length,
        EdgeForm::Acos | EdgeForm::Atan2 => 0.0,
        EdgeForm::LtcFit => ltc_fit(p.dot(q)) * TAU,
    };
    theta_over_length * n.dot(cross)
}

/// `Theta / (2 pi sin Theta)` from `x = cos Theta`.
fn ltc_fit(x: f32) -> f32 {
    let y = x.abs();
    let a = 0.854_398_5 + (0.496_515_5 + 0.014_520_6 * y) * y;
    let b = 3.417_594 + (4.161_672_4 + y) * y;
    let v = a / b;
    if x > 0.0 { v } else { 0.5 / (1.0 - x * x).max(1e-7).sqrt() - v }
}

/// Sutherland and Hodgman 1974 against the horizon: 0, 3 or 4 corners.
fn clip(r: [Vec3; 3], n: Vec3) -> ([Vec3; 4], usize) {
    let mut polygon = [Vec3::X; 4];
    let mut count = 0;
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        let (z_i, z_j) = (n.dot(r[i]), n.dot(r[j]));
        if z_i >= 0.0 && count < 4 {
            polygon[count] = r[i];
            count += 1;
        }
        if (z_i >= 0.0) != (z_j >= 0.0) && count < 4 {
            polygon[count] = r[i] + (r[j] - r[i]) * (z_i / (z_i - z_j));
            count += 1;
        }
    }
    (polygon, count)
}

//! Points on the visible surface: spread evenly over its area, and at its vertices and edges.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::patches::Patches;
use crate::topology::cross_of;

/// A point on the visible surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// World space, metres.
    pub position: DVec3,
    /// Where the point looks for its light, and a sample would be: the same, or a little inside the triangle where it lies on an edge.
    pub inner: DVec3,
    /// Unit geometric normal, on the side that reflects.
    pub normal: DVec3,
    /// Index into [`Patches::triangles`].
    pub triangle: u32,
    /// Barycentric weights of the triangle's corners, in the scene's order.
    pub barycentric: Vec3,
    /// The area for which the point stands, in square metres.
    pub area: f64,
    /// On the back of a two-sided surface.
    pub back: bool,
}

/// A point whose least barycentric weight is at most this lies on an edge of its triangle.
const ON_EDGE: f32 = 1e-4;

/// The inner place of a point on an edge lies at most this share of the way to the middle of its triangle.
const INNER_SHARE: f64 = 0.1;

impl SurfacePoint {
    /// Moves the inner place of a point on an edge or vertex, where several surfaces meet, into its triangle, by at most `most`
    /// metres.
    pub fn move_inside(&mut self, patches: &Patches, most: f64) {
        if self.barycentric.min_element() > ON_EDGE {
            return;
        }
        let centre = patches.corners(self.triangle as usize).iter().sum::<DVec3>() / 3.0;
        self.inner = self.position + ((centre - self.position) * INNER_SHARE).clamp_length_max(most);
    }
}

/// At least `count` points, area-uniform: one at every equal step of the area summed over the triangles, placed within its
/// triangle by a low-discrepancy sequence.
#[must_use]
pub fn spread_points(patches: &Patches, count: usize) -> Vec<SurfacePoint> {
    let areas: Vec<f64> = (0..patches.triangles.len()).into_par_iter().map(|t| patches.area(t)).collect();
    let (drawn, step) = area_steps(&areas, count);
    let mut points = Vec::with_capacity(count + count / 8);
    for triangle in drawn {
        place(patches, triangle as usize, points.len() as u64, step, &mut points);
    }
    points
}

/// The triangle at each of `count` equal steps of the area summed over triangles, and the step; none without area.
#[must_use]
pub fn area_steps(areas: &[f64], count: usize) -> (Vec<u32>, f64) {
    let step = areas.iter().sum::<f64>() / count.max(1) as f64;
    let mut drawn = Vec::with_capacity(count + 1);
    if step <= 0.0 {
        return (drawn, step);
    }
    let mut ahead = 0.5 * step;
    for (triangle, area) in areas.iter().enumerate() {
        while ahead < *area {
            drawn.push(triangle as u32);
            ahead += step;
        }
        ahead -= area;
    }
    (drawn, step)
}

/// Adds one point of a triangle; on a two-sided surface one for each side.
fn place(patches: &Patches, triangle: usize, index: u64, area: f64, points: &mut Vec<SurfacePoint>) {
    let [a, b, c] = patches.corners(triangle);
    let Some(normal) = cross_of([a, b, c]).try_normalize() else { return };
    let (u, v) = fold(plastic(index));
    let position = a * (1.0 - u - v) + b * u + c * v;
    let barycentric = Vec3::new((1.0 - u - v) as f32, u as f32, v as f32);
    let front = SurfacePoint {
        position,
        inner: position,
        normal,
        triangle: triangle as u32,
        barycentric,
        area,
        back: false,
    };
    points.push(front);
    if patches.region(triangle).two_sided {
        points.push(SurfacePoint { normal: -normal, back: true, ..front });
    }
}

/// The additive recurrence on the plastic number (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences"): low
/// discrepancy in the unit square at any length.
fn plastic(index: u64) -> (f64, f64) {
    const PLASTIC: f64 = 1.324_717_957_244_746;
    let at = |step: f64| (0.5 + index as f64 * step).fract();
    (at(1.0 / PLASTIC), at(1.0 / (PLASTIC * PLASTIC)))
}

/// Folds the unit square onto the triangle `u, v >= 0, u + v <= 1`.
fn fold((u, v): (f64, f64)) -> (f64, f64) {
    if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) }
}

/// Weights of the corners of a triangle, the `index`-th of a sequence that is uniform over it.
#[must_use]
pub fn uniform_barycentric(index: u64) -> Vec3 {
    let (u, v) = fold(plastic(index));
    Vec3::new((1.0 - u - v) as f32, u as f32, v as f32)
}

/// `count` points spread evenly over one triangle.
pub fn spread_over([a, b, c]: [DVec3; 3], count: u32) -> impl Iterator<Item = DVec3> {
    (0..u64::from(count)).map(move |index| {
        let (u, v) = fold(plastic(index));
        a * (1.0 - u - v) + b * u + c * v
    })
}

/// The middle of a triangle, on each side that reflects; none if it has no area.
#[must_use]
pub fn centre_points(patches: &Patches, triangle: usize) -> Vec<SurfacePoint> {
    let corners = patches.corners(triangle);
    let Some(normal) = cross_of(corners).try_normalize() else { return Vec::new() };
    let position = corners.iter().sum::<DVec3>() / 3.0;
    let front = SurfacePoint {
        position,
        inner: position,
        normal,
        triangle: triangle as u32,
        barycentric: Vec3::splat(1.0 / 3.0),
        area: patches.area(triangle),
        back: false,
    };
    let back = SurfacePoint { normal: -normal, back: true, ..front };
    if patches.region(triangle).two_sided { vec![front, back] } else { vec![front] }
}

/// A point at every vertex and at the middle of every edge, on each side that reflects, once for each plane that meets there:
/// where area-uniform points miss the extremes of a surface. They stand for no area.
#[must_use]
pub fn feature_points(patches: &Patches) -> Vec<SurfacePoint> {
    let mut features = Features::default();
    for triangle in 0..patches.triangles.len() {
        let corners = patches.corners(triangle);
        let Some(normal) = cross_of(corners).try_normalize() else { continue };
        let vertices = patches.triangles[triangle];
        for side in 0..3 {
            let next = (side + 1) % 3;
            let (from, to) = (vertices[side], vertices[next]);
            let (mut corner, mut middle) = (Vec3::ZERO, Vec3::ZERO);
            corner[side] = 1.0;
            (middle[side], middle[next]) = (0.5, 0.5);
            let bare = SurfacePoint {
                position: corners[side],
                inner: corners[side],
                normal,
                triangle: triangle as u32,
                barycentric: corner,
                area: 0.0,
                back: false,
            };
            features.add(patches, (from, from), bare);
            let position = (corners[side] + corners[next]) / 2.0;
            let middle = SurfacePoint { position, inner: position, barycentric: middle, ..bare };
            features.add(patches, (from.min(to), from.max(to)), middle);
        }
    }
    features.points
}

/// Two planes count as one where the cosine between them is above this: a thousandth of a radian.
const ONE_PLANE_COSINE: f64 = 1.0 - 5e-7;

/// The points at vertices and edges so far.
#[derive(Default)]
struct Features {
    points: Vec<SurfacePoint>,
    /// By place (a vertex twice, or the two of an edge) and region: the last point there, and before it the others.
    last: FxHashMap<((u32, u32), u32), u32>,
    before: Vec<u32>,
}

impl Features {
    fn add(&mut self, patches: &Patches, place: (u32, u32), point: SurfacePoint) {
        let key = (place, patches.triangle_region[point.triangle as usize]);
        let last = self.last.get(&key).copied().unwrap_or(u32::MAX);
        let mut at = last;
        while let Some(known) = self.points.get(at as usize) {
            if known.normal.dot(point.normal) > ONE_PLANE_COSINE {
                return;
            }
            at = self.before[at as usize];
        }
        self.last.insert(key, self.points.len() as u32);
        self.points.push(point);
        self.before.push(last);
        if patches.region(point.triangle as usize).two_sided {
            self.before.push(u32::MAX);
            self.points.push(SurfacePoint { normal: -point.normal, back: true, ..point });
        }
    }
}

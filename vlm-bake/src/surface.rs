//! Points spread evenly over the visible surface, and the faces of the light mesh that stand for them.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::bvh::Bvh;
use crate::decimate::LightMesh;
use crate::patches::Patches;
use crate::topology::cross_of;

/// A face stands only for points whose normal is at most this far (cosine) from its own. Lower values let a face stand
/// for the side walls of what was decimated away, which it can never clear; higher values leave more of the surface without
/// a light.
const LEAST_COSINE: f64 = 0.3;

/// A point on the visible surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// World space, metres.
    pub position: DVec3,
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

/// At least `count` points, area-uniform: one at every equal step of the area summed over the triangles, placed within its
/// triangle by a low-discrepancy sequence.
#[must_use]
pub fn spread_points(patches: &Patches, count: usize) -> Vec<SurfacePoint> {
    let areas: Vec<f64> = (0..patches.triangles.len()).into_par_iter().map(|t| patches.area(t)).collect();
    let step = areas.iter().sum::<f64>() / count.max(1) as f64;
    let mut points = Vec::with_capacity(count + count / 8);
    if step <= 0.0 {
        return points;
    }
    let mut ahead = 0.5 * step;
    for (t, area) in areas.iter().enumerate() {
        while ahead < *area {
            place(patches, t, points.len() as u64, step, &mut points);
            ahead += step;
        }
        ahead -= area;
    }
    points
}

/// Adds one point of a triangle; on a two-sided surface one for each side.
fn place(patches: &Patches, triangle: usize, index: u64, area: f64, points: &mut Vec<SurfacePoint>) {
    let [a, b, c] = patches.corners(triangle);
    let Some(normal) = cross_of([a, b, c]).try_normalize() else { return };
    let (u, v) = fold(plastic(index));
    let position = a * (1.0 - u - v) + b * u + c * v;
    let barycentric = Vec3::new((1.0 - u - v) as f32, u as f32, v as f32);
    let front = SurfacePoint { position, normal, triangle: triangle as u32, barycentric, area, back: false };
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

/// `count` points spread evenly over one triangle.
pub fn spread_over([a, b, c]: [DVec3; 3], count: u32) -> impl Iterator<Item = DVec3> {
    (0..u64::from(count)).map(move |index| {
        let (u, v) = fold(plastic(index));
        a * (1.0 - u - v) + b * u + c * v
    })
}

/// The face that stands for each point: the nearest of its own region, else of its island and primitive, that looks the
/// same way. `None` where decimation left none within `reach` metres: the point's light is lost, and the report says how
/// much.
#[must_use]
pub fn stand_ins(
    points: &[SurfacePoint],
    patches: &Patches,
    mesh: &LightMesh,
    reach: f64,
) -> Vec<Option<u32>> {
    let origin = mesh.positions.first().copied().unwrap_or_default();
    let positions: Vec<Vec3> = mesh.positions.iter().map(|p| (p - origin).as_vec3()).collect();
    let triangles: Vec<[u32; 3]> = mesh.faces.iter().map(|f| f.vertices).collect();
    let normals: Vec<DVec3> = (0..mesh.faces.len()).into_par_iter().map(|f| mesh.normal(f)).collect();
    let bvh = Bvh::new(&positions, &triangles);
    points
        .par_iter()
        .map(|point| {
            let region = patches.triangle_region[point.triangle as usize];
            let place = &patches.regions[region as usize];
            let alike = |f: u32| {
                mesh.faces[f as usize].back == point.back
                    && normals[f as usize].dot(point.normal) > LEAST_COSINE
            };
            let near = (point.position - origin).as_vec3();
            let own = |f: u32| mesh.faces[f as usize].region == region && alike(f);
            let kin = |f: u32| {
                let other = &patches.regions[mesh.faces[f as usize].region as usize];
                (other.island, other.primitive) == (place.island, place.primitive) && alike(f)
            };
            let found = bvh.closest(near, reach as f32, own).or_else(|| bvh.closest(near, reach as f32, kin));
            found.map(|closest| closest.triangle)
        })
        .collect()
}

/// The numbers of the points for which each face stands, as offsets and a list.
#[derive(Clone, Debug, Default)]
pub struct Standing {
    starts: Vec<u32>,
    points: Vec<u32>,
}

impl Standing {
    /// Inverts [`stand_ins`] for that many faces.
    #[must_use]
    pub fn new(stand_ins: &[Option<u32>], faces: usize) -> Self {
        let mut starts = vec![0u32; faces + 1];
        for face in stand_ins.iter().flatten() {
            starts[*face as usize + 1] += 1;
        }
        for f in 0..faces {
            starts[f + 1] += starts[f];
        }
        let mut next = starts.clone();
        let mut points = vec![0; starts[faces] as usize];
        for (point, face) in stand_ins.iter().enumerate() {
            if let Some(face) = face {
                let slot = &mut next[*face as usize];
                points[*slot as usize] = point as u32;
                *slot += 1;
            }
        }
        Self { starts, points }
    }

    /// The points of a face, ascending.
    #[must_use]
    pub fn of(&self, face: usize) -> &[u32] {
        &self.points[self.starts[face] as usize..self.starts[face + 1] as usize]
    }
}

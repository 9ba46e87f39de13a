//! Surface for which no light stands, in pieces: probes see their light, though no pixel evaluates their form factor.

use glam::{DVec3, IVec3};
use rustc_hash::FxHashMap;
use std::f32::consts::PI;
use vlm_format::Uncovered;

use crate::patches::Patches;
use crate::scene::Scene;
use crate::surface::SurfacePoint;

/// Edge of a piece over that of the surface around a sample. Lower values follow the borders of shadows there more closely; each piece is
/// lit in every frame, as a sample is.
const EDGE: f64 = 1.5;

/// Pieces of surface, and which piece a place belongs to.
#[derive(Clone, Debug, Default)]
pub struct Pieces {
    /// As the grid holds them.
    pub pieces: Vec<Uncovered>,
    by_key: FxHashMap<Key, u32>,
    /// Of the cells that part the surface, metres.
    edge: f64,
}

/// Region, back, main direction of the normal, cell.
type Key = (u32, bool, u8, IVec3);

impl Pieces {
    /// Gathers points for which no light stands; `sample_area` is the mean area around a sample, square metres.
    #[must_use]
    pub fn new<'p>(
        scene: &Scene,
        patches: &Patches,
        points: impl IntoIterator<Item = &'p SurfacePoint>,
        sample_area: f64,
    ) -> Self {
        let mut all = Self { edge: EDGE * sample_area.sqrt().max(f64::MIN_POSITIVE), ..Self::default() };
        let mut members: Vec<Vec<&SurfacePoint>> = Vec::new();
        for point in points {
            let key = all.key(patches, point);
            let next = members.len() as u32;
            let piece = *all.by_key.entry(key).or_insert(next);
            if piece == next {
                members.push(Vec::new());
            }
            members[piece as usize].push(point);
        }
        all.pieces = members.iter().map(|points| piece(scene, patches, points)).collect();
        all
    }

    /// The piece to which a place belongs, if any does.
    #[must_use]
    pub fn at(&self, patches: &Patches, place: &SurfacePoint) -> Option<u32> {
        self.by_key.get(&self.key(patches, place)).copied()
    }

    fn key(&self, patches: &Patches, point: &SurfacePoint) -> Key {
        let region = patches.triangle_region[point.triangle as usize];
        let cell = (point.position / self.edge).floor().as_ivec3();
        (region, point.back, main_direction(point.normal), cell)
    }
}

/// Number of the axis and sign to which a direction is nearest.
fn main_direction(d: DVec3) -> u8 {
    let axis = d.abs().max_position();
    2 * axis as u8 + u8::from(d[axis] < 0.0)
}

fn piece(scene: &Scene, patches: &Patches, points: &[&SurfacePoint]) -> Uncovered {
    let area: f64 = points.iter().map(|p| p.area).sum();
    let middle = points.iter().map(|p| p.position * p.area).sum::<DVec3>() / area.max(f64::MIN_POSITIVE);
    let away = |p: &&&SurfacePoint| p.inner.distance_squared(middle);
    let shown = points.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
    let mut piece = Uncovered { area: area as f32, ..Uncovered::default() };
    if let Some(point) = shown {
        (piece.position, piece.normal) = (point.inner.as_vec3(), point.normal.as_vec3());
    }
    for point in points {
        let share = (point.area / area.max(f64::MIN_POSITIVE)) as f32;
        let triangle = patches.triangle_source[point.triangle as usize] as usize;
        let surface = scene.albedo_at(triangle, point.barycentric, point.area as f32);
        let object = scene.primitives[scene.triangle_primitive[triangle] as usize].object;
        let steering = &scene.objects[object as usize].steering;
        let strength = steering.tint * steering.intensity * share;
        piece.reflectance += surface.reflectance() * strength;
        piece.emission += surface.emission * PI * strength;
    }
    piece
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn directions_have_six_numbers() {
        let mut seen: Vec<u8> = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z]
            .map(|d| main_direction(d.as_dvec3()))
            .to_vec();
        seen.sort_unstable();
        assert_eq!(seen, [0, 1, 2, 3, 4, 5]);
    }
}

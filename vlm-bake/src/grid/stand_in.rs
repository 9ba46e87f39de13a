//! Which sample of which light speaks for a place of the visible surface, as a table over each triangle: rays ask millions of times.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::uncovered::Pieces;
use crate::correspondence::{Correspondence, Light};
use crate::ground::Ground;
use crate::grouped_bvh::GroupedBvh;
use crate::samples::{BakedLight, WorldSample};
use crate::scene::Scene;
use crate::surface::SurfacePoint;
use crate::topology::{area, cross_of};

/// Cells of the table per light's area: higher values draw the borders between samples more exactly, and take a search each.
const CELLS_PER_LIGHT: f64 = 32.0;

/// The most rows into which a triangle is divided.
const MOST_ROWS: f64 = 64.0;

/// A light of another region may stand in for surface whose normal is at most this far (cosine) from its own.
const FACING_COSINE: f64 = 0.5;

/// No sample.
const NONE: u32 = u32::MAX;

/// Samples by triangle and place.
#[derive(Clone, Debug, Default)]
pub struct StandIns {
    /// Per scene triangle: first cell, rows, and whether the back has cells after those of the front. Rows 0: no sample.
    triangles: Vec<(u32, u16, bool)>,
    samples: Vec<u32>,
}

impl StandIns {
    /// Tabulates the lights (as the asset orders them) over the visible surface.
    #[must_use]
    pub fn new(scene: &Scene, ground: &Ground, baked: &[BakedLight], uncovered: &Pieces) -> Self {
        let lights: Vec<Light> =
            baked.iter().map(|l| Light { corners: l.corners, region: l.region, back: l.back }).collect();
        let search = Search::new(ground, &lights, |l| !baked[l].authored);
        let total: f64 = lights.iter().map(Light::area).sum();
        let cell_area = total / (lights.len().max(1) as f64 * CELLS_PER_LIGHT);
        let patches = ground.patches;
        let starts = sample_starts(baked);
        let first_piece = (baked.iter().map(|l| l.samples.len()).sum::<usize>() + baked.len()) as u32;
        let table = |(t, scene_triangle): (usize, u32)| {
            let corners = scene.corners(scene_triangle as usize).unwrap_or_default().map(Vec3::as_dvec3);
            let rows = (area(corners) / cell_area).sqrt().ceil().clamp(1.0, MOST_ROWS) as u16;
            let two_sided = patches.region(t).two_sided;
            let sides: &[bool] = if two_sided { &[true, false] } else { &[true] };
            let cells = sides.iter().flat_map(|&front| (0..cells(rows)).map(move |cell| (cell, front)));
            let sample = |(cell, front)| {
                let point = point(ground, t, corners, centre(cell, rows), front);
                let own = search.correspondence.light_of(&point);
                let piece = own.is_none().then(|| uncovered.at(patches, &point)).flatten();
                if let Some(piece) = piece {
                    return Some(first_piece + piece);
                }
                let light = own.or_else(|| search.other_light(&point))? as usize;
                Some(starts[light] + nearest_sample(&baked[light], point.position)?)
            };
            let samples = cells.map(|cell| sample(cell).unwrap_or(NONE)).collect::<Vec<u32>>();
            (scene_triangle, rows, two_sided, samples)
        };
        let triangles = (0..patches.triangles.len()).into_par_iter();
        let triangles = triangles.flat_map_iter(|t| patches.scene_triangles(t as u32).map(move |s| (t, s)));
        let tables: Vec<_> = triangles.map(table).collect();
        let mut all = Self { triangles: vec![(0, 0, false); scene.triangles.len()], samples: Vec::new() };
        for (scene_triangle, rows, two_sided, cells) in tables {
            all.triangles[scene_triangle as usize] = (all.samples.len() as u32, rows, two_sided);
            all.samples.extend(cells);
        }
        all
    }

    /// The tables' bytes, for fingerprints.
    pub(crate) fn arrays(&self, mut read: impl FnMut(&[u8])) {
        let row = |&(first, rows, back): &(u32, u16, bool)| [first, u32::from(rows), u32::from(back)];
        let triangles: Vec<[u32; 3]> = self.triangles.iter().map(row).collect();
        read(bytemuck::cast_slice(&triangles));
        read(bytemuck::cast_slice(&self.samples));
    }

    /// The sample, as the asset numbers them, that speaks for a place.
    #[must_use]
    pub fn sample_at(&self, triangle: u32, barycentric: Vec3, front: bool) -> Option<u32> {
        let &(first, rows, two_sided) = self.triangles.get(triangle as usize)?;
        if rows == 0 {
            return None;
        }
        let side = if front || !two_sided { 0 } else { cells(rows) };
        let sample = self.samples.get((first + side + cell_of(barycentric, rows)) as usize);
        sample.copied().filter(|&sample| sample != NONE)
    }
}

/// Finds a light for every place that has one anywhere near.
struct Search<'a> {
    correspondence: Correspondence<'a>,
    bvh: GroupedBvh,
    normals: Vec<DVec3>,
    reach: f64,
}

impl<'a> Search<'a> {
    fn new(ground: &Ground<'a>, lights: &[Light], emits: impl Fn(usize) -> bool) -> Self {
        let positions: Vec<DVec3> = lights.iter().flat_map(|light| light.corners).collect();
        let triangles: Vec<[u32; 3]> =
            (0..lights.len() as u32).map(|l| [3 * l, 3 * l + 1, 3 * l + 2]).collect();
        Self {
            correspondence: Correspondence::new(ground, lights, &emits),
            bvh: GroupedBvh::new(&positions, &triangles, |l| u32::from(!emits(l)), 2),
            normals: lights.iter().map(Light::normal).collect(),
            reach: ground.reach,
        }
    }

    /// For a place for which no light stands, the nearest of its region, else the nearest that looks its way.
    fn other_light(&self, point: &SurfacePoint) -> Option<u32> {
        let facing = |l: u32| self.normals[l as usize].dot(point.normal) > FACING_COSINE;
        let any = || Some(self.bvh.closest(0, point.inner, self.reach, facing)?.triangle);
        self.correspondence.nearest_in_region(point).or_else(any)
    }
}

/// The number of each light's first sample.
fn sample_starts(baked: &[BakedLight]) -> Vec<u32> {
    let mut next = 0;
    let start = |light: &BakedLight| {
        let start = next;
        next += light.samples.len() as u32;
        start
    };
    baked.iter().map(start).collect()
}

/// The sample of a light nearest to a place, counted from its first.
fn nearest_sample(light: &BakedLight, place: DVec3) -> Option<u32> {
    let away = |s: &WorldSample| s.position.distance_squared(place);
    let nearest = light.samples.iter().zip(0..).min_by(|(a, _), (b, _)| away(a).total_cmp(&away(b)));
    nearest.map(|(_, number)| number)
}

/// Cells of a triangle cut into so many rows.
fn cells(rows: u16) -> u32 {
    u32::from(rows) * u32::from(rows)
}

/// The cell of a place: rows along the second weight, of which the `i`-th from the first corner's edge has `2 (rows - i) - 1` cells.
fn cell_of(barycentric: Vec3, rows: u16) -> u32 {
    let n = f32::from(rows);
    let most = u32::from(rows) - 1;
    let row = ((barycentric.y * n).max(0.0) as u32).min(most);
    let column = ((barycentric.z * n).max(0.0) as u32).min(most - row);
    let within = (barycentric.y * n - row as f32) + (barycentric.z * n - column as f32);
    let upper = u32::from(within > 1.0 && column < most - row);
    // Rows before hold sum of 2 (rows - i) - 1 = row (2 rows - row) cells.
    row * (2 * u32::from(rows) - row) + 2 * column + upper
}

/// Weights of the middle of a cell.
fn centre(cell: u32, rows: u16) -> Vec3 {
    let n = u32::from(rows);
    let mut row = 0;
    let mut left = cell;
    while left >= 2 * (n - row) - 1 {
        left -= 2 * (n - row) - 1;
        row += 1;
    }
    let third = if left % 2 == 1 { 2.0 / 3.0 } else { 1.0 / 3.0 };
    let y = (row as f32 + third) / n as f32;
    let z = ((left / 2) as f32 + third) / n as f32;
    Vec3::new(1.0 - y - z, y, z)
}

/// A place on a scene triangle that lies where triangle `t` of the patches does, perhaps turned round.
fn point(ground: &Ground, t: usize, corners: [DVec3; 3], barycentric: Vec3, front: bool) -> SurfacePoint {
    let weights = barycentric.as_dvec3();
    let position = corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z;
    let normal = cross_of(corners).normalize_or_zero() * if front { 1.0 } else { -1.0 };
    let back = normal.dot(cross_of(ground.patches.corners(t))) < 0.0;
    SurfacePoint { position, inner: position, normal, triangle: t as u32, barycentric, area: 0.0, back }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_cell_lies_in_it() {
        for rows in [1, 2, 3, 7, 64] {
            for cell in 0..cells(rows) {
                let middle = centre(cell, rows);
                assert!(middle.min_element() > 0.0, "{rows} {cell} {middle}");
                assert_eq!(cell_of(middle, rows), cell, "{rows} rows, {middle}");
            }
        }
        assert!(cell_of(Vec3::new(-0.1, 1.1, 0.0), 8) < cells(8), "rounding outside stays inside");
    }
}

//! Which cells of a row a light reaches, from two tests instead of one per cell.
//!
//! Along a row, the distance of a cell from the light's centre falls and then rises, and the height of a cell's foremost corner over the
//! light's plane only rises or only falls; rounding keeps both orders. So the cells that [`ActiveHemisphere::reaches`] accepts are neighbours,
//! and only the ends of a span that holds them for certain need the test.

use std::ops::RangeInclusive;

use glam::{UVec3, Vec3, Vec3Swizzles};

use crate::active_hemisphere::{ActiveHemisphere, Lattice};

/// Room for rounding, relative to the numbers that were rounded.
const ROUNDING: f32 = 16.0 * f32::EPSILON;

/// How the layers of a lattice divide into rows: along x or y, whichever has the narrower cells, so that rows are fewer and spans longer.
#[derive(Clone, Copy)]
pub struct Rows {
    along_x: bool,
    cells: u32,
}

impl Rows {
    /// Those of a lattice.
    #[must_use]
    pub fn of(lattice: &Lattice) -> Self {
        Self { along_x: lattice.cell.x <= lattice.cell.y, cells: lattice.cells }
    }

    /// The place of a layer's cell (its number, x fastest) where rows follow one another.
    #[must_use]
    pub fn place(&self, cell: u32) -> u32 {
        if self.along_x { cell } else { cell / self.cells + cell % self.cells * self.cells }
    }

    /// Coordinates along a row, across the rows, and z.
    fn turned(&self, v: Vec3) -> Vec3 {
        if self.along_x { v } else { v.yxz() }
    }

    /// The cell at a place of a row.
    fn cell(&self, along: u32, row: u32, z: u32) -> UVec3 {
        if self.along_x { UVec3::new(along, row, z) } else { UVec3::new(row, along, z) }
    }
}

/// A light, ready to visit the rows of a lattice. All but `light` and `lattice` is turned so that rows lie along x.
pub struct LightSpans<'a> {
    light: &'a ActiveHemisphere,
    lattice: &'a Lattice,
    rows: Rows,
    centre: Vec3,
    normal: Vec3,
    origin: Vec3,
    cell: Vec3,
    /// The first and last cell along each axis that the light may reach.
    first: UVec3,
    last: UVec3,
    /// Room for rounding of coordinates, metres.
    room: f32,
    /// Cells per metre.
    per_metre: f32,
    /// Steps along x per step of height over the light's plane, without sign.
    per_height: f32,
}

/// A light in one layer of cells.
pub struct LayerSpans<'a> {
    of: &'a LightSpans<'a>,
    z: u32,
    /// The light's squared radius less the squared distance of the layer, square metres.
    squared: f32,
    /// What z adds to the height of the foremost corners over the light's plane, metres.
    height: f32,
}

impl<'a> LightSpans<'a> {
    /// Finds the box of cells that the light may reach.
    #[must_use]
    pub fn new(light: &'a ActiveHemisphere, lattice: &'a Lattice) -> Self {
        let radius = Vec3::splat(light.radius);
        let [first, last] = lattice.touched_by(light.centre - radius, light.centre + radius);
        let far = lattice.low + lattice.cells as f32 * lattice.cell;
        let largest = light.centre.abs().max(lattice.low.abs()).max(far.abs()).max_element() + light.radius;
        let rows = Rows::of(lattice);
        let [centre, normal] = [light.centre, light.normal].map(|v| rows.turned(v));
        let [origin, cell] = [lattice.low, lattice.cell].map(|v| rows.turned(v));
        let [first, last] = [first, last].map(|cell| rows.cell(cell.x, cell.y, cell.z));
        let (room, per_metre, per_height) = (ROUNDING * largest, 1.0 / cell.x, 1.0 / normal.x.abs());
        Self { light, lattice, rows, centre, normal, origin, cell, first, last, room, per_metre, per_height }
    }

    /// The layers of cells (z) that the light may reach.
    #[must_use]
    pub fn layers(&self) -> RangeInclusive<u32> {
        self.first.z..=self.last.z
    }

    /// The light in the layer `z`.
    #[must_use]
    pub fn layer(&self, z: u32) -> LayerSpans<'_> {
        let ActiveHemisphere { centre, radius, normal } = *self.light;
        let [low, high] = self.lattice.bounds(UVec3::new(0, 0, z)).map(|corner| corner.z);
        let (beside, height) = beside_and_height(centre.z, normal.z, low, high);
        let squared = (1.0 + ROUNDING) * radius * radius - beside * beside;
        LayerSpans { of: self, z, squared, height: height + self.room }
    }
}

/// Of a cell between two coordinates: its distance from the centre along the axis, and what the axis adds to the height of its foremost
/// corner over the plane.
fn beside_and_height(centre: f32, normal: f32, low: f32, high: f32) -> (f32, f32) {
    let foremost = if normal >= 0.0 { high } else { low };
    (centre.clamp(low, high) - centre, normal * (foremost - centre))
}

impl LayerSpans<'_> {
    /// The rows that the light may reach.
    #[must_use]
    pub fn rows(&self) -> RangeInclusive<u32> {
        self.of.first.y..=self.of.last.y
    }

    /// The first and last cell along a row that the light reaches. `tests` grows by the cells that were tested, or by 1 for a row that
    /// needed no test of a cell.
    pub fn span(&self, row: u32, tests: &mut u64) -> Option<[u32; 2]> {
        let Some([mut first, mut last]) = self.within(row) else {
            *tests += 1;
            return None;
        };
        let mut misses = |along: u32| {
            *tests += 1;
            let [low, high] = self.of.lattice.bounds(self.of.rows.cell(along, row, self.z));
            !self.of.light.reaches(low, high)
        };
        while misses(first) {
            if first == last {
                return None;
            }
            first += 1;
        }
        while last > first && misses(last) {
            last -= 1;
        }
        Some([first, last])
    }

    /// A span that holds all cells of a row that the light reaches, and hardly any other; `None` where it surely reaches none.
    fn within(&self, row: u32) -> Option<[u32; 2]> {
        let LightSpans { centre, normal, origin, cell, .. } = *self.of;
        let low = origin.y + row as f32 * cell.y;
        let (beside, height) = beside_and_height(centre.y, normal.y, low, low + cell.y);
        let squared = self.squared - beside * beside;
        if squared < 0.0 {
            return None;
        }
        let half = squared.sqrt() + self.of.room;
        // Height over the light's plane where the row passes the centre, and then at its foremost end within the ball.
        let height = self.height + height;
        if height + normal.x.abs() * (half + cell.x) <= 0.0 {
            return None;
        }
        // Where the row crosses the plane.
        let crossing = height * self.of.per_height + self.of.room;
        let [from, to] =
            if normal.x >= 0.0 { [(-half).max(-crossing), half] } else { [-half, half.min(crossing)] };
        let slack = 1e-3 * cell.x;
        let cell_of = |x: f32| (((x - origin.x) * self.of.per_metre) as u32).min(self.of.lattice.cells - 1);
        let [first, last] = [cell_of(centre.x + from - slack), cell_of(centre.x + to + slack)];
        (first <= last).then_some([first, last])
    }
}

//! Where a light acts in the thesis' method, and the cells over which it keeps lists (Aquotte 2017).

use glam::{UVec3, Vec3};
use vlm_shaders::cpu::form_factor::LightGeometry;

/// The half ball in front of a light, in which it acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActiveHemisphere {
    /// The light's centroid, metres.
    pub centre: Vec3,
    /// Metres.
    pub radius: f32,
    /// The light's unit normal.
    pub normal: Vec3,
}

impl ActiveHemisphere {
    /// Those of all lights; they end at `range` times the distance from a light's centroid to its farthest corner.
    #[must_use]
    pub fn of_all(lights: &[LightGeometry], range: f32) -> Vec<Self> {
        lights.iter().map(|light| Self::of(light, range)).collect()
    }

    fn of(light: &LightGeometry, range: f32) -> Self {
        let corners = light.corners();
        let centre = corners.iter().sum::<Vec3>() / 3.0;
        let radius = corners.iter().map(|c| c.distance(centre)).fold(0.0, f32::max);
        Self { centre, radius: range * radius, normal: light.normal }
    }

    /// True where the ball overlaps the box, and some corner of the box is in front of the light.
    #[must_use]
    pub fn reaches(&self, low: Vec3, high: Vec3) -> bool {
        let nearest = self.centre.clamp(low, high);
        if nearest.distance_squared(self.centre) > self.radius * self.radius {
            return false;
        }
        let farthest = Vec3::select(self.normal.cmpge(Vec3::ZERO), high, low);
        self.normal.dot(farthest - self.centre) > 0.0
    }
}

/// A box whose every axis is divided into as many cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// The box's minimum corner, metres.
    pub low: Vec3,
    /// Size of a cell, metres.
    pub cell: Vec3,
    /// Cells along each axis.
    pub cells: u32,
}

impl Lattice {
    /// Divides the box `low..high` into 1 to 512 cells along each axis.
    #[must_use]
    pub fn over(low: Vec3, high: Vec3, cells: u32) -> Self {
        let cells = cells.clamp(1, 512);
        Self { low, cell: (high - low).max(Vec3::splat(1e-6)) / cells as f32, cells }
    }

    /// Number of cells.
    #[must_use]
    pub fn count(&self) -> usize {
        self.cells.pow(3) as usize
    }

    /// The cell of a number, x fastest.
    #[must_use]
    pub fn position(&self, number: u32) -> UVec3 {
        UVec3::new(number % self.cells, number / self.cells % self.cells, number / self.cells / self.cells)
    }

    /// The number of a cell.
    #[must_use]
    pub fn number(&self, position: UVec3) -> u32 {
        position.x + self.cells * (position.y + self.cells * position.z)
    }

    /// The corners of a cell.
    #[must_use]
    pub fn bounds(&self, position: UVec3) -> [Vec3; 2] {
        let low = self.low + position.as_vec3() * self.cell;
        [low, low + self.cell]
    }

    /// The cell that holds `p`, or the nearest to it.
    #[must_use]
    pub fn cell_of(&self, p: Vec3) -> UVec3 {
        ((p - self.low) / self.cell).max(Vec3::ZERO).as_uvec3().min(UVec3::splat(self.cells - 1))
    }

    /// The first and last cell along each axis that a box touches, and perhaps a neighbour: rounding never loses one.
    #[must_use]
    pub fn touched_by(&self, low: Vec3, high: Vec3) -> [UVec3; 2] {
        let largest = low.abs().max(high.abs()).max(self.low.abs());
        let room = 1e-3 * self.cell + 8.0 * f32::EPSILON * largest;
        [self.cell_of(low - room), self.cell_of(high + room)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_positions_of_cells_agree() {
        let lattice = Lattice::over(Vec3::new(-1.0, 2.0, 0.0), Vec3::new(3.0, 4.0, 1.0), 4);
        for number in 0..lattice.count() as u32 {
            let position = lattice.position(number);
            let [low, high] = lattice.bounds(position);
            assert_eq!(lattice.number(position), number);
            assert_eq!(lattice.cell_of(0.5 * (low + high)), position);
        }
        assert_eq!(lattice.cell_of(Vec3::splat(99.0)), UVec3::splat(3), "the nearest");
    }

    #[test]
    fn boxes_touch_the_cells_on_both_sides_of_a_border() {
        let lattice = Lattice::over(Vec3::ZERO, Vec3::splat(8.0), 8);
        let touched = |low: f32, high: f32| {
            let [low, high] = lattice.touched_by(Vec3::splat(low), Vec3::splat(high));
            (low.x, high.x)
        };
        assert_eq!(touched(2.0, 3.0), (1, 3));
        assert_eq!(touched(2.1, 2.9), (2, 2), "the negative control");
    }
}

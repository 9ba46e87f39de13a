//! The lights that a point of world space looks at.

use glam::Vec3;
use vlm_format::Grid;

/// The lights of the cell that holds `x`, ascending. Empty outside the grid and in cells that are not stored.
#[must_use]
pub fn lights_at(grid: &Grid, x: Vec3) -> &[u32] {
    let slot = cell_number(grid, x).and_then(|cell| grid.cells.binary_search(&cell).ok());
    slot.and_then(|slot| grid.starts.get(slot).zip(grid.starts.get(slot + 1)))
        .and_then(|(&start, &end)| grid.entries.get(start as usize..end as usize))
        .unwrap_or(&[])
}

/// `x + dimensions.x * (y + dimensions.y * z)` of the cell that holds `p`. The grid's maximum faces belong to it.
#[must_use]
pub fn cell_number(grid: &Grid, p: Vec3) -> Option<u32> {
    let cell = (p - grid.origin) / grid.cell_size;
    let mut index = [0; 3];
    for axis in 0..3 {
        let (coordinate, cells) = (cell[axis], grid.dimensions[axis]);
        // NaN fails both comparisons.
        if !(coordinate >= 0.0 && coordinate <= cells as f32) {
            return None;
        }
        index[axis] = (coordinate as u32).min(cells.checked_sub(1)?);
    }
    let [x, y, z] = index;
    let [nx, ny, _] = grid.dimensions;
    z.checked_mul(ny)?.checked_add(y)?.checked_mul(nx)?.checked_add(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Grid {
        Grid {
            origin: Vec3::splat(-1.0),
            cell_size: 0.5,
            dimensions: [4, 3, 2],
            cells: vec![1, 23],
            starts: vec![0, 2, 3],
            entries: vec![4, 7, 9],
        }
    }

    #[test]
    fn stored_cells_are_found() {
        let grid = grid();
        assert_eq!(lights_at(&grid, Vec3::new(-0.4, -0.9, -0.9)), [4, 7]);
        assert_eq!(lights_at(&grid, Vec3::new(1.0, 0.5, 0.0)), [9], "the far corner");
        assert!(lights_at(&grid, Vec3::new(0.2, -0.9, -0.9)).is_empty(), "not stored");
        assert!(lights_at(&grid, Vec3::new(-1.01, 0.0, -0.5)).is_empty(), "outside");
        assert!(lights_at(&grid, Vec3::NAN).is_empty());
    }

    #[test]
    fn broken_grids_hold_nothing() {
        let empty = Grid::default();
        assert!(lights_at(&empty, Vec3::ZERO).is_empty());
        let torn = Grid { starts: vec![0, 99], ..grid() };
        assert!(lights_at(&torn, Vec3::new(-0.4, -0.9, -0.9)).is_empty());
        let huge = Grid { dimensions: [u32::MAX; 3], ..grid() };
        assert!(lights_at(&huge, Vec3::splat(1e9)).is_empty());
    }
}

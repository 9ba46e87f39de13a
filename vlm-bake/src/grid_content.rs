//! A static grid in numbers, as `vlm inspect` and the report's page show it.

use schemars::JsonSchema;
use serde::Serialize;
use vlm_format::{GltfFile, Grid, Leaf};

/// A grid in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct GridContent {
    /// Edge of a cell of the coarsest level, metres.
    pub cell_size_m: f32,
    /// Cells of the coarsest level along x, y, z.
    pub dimensions: [u32; 3],
    /// Cells of the coarsest level that hold something.
    pub stored_cells: usize,
    /// Leaves of all levels.
    pub leaves: usize,
    /// Leaves of each level, the coarsest first.
    pub leaves_by_level: Vec<usize>,
    /// Probes on surface and in free space.
    pub probes: usize,
    /// Probes on surface.
    pub surface_probes: u32,
    /// Probes in free space.
    pub free_probes: usize,
    /// Entries over the leaves' lists of probes.
    pub listed_probes: usize,
    /// Entries over the probes' lists of near lights.
    pub near_entries: usize,
    /// Entries over the probes' rows.
    pub far_entries: u32,
    /// Sources in a probe's row, on average.
    pub mean_row: f64,
    /// Bytes of all arrays.
    pub bytes: usize,
    /// Bytes that they take in the file: fewer where they are compressed.
    pub stored_bytes: u64,
    /// Bytes of each array.
    pub bytes_by_array: Vec<ArrayBytes>,
    /// Leaves by how many probes on surface they list.
    pub probes_of_leaves: Vec<Bin>,
    /// Leaves by how many lights are near for any of their probes on surface: the most that a pixel evaluates.
    pub near_lights_of_leaves: Vec<Bin>,
}

/// An array of the grid, by its name in the file.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ArrayBytes {
    /// The name.
    pub array: &'static str,
    /// Its size.
    pub bytes: usize,
    /// Its size in the file: less where it is compressed.
    pub stored_bytes: u64,
}

/// How many things have `from` to `to` of something, both included.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Bin {
    /// The least.
    pub from: usize,
    /// The most.
    pub to: usize,
    /// How many things.
    pub count: usize,
}

impl GridContent {
    /// Of a valid grid, as if stored without compression.
    #[must_use]
    pub fn of(grid: &Grid) -> Self {
        let lists: Vec<&[u32]> = grid.leaves.windows(2).map(|leaf| probes_of_leaf(grid, leaf)).collect();
        let near = |list: &&[u32]| near_lights(grid, list.iter().copied());
        let roots = grid.dimensions.iter().map(|&cells| cells as usize).product();
        let sources: usize = (0..grid.probes.len()).map(|probe| grid.row(probe).count()).sum();
        let bytes_by_array =
            grid.sizes().map(|(array, bytes)| ArrayBytes { array, bytes, stored_bytes: bytes as u64 });
        Self {
            cell_size_m: grid.cell_size,
            dimensions: grid.dimensions,
            stored_cells: grid.cells.iter().take(roots).filter(|&&cell| cell != 0).count(),
            leaves: lists.len(),
            leaves_by_level: leaves_by_level(grid, roots),
            probes: grid.probes.len(),
            surface_probes: grid.surface_probes,
            free_probes: grid.probes.len().saturating_sub(grid.surface_probes as usize),
            listed_probes: grid.leaf_probes.len(),
            near_entries: grid.near.len(),
            far_entries: grid.row_starts.get(grid.probes.len()).copied().unwrap_or(0),
            mean_row: sources as f64 / grid.probes.len().max(1) as f64,
            bytes: grid.byte_len(),
            stored_bytes: grid.byte_len() as u64,
            bytes_by_array: bytes_by_array.into(),
            probes_of_leaves: histogram(lists.iter().map(|list| list.len())),
            near_lights_of_leaves: histogram(lists.iter().map(near)),
        }
    }

    /// The same with the sizes that its arrays have in the file from which it was read.
    #[must_use]
    pub fn stored_in(mut self, file: &GltfFile) -> Self {
        for array in &mut self.bytes_by_array {
            array.stored_bytes = file.stored_vlm_bytes(&format!("grid/{}", array.array));
        }
        self.stored_bytes = self.bytes_by_array.iter().map(|array| array.stored_bytes).sum();
        self
    }
}

/// How many lights are near for any of some probes.
#[must_use]
pub fn near_lights(grid: &Grid, probes: impl IntoIterator<Item = u32>) -> usize {
    let near = probes.into_iter().flat_map(|probe| grid.near_of(probe as usize));
    let mut lights: Vec<u32> = near.copied().collect();
    lights.sort_unstable();
    lights.dedup();
    lights.len()
}

/// The probes on surface of a leaf, which stands before the next one.
#[must_use]
pub fn probes_of_leaf<'a>(grid: &'a Grid, leaf: &[Leaf]) -> &'a [u32] {
    let range = leaf.first().map(|leaf| leaf.probes as usize..leaf.free_probes as usize);
    range.and_then(|range| grid.leaf_probes.get(range)).unwrap_or(&[])
}

/// Groups of eight stand after the cells that they divide, so one pass sees each cell's level before its parts.
fn leaves_by_level(grid: &Grid, roots: usize) -> Vec<usize> {
    let mut level: Vec<Option<usize>> = vec![None; grid.cells.len()];
    level.iter_mut().take(roots).for_each(|level| *level = Some(0));
    let mut leaves = Vec::new();
    for (at, &cell) in grid.cells.iter().enumerate() {
        let Some(here) = level[at] else { continue };
        if cell % 2 == 1 {
            leaves.resize(leaves.len().max(here + 1), 0);
            leaves[here] += 1;
        } else if cell != 0 {
            level.iter_mut().skip(cell as usize / 2).take(8).for_each(|level| *level = Some(here + 1));
        }
    }
    leaves
}

/// Counts in bins of 0, 1, 2 to 3, 4 to 7 and so on, up to the last that holds something.
fn histogram(values: impl Iterator<Item = usize>) -> Vec<Bin> {
    let mut bins: Vec<Bin> = Vec::new();
    for value in values {
        let bin = value.checked_ilog2().map_or(0, |power| power as usize + 1);
        while bins.len() <= bin {
            let from = if bins.is_empty() { 0 } else { 1 << (bins.len() - 1) };
            bins.push(Bin { from, to: (2 * from).saturating_sub(1), count: 0 });
        }
        bins[bin].count += 1;
    }
    bins
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_double_and_count_everything() {
        let counts = |values: &[usize]| -> Vec<[usize; 3]> {
            histogram(values.iter().copied()).iter().map(|bin| [bin.from, bin.to, bin.count]).collect()
        };
        assert_eq!(counts(&[]), [[0; 3]; 0]);
        assert_eq!(counts(&[0, 0]), [[0, 0, 2]]);
        assert_eq!(counts(&[1, 3, 2, 4, 8]), [[0, 0, 0], [1, 1, 1], [2, 3, 2], [4, 7, 1], [8, 15, 1]]);
    }

    #[test]
    fn leaves_are_counted_on_their_level_and_unreachable_ones_are_not() {
        // Two cells: a leaf, and one of eight parts, of which one is divided; then a group to which nothing leads.
        let mut cells = vec![1_u32; 2 + 3 * 8];
        (cells[1], cells[2], cells[3]) = (2 * 2, 0, 2 * 10);
        let grid = Grid { dimensions: [2, 1, 1], cells, ..Grid::default() };
        assert_eq!(leaves_by_level(&grid, 2), [1, 6, 8]);
    }

    #[test]
    fn a_light_that_is_near_for_two_probes_of_a_leaf_counts_once() {
        let grid = Grid {
            leaves: vec![Leaf { probes: 0, free_probes: 2 }, Leaf { probes: 2, free_probes: 2 }],
            leaf_probes: vec![0, 1],
            near_starts: vec![0, 2, 3],
            near: vec![3, 4, 3],
            ..Grid::default()
        };
        let last = GridContent::of(&grid).near_lights_of_leaves.pop();
        assert_eq!(last, Some(Bin { from: 2, to: 3, count: 1 }));
    }
}

//! What `vlm inspect` says about the static grid.

use vlm_bake::grid_content::{Bin, GridContent};

/// Length of the longest bar of a histogram, characters.
const BAR: usize = 40;

/// The grid's part of the report.
pub fn lines(grid: &GridContent) -> Vec<String> {
    let [x, y, z] = grid.dimensions;
    let levels: Vec<String> = grid.leaves_by_level.iter().map(usize::to_string).collect();
    let mut lines = vec![
        format!(
            "grid      {x} x {y} x {z} cells of {} m, {} stored; {:.1} kB, {:.1} kB in the file",
            grid.cell_size_m,
            grid.stored_cells,
            kilobytes(grid.bytes as u64),
            kilobytes(grid.stored_bytes)
        ),
        format!("leaves    {}; by level, coarsest first: {}", grid.leaves, levels.join(", ")),
        format!(
            "probes    {} on surface, {} in free space; {} times listed by leaves",
            grid.surface_probes, grid.free_probes, grid.listed_probes
        ),
        format!(
            "light     {} near lights; rows of {:.1} sources on average, {} entries",
            grid.near_entries, grid.mean_row, grid.far_entries
        ),
    ];
    lines.extend(grid.bytes_by_array.iter().map(|array| {
        let (decoded, stored) = (kilobytes(array.bytes as u64), kilobytes(array.stored_bytes));
        format!("bytes     {:<15} {decoded:>9.1} kB, {stored:>9.1} kB in the file", array.array)
    }));
    lines.push("leaves by their probes on surface".to_owned());
    lines.extend(bars(&grid.probes_of_leaves));
    lines.push("leaves by lights that are near for any of their probes".to_owned());
    lines.extend(bars(&grid.near_lights_of_leaves));
    lines
}

fn kilobytes(bytes: u64) -> f64 {
    bytes as f64 / 1e3
}

fn bars(bins: &[Bin]) -> Vec<String> {
    let most = bins.iter().map(|bin| bin.count).max().unwrap_or(0).max(1);
    let bar = |bin: &Bin| {
        let range =
            if bin.to > bin.from { format!("{} to {}", bin.from, bin.to) } else { bin.from.to_string() };
        format!("{range:>14} {:>8} {}", bin.count, "#".repeat((BAR * bin.count).div_ceil(most)))
            .trim_end()
            .to_owned()
    };
    bins.iter().map(bar).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_as_long_as_counts_are_large() {
        let bin = |from, count| Bin { from, to: from, count };
        let bins = [bin(0, 0), bin(1, 4), bin(2, 1)];
        let lengths: Vec<usize> = bars(&bins).iter().map(|line| line.matches('#').count()).collect();
        assert_eq!(lengths, [0, BAR, BAR / 4]);
    }
}

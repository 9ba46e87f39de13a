//! The rules of the static grid.

use super::{Issues, check_starts};
use crate::error::Code;
use crate::grid::{Grid, Leaf, MOST_PROBES, Probe};

/// How far a frame's axes may be from unit length and from each other's plane.
const FRAME_SLACK: f32 = 1e-3;

pub(super) fn grid(grid: &Grid, lights: usize, samples: usize, issues: &mut Issues) {
    let positive = grid.origin.is_finite() && grid.cell_size.is_finite() && grid.cell_size > 0.0;
    issues.check(positive, Code::VlmNumber, "/grid", || {
        String::from("origin or cell size is not finite, or no cell has a size")
    });
    cells(grid, issues);
    leaves(grid, issues);
    issues.check_all(
        &grid.leaf_probes,
        Code::VlmIndex,
        "/grid/leaf_probes",
        "there is no such probe",
        |&probe| (probe as usize) < grid.probes.len(),
    );
    issues.check_all(&grid.near, Code::VlmIndex, "/grid/near", "there is no such light", |near| {
        (near.light() as usize) < lights
    });
    issues.check_all(
        &grid.probes,
        Code::VlmNumber,
        "/grid/probes",
        "its place, frame or reach is broken",
        sound,
    );
    issues.check(
        grid.surface_probes as usize <= grid.probes.len(),
        Code::VlmRange,
        "/grid/surface_probes",
        || format!("{} of {} probes", grid.surface_probes, grid.probes.len()),
    );
    sources(grid, lights, samples, issues);
    rows(grid, lights + samples, issues);
}

/// Every cell leads to a leaf, to a later group of eight that exists, or nowhere; so descending ends.
fn cells(grid: &Grid, issues: &mut Issues) {
    let total = grid.dimensions.iter().try_fold(1_u64, |product, &size| product.checked_mul(u64::from(size)));
    let total = total.filter(|&total| total < 1 << 30);
    issues.check(total.is_some(), Code::VlmRange, "/grid/dimensions", || {
        format!("{:?} has 2^30 cells or more", grid.dimensions)
    });
    let divided = (grid.cells.len() as u64).checked_sub(total.unwrap_or(0));
    issues.check(divided.is_some_and(|more| more % 8 == 0), Code::VlmLength, "/grid/cells", || {
        format!("{} cells for {:?} and groups of eight", grid.cells.len(), grid.dimensions)
    });
    let leaves = grid.leaves.len().saturating_sub(1);
    let leads = |(at, &cell): (usize, &u32)| {
        let to = cell as usize / 2;
        let leaf = cell % 2 == 1;
        if leaf {
            to < leaves
        } else {
            to == 0 || (to > at && to.checked_add(8).is_some_and(|end| end <= grid.cells.len()))
        }
    };
    if let Some(at) = grid.cells.iter().enumerate().position(|cell| !leads(cell)) {
        issues
            .check(false, Code::VlmIndex, &format!("/grid/cells/{at}"), || String::from("it leads nowhere"));
    }
}

fn leaves(grid: &Grid, issues: &mut Issues) {
    let probes: Vec<u32> = grid.leaves.iter().map(|leaf| leaf.probes).collect();
    check_starts(&probes, grid.leaf_probes.len(), "/grid/leaves", issues);
    let fits = |pair: &[Leaf]| {
        let (on_surface, end) = (pair[0].free_probes.checked_sub(pair[0].probes), pair[1].probes);
        on_surface.is_some_and(|count| count as usize <= MOST_PROBES) && pair[0].free_probes <= end
    };
    if let Some(leaf) = grid.leaves.windows(2).position(|pair| !fits(pair)) {
        issues.check(false, Code::VlmOrder, &format!("/grid/leaves/{leaf}"), || {
            format!("its lists do not follow each other, or it has more than {MOST_PROBES} probes on surface")
        });
    }
}

fn sound(probe: &Probe) -> bool {
    let reaches = [probe.reach_up, probe.reach_down].into_iter().chain(probe.reach);
    let unit = |v: glam::Vec3| (v.length() - 1.0).abs() < FRAME_SLACK;
    probe.position.is_finite()
        && probe.row_scale.is_finite()
        && unit(probe.normal)
        && unit(probe.tangent)
        && probe.normal.dot(probe.tangent).abs() < FRAME_SLACK
        && reaches.into_iter().all(|reach| reach.is_finite() && reach > 0.0)
}

fn sources(grid: &Grid, lights: usize, samples: usize, issues: &mut Issues) {
    for (pointer, values, count) in [
        ("/grid/sample_shares", &grid.sample_shares, samples),
        ("/grid/surface_gains", &grid.surface_gains, lights),
    ] {
        issues.check(values.len() == count, Code::VlmLength, pointer, || {
            format!("{} values for {count} sources", values.len())
        });
    }
    issues.check_all(
        &grid.sample_shares,
        Code::VlmNumber,
        "/grid/sample_shares",
        "not a number above 0",
        |share| share.is_finite() && *share > 0.0,
    );
    issues.check_all(
        &grid.surface_gains,
        Code::VlmNumber,
        "/grid/surface_gains",
        "not a number of 0 or more",
        |gain| gain.is_finite() && *gain >= 0.0,
    );
}

fn rows(grid: &Grid, sources: usize, issues: &mut Issues) {
    let fits = grid.near_starts.len() == grid.probes.len() + 1;
    issues.check(fits, Code::VlmLength, "/grid/near_starts", || {
        format!("{} offsets for {} probes", grid.near_starts.len(), grid.probes.len())
    });
    check_starts(&grid.near_starts, grid.near.len(), "/grid/near_starts", issues);
    let fits = grid.row_starts.len() == grid.probes.len() + 1;
    issues.check(fits, Code::VlmLength, "/grid/row_starts", || {
        format!("{} offsets for {} probes", grid.row_starts.len(), grid.probes.len())
    });
    let entries = grid.row_starts.last().copied().unwrap_or(0) as usize;
    check_starts(&grid.row_starts, entries, "/grid/row_starts", issues);
    issues.check(entries.div_ceil(2) == grid.rows.len(), Code::VlmLength, "/grid/rows", || {
        format!("{} words for {entries} entries", grid.rows.len())
    });
    let known = |probe: &usize| grid.row(*probe).all(|(light, _)| (light as usize) < sources);
    if let Some(probe) = (0..grid.probes.len()).find(|probe| !known(probe)) {
        issues.check(false, Code::VlmIndex, &format!("/grid/rows/{probe}"), || {
            String::from("it names a source that does not exist")
        });
    }
}

#[cfg(test)]
pub(super) mod tests {
    use glam::Vec3;

    use super::*;
    use crate::grid::{NearLight, RowWriter};

    /// One cell over two lights, with one probe that knows both.
    pub fn two_lights() -> Grid {
        let mut rows = RowWriter::default();
        rows.push([(1, 255)]);
        Grid {
            cell_size: 1.0,
            dimensions: [1, 1, 1],
            cells: vec![1],
            leaves: vec![Leaf::default(), Leaf { probes: 1, free_probes: 1 }],
            leaf_probes: vec![0],
            near_starts: vec![0, 1],
            near: vec![NearLight::new(0, 128)],
            probes: vec![Probe {
                normal: Vec3::Y,
                tangent: Vec3::X,
                reach: [1.0; 4],
                reach_up: 1.0,
                reach_down: 1.0,
                row_scale: 1.0 / 255.0,
                ..Probe::default()
            }],
            surface_probes: 1,
            sample_shares: vec![1.0; 2],
            surface_gains: vec![1.0; 2],
            row_starts: rows.starts,
            rows: rows.words,
            ..Grid::default()
        }
    }
}

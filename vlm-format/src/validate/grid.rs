//! The rules of the static grid.

use super::{Issues, check_starts};
use crate::error::Code;
use crate::grid::{Grid, Leaf, MOST_PROBES, Probe};

/// How far a frame's axes may be from unit length and from each other's plane.
const FRAME_SLACK: f32 = 1e-3;

pub(super) fn grid(grid: &Grid, lights: usize, sample_starts: &[u32], issues: &mut Issues) {
    let samples = sample_starts.last().copied().unwrap_or(0) as usize;
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
    issues.check_all(&grid.near, Code::VlmIndex, "/grid/near", "there is no such light", |&near| {
        (near as usize) < lights
    });
    issues.check_all(
        &grid.near_form_factors,
        Code::VlmNumber,
        "/grid/near_form_factors",
        "not a number above 0",
        |form_factor| form_factor.is_finite() && *form_factor > 0.0,
    );
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
    rows(grid, lights + samples + grid.uncovered.len(), sample_starts, issues);
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
    let kinds = |pair: &[Leaf]| {
        let is_free = |probe: &u32| *probe >= grid.surface_probes;
        let list = |from: u32, to: u32| grid.leaf_probes.get(from as usize..to as usize).unwrap_or(&[]);
        !list(pair[0].probes, pair[0].free_probes).iter().any(is_free)
            && list(pair[0].free_probes, pair[1].probes).iter().all(is_free)
    };
    if let Some(leaf) = grid.leaves.windows(2).position(|pair| fits(pair) && !kinds(pair)) {
        issues.check(false, Code::VlmRange, &format!("/grid/leaves/{leaf}"), || {
            String::from("it lists a probe on surface as one in free space, or the reverse")
        });
    }
    if let Some(leaf) = grid.leaves.windows(2).position(|pair| !fits(pair)) {
        issues.check(false, Code::VlmOrder, &format!("/grid/leaves/{leaf}"), || {
            format!("its lists do not follow each other, or it has more than {MOST_PROBES} probes on surface")
        });
    }
}

fn sound(probe: &Probe) -> bool {
    let reaches = [probe.reach_up, probe.reach_down].into_iter().chain(probe.reach);
    probe.position.is_finite()
        && probe.row_scale.is_finite()
        && is_unit(probe.normal)
        && is_unit(probe.tangent)
        && probe.normal.dot(probe.tangent).abs() < FRAME_SLACK
        && reaches.into_iter().all(|reach| reach.is_finite() && reach > 0.0)
}

fn is_unit(v: glam::Vec3) -> bool {
    (v.length() - 1.0).abs() < FRAME_SLACK
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
    issues.check_all(
        &grid.uncovered,
        Code::VlmNumber,
        "/grid/uncovered",
        "its place or normal is broken, or a colour or its area is negative",
        |piece| {
            let numbers = [piece.reflectance, piece.emission];
            piece.position.is_finite()
                && is_unit(piece.normal)
                && numbers.into_iter().all(|colour| colour.is_finite() && colour.min_element() >= 0.0)
                && piece.area.is_finite()
                && piece.area >= 0.0
        },
    );
}

fn rows(grid: &Grid, sources: usize, sample_starts: &[u32], issues: &mut Issues) {
    let fits = grid.near_starts.len() == grid.probes.len() + 1;
    issues.check(fits, Code::VlmLength, "/grid/near_starts", || {
        format!("{} offsets for {} probes", grid.near_starts.len(), grid.probes.len())
    });
    let fits = grid.near_form_factors.len() == grid.near.len();
    issues.check(fits, Code::VlmLength, "/grid/near_form_factors", || {
        format!("{} form factors for {} near lights", grid.near_form_factors.len(), grid.near.len())
    });
    check_starts(&grid.near_starts, grid.near.len(), "/grid/near_starts", issues);
    let ascends = |range: &[u32]| {
        let list = grid.near.get(range[0] as usize..range[1] as usize).unwrap_or(&[]);
        list.is_sorted_by(|a, b| a < b)
    };
    if let Some(probe) = grid.near_starts.windows(2).position(|range| !ascends(range)) {
        issues.check(false, Code::VlmOrder, &format!("/grid/near/{probe}"), || {
            String::from("the probe's near lights are not ascending")
        });
    }
    let fits = grid.row_starts.len() == grid.probes.len() + grid.near.len() + 1;
    issues.check(fits, Code::VlmLength, "/grid/row_starts", || {
        let (probes, near) = (grid.probes.len(), grid.near.len());
        format!("{} offsets for {probes} probes and {near} near lights", grid.row_starts.len())
    });
    let entries = grid.row_starts.last().copied().unwrap_or(0) as usize;
    check_starts(&grid.row_starts, entries, "/grid/row_starts", issues);
    issues.check(entries.div_ceil(2) == grid.rows.len(), Code::VlmLength, "/grid/rows", || {
        format!("{} words for {entries} entries", grid.rows.len())
    });
    // Offsets that fall would have the same entries walked again and again.
    if !grid.row_starts.is_sorted() {
        return;
    }
    let known = |probe: &usize| grid.row(*probe).all(|(source, _)| (source as usize) < sources);
    let known_near = |near: &usize| {
        let first = grid.near.get(*near).and_then(|&light| sample_starts.get(light as usize));
        first.is_some_and(|&first| grid.near_row(*near, first).all(|(source, _)| (source as usize) < sources))
    };
    let probes = grid.probes.len();
    let unknown = (0..probes).find(|probe| !known(probe));
    let unknown = unknown.or_else(|| Some(probes + (0..grid.near.len()).find(|near| !known_near(near))?));
    if let Some(row) = unknown {
        issues.check(false, Code::VlmIndex, &format!("/grid/rows/{row}"), || {
            String::from("it names a source that does not exist")
        });
    }
}

#[cfg(test)]
pub(super) mod tests {
    use glam::Vec3;

    use super::super::tests::Break;
    use super::*;
    use crate::asset::VlmAsset;
    use crate::grid::{RowWriter, Uncovered};

    /// One cell over two lights, with one probe that knows both.
    pub fn two_lights() -> Grid {
        let mut rows = RowWriter::default();
        rows.push(0, [(1, 255)]);
        rows.push(0, [(0, 128)]);
        Grid {
            cell_size: 1.0,
            dimensions: [1, 1, 1],
            cells: vec![1],
            leaves: vec![Leaf { probes: 0, free_probes: 1 }, Leaf { probes: 1, free_probes: 1 }],
            leaf_probes: vec![0],
            near_starts: vec![0, 1],
            near: vec![0],
            near_form_factors: vec![0.5],
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
            uncovered: vec![Uncovered { normal: Vec3::Y, ..Uncovered::default() }],
            row_starts: rows.starts,
            rows: rows.words,
            ..Grid::default()
        }
    }

    /// Every rule of the grid by the code and place of its issue, with what breaks it and nothing else.
    pub const CASES: &[(Code, &str, Break)] = &[
        (Code::VlmNumber, "/grid", |a| grid(a).origin.z = f32::NAN),
        (Code::VlmNumber, "/grid", |a| grid(a).cell_size = f32::INFINITY),
        (Code::VlmNumber, "/grid", |a| grid(a).cell_size = 0.0),
        (Code::VlmRange, "/grid/dimensions", |a| grid(a).dimensions = [1 << 15, 1 << 15, 1]),
        (Code::VlmRange, "/grid/dimensions", |a| grid(a).dimensions = [u32::MAX; 3]),
        (Code::VlmLength, "/grid/cells", |a| grid(a).cells.push(0)),
        (Code::VlmLength, "/grid/cells", |a| grid(a).dimensions = [3, 3, 1]),
        (Code::VlmIndex, "/grid/cells/0", |a| grid(a).cells[0] = 3),
        (Code::VlmIndex, "/grid/cells/2", |a| divide(grid(a))[2] = 2),
        (Code::VlmIndex, "/grid/cells/2", |a| divide(grid(a))[2] = 4),
        (Code::VlmIndex, "/grid/cells/0", |a| divide(grid(a))[0] = 2 * 10),
        (Code::VlmOrder, "/grid/leaves", |a| grid(a).leaves.clear()),
        (Code::VlmOrder, "/grid/leaves", |a| grid(a).leaves[0].probes = 1),
        (Code::VlmOrder, "/grid/leaves", |a| grid(a).leaves[1].probes = 0),
        (Code::VlmOrder, "/grid/leaves", |a| {
            grid(a).leaves.insert(1, Leaf { probes: 2, free_probes: 2 });
        }),
        (Code::VlmOrder, "/grid/leaves/1", |a| {
            grid(a).leaves =
                [[0, 1], [1, 0], [1, 1]].map(|[probes, free_probes]| Leaf { probes, free_probes }).into();
        }),
        (Code::VlmOrder, "/grid/leaves/0", |a| grid(a).leaves[0].free_probes = 2),
        (Code::VlmOrder, "/grid/leaves/0", |a| {
            let most = MOST_PROBES as u32;
            grid(a).leaf_probes = vec![0; MOST_PROBES + 1];
            grid(a).leaves = [0, most + 1].map(|probes| Leaf { probes, free_probes: most + 1 }).into();
        }),
        (Code::VlmIndex, "/grid/leaf_probes/0", |a| grid(a).leaf_probes[0] = 1),
        (Code::VlmIndex, "/grid/near/0", |a| grid(a).near[0] = 2),
        (Code::VlmNumber, "/grid/near_form_factors/0", |a| grid(a).near_form_factors[0] = 0.0),
        (Code::VlmNumber, "/grid/near_form_factors/0", |a| grid(a).near_form_factors[0] = f32::NAN),
        (Code::VlmLength, "/grid/near_form_factors", |a| grid(a).near_form_factors.push(0.5)),
        (Code::VlmNumber, "/grid/probes/0", |a| grid(a).probes[0].position.x = f32::INFINITY),
        (Code::VlmNumber, "/grid/probes/0", |a| grid(a).probes[0].row_scale = f32::NAN),
        (Code::VlmNumber, "/grid/probes/0", |a| grid(a).probes[0].normal *= 1.01),
        (Code::VlmNumber, "/grid/probes/0", |a| grid(a).probes[0].tangent *= 1.01),
        (Code::VlmNumber, "/grid/probes/0", |a| grid(a).probes[0].tangent = Vec3::new(0.8, 0.6, 0.0)),
        (Code::VlmNumber, "/grid/probes/0", |a| grid(a).probes[0].reach_up = 0.0),
        (Code::VlmNumber, "/grid/probes/0", |a| grid(a).probes[0].reach_down = f32::INFINITY),
        (Code::VlmNumber, "/grid/probes/0", |a| grid(a).probes[0].reach[3] = -1.0),
        (Code::VlmRange, "/grid/leaves/0", |a| grid(a).surface_probes = 0),
        (Code::VlmRange, "/grid/leaves/0", |a| grid(a).leaves[0].free_probes = 0),
        (Code::VlmOrder, "/grid/near/0", |a| {
            set_near(grid(a), [1, 0]);
        }),
        (Code::VlmOrder, "/grid/near/0", |a| {
            set_near(grid(a), [0, 0]);
        }),
        (Code::VlmRange, "/grid/surface_probes", |a| grid(a).surface_probes = 2),
        (Code::VlmLength, "/grid/sample_shares", |a| grid(a).sample_shares.push(1.0)),
        (Code::VlmLength, "/grid/surface_gains", |a| grid(a).surface_gains.truncate(1)),
        (Code::VlmNumber, "/grid/sample_shares/1", |a| grid(a).sample_shares[1] = 0.0),
        (Code::VlmNumber, "/grid/sample_shares/1", |a| grid(a).sample_shares[1] = f32::INFINITY),
        (Code::VlmNumber, "/grid/surface_gains/0", |a| grid(a).surface_gains[0] = -1.0),
        (Code::VlmNumber, "/grid/surface_gains/0", |a| grid(a).surface_gains[0] = f32::INFINITY),
        (Code::VlmNumber, "/grid/uncovered/0", |a| grid(a).uncovered[0].position.x = f32::NAN),
        (Code::VlmNumber, "/grid/uncovered/0", |a| grid(a).uncovered[0].normal = Vec3::ZERO),
        (Code::VlmNumber, "/grid/uncovered/0", |a| grid(a).uncovered[0].reflectance.y = -1.0),
        (Code::VlmNumber, "/grid/uncovered/0", |a| grid(a).uncovered[0].emission.z = f32::INFINITY),
        (Code::VlmNumber, "/grid/uncovered/0", |a| grid(a).uncovered[0].area = -1.0),
        (Code::VlmLength, "/grid/near_starts", |a| grid(a).near_starts.insert(0, 0)),
        (Code::VlmOrder, "/grid/near_starts", |a| grid(a).near_starts[1] = 0),
        (Code::VlmOrder, "/grid/near_starts", |a| grid(a).near_starts[0] = 1),
        (Code::VlmLength, "/grid/row_starts", |a| grid(a).row_starts.insert(0, 0)),
        (Code::VlmOrder, "/grid/row_starts", |a| grid(a).row_starts[0] = 1),
        (Code::VlmLength, "/grid/rows", |a| grid(a).rows.push(0)),
        (Code::VlmLength, "/grid/rows", |a| grid(a).row_starts[2] = 3),
        (Code::VlmIndex, "/grid/rows/0", |a| set_rows(grid(a), 5, 0)),
        (Code::VlmIndex, "/grid/rows/1", |a| set_rows(grid(a), 0, 5)),
    ];

    fn grid(asset: &mut VlmAsset) -> &mut Grid {
        asset.grid.as_mut().unwrap()
    }

    /// Divides the only cell, and the first of its parts.
    fn divide(grid: &mut Grid) -> &mut [u32] {
        grid.cells = vec![1; 1 + 8 + 8];
        (grid.cells[0], grid.cells[1]) = (2, 2 * 9);
        &mut grid.cells
    }

    fn set_near(grid: &mut Grid, lights: [u32; 2]) {
        grid.near = lights.into();
        grid.near_form_factors = vec![0.5; 2];
        grid.near_starts[1] = 2;
        grid.row_starts.push(grid.row_starts[2]);
    }

    /// Each row has one source.
    fn set_rows(grid: &mut Grid, of_probe: u32, of_near: u32) {
        let mut rows = RowWriter::default();
        rows.push(0, [(of_probe, 1)]);
        rows.push(0, [(of_near, 1)]);
        (grid.row_starts, grid.rows) = (rows.starts, rows.words);
    }

    #[test]
    fn the_last_source_and_a_divided_cell_are_valid() {
        let mut valid = two_lights();
        divide(&mut valid);
        set_rows(&mut valid, 4, 4);
        let mut issues = Issues::default();
        super::grid(&valid, 2, &[0, 1, 2], &mut issues);
        assert_eq!(issues.0, []);
    }
}

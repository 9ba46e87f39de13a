//! The leaf of the static grid that holds a point, and the weights of its probes there.

use glam::Vec3;
use vlm_format::{Grid, MOST_PROBES, Probe};

use super::gather::Receiver;

/// The most levels below the coarsest: bounds the descent, whatever a file holds.
const DEEPEST: u32 = 24;

/// Weights of probes that sum to this leave nothing to probes that do not reach the point. Higher values leak more at the ends of
/// reaches, lower ones make them sharper.
const FIRM: f32 = 0.05;

/// The leaf that holds `x`; `None` outside the grid and where nothing is stored.
#[must_use]
pub fn leaf_at(grid: &Grid, x: Vec3) -> Option<u32> {
    let place = (x - grid.origin) / grid.cell_size;
    let mut index = [0_u32; 3];
    let mut within = Vec3::ZERO;
    for axis in 0..3 {
        let (coordinate, cells) = (place[axis], grid.dimensions[axis]);
        // NaN fails both comparisons. The grid's maximum faces belong to it.
        if !(coordinate >= 0.0 && coordinate <= cells as f32) {
            return None;
        }
        index[axis] = (coordinate as u32).min(cells.checked_sub(1)?);
        within[axis] = coordinate - index[axis] as f32;
    }
    let [x, y, z] = index;
    let [nx, ny, _] = grid.dimensions;
    let mut at = z.checked_mul(ny)?.checked_add(y)?.checked_mul(nx)?.checked_add(x)?;
    for _ in 0..DEEPEST {
        let cell = *grid.cells.get(at as usize)?;
        if cell % 2 == 1 {
            return Some(cell / 2);
        }
        if cell == 0 {
            return None;
        }
        within *= 2.0;
        let upper = within.cmpge(Vec3::ONE);
        within -= Vec3::select(upper, Vec3::ONE, Vec3::ZERO);
        at = cell / 2 + upper.bitmask();
    }
    None
}

/// The probes that a point of a leaf looks at, and how much each counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Blend {
    /// Index into [`Grid::leaf_probes`] of the first.
    pub first: u32,
    /// Number of probes.
    pub count: u32,
    /// Their weights, which sum to 1 (all 0 where no probe reaches).
    pub weights: [f32; MOST_PROBES],
}

/// Weights of a leaf's probes on surface for a receiver.
#[must_use]
pub fn blend(grid: &Grid, leaf: u32, receiver: &Receiver) -> Blend {
    let mut blend = Blend::default();
    let Some(lists) = grid.leaves.get(leaf as usize) else { return blend };
    blend.first = lists.probes;
    blend.count = (lists.free_probes - lists.probes).min(MOST_PROBES as u32);
    let mut sum = 0.0;
    for i in 0..blend.count as usize {
        let weight = probe_of(grid, &blend, i).map_or(0.0, |probe| weight_of(probe, receiver));
        blend.weights[i] = weight;
        sum += weight;
    }
    if sum >= FIRM {
        blend.weights.iter_mut().for_each(|weight| *weight *= 1.0 / sum);
    } else {
        add_strays(grid, &mut blend, sum, receiver);
    }
    blend
}

/// Most of a leaf's probes face elsewhere, so that is asked first.
fn weight_of(probe: &Probe, receiver: &Receiver) -> f32 {
    let facing = probe.normal_weight(receiver.normal);
    if facing > 0.0 { facing * probe.place_weight(probe.local(receiver.position)) } else { 0.0 }
}

/// Where reaches end, strays fade in.
fn add_strays(grid: &Grid, blend: &mut Blend, sum: f32, receiver: &Receiver) {
    let mut strays = [0.0; MOST_PROBES];
    let mut stray_sum = 0.0;
    for (i, stray) in strays.iter_mut().enumerate().take(blend.count as usize) {
        let Some(probe) = probe_of(grid, blend, i) else { continue };
        *stray = probe.stray_weight(probe.local(receiver.position), receiver.normal);
        stray_sum += *stray;
    }
    let stray_share = (1.0 - sum / FIRM).max(0.0);
    let stray_share = stray_share * stray_share;
    let inside = if sum > 0.0 { (1.0 - stray_share) / sum } else { 0.0 };
    let outside = if stray_sum > 0.0 { (if sum > 0.0 { stray_share } else { 1.0 }) / stray_sum } else { 0.0 };
    for (weight, stray) in blend.weights.iter_mut().zip(strays) {
        *weight = *weight * inside + stray * outside;
    }
}

fn probe_of<'a>(grid: &'a Grid, blend: &Blend, i: usize) -> Option<&'a Probe> {
    let probe = *grid.leaf_probes.get(blend.first as usize + i)?;
    grid.probes.get(probe as usize)
}

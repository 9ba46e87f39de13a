//! Phase 2 for receivers that move: a blend of the light around the probes in free space.

use std::ops::Range;

use glam::Vec3;

use super::gather::{Gathered, Receiver};
use super::gather_static::Frame;
use super::grid::leaf_at;

/// Probes that do not reach a point count where none holds it deeper than this ([`vlm_format::Probe::depth`]). Higher values leak more
/// close to walls, lower ones make the ends of reaches sharper.
const FIRM_DEPTH: f32 = 0.01;

/// Weights that sum to less are lost to rounding.
const LEAST_SUM: f32 = 1e-30;

/// Probes on surface are asked for normals up to about this cosine from their own. Lower values ask them for more than they know.
const LEAST_BENT_COSINE: f32 = 0.8;

/// How many coarsest cells away light is looked for from a point of an empty cell. Higher values find light farther off, and take six
/// look-ups each.
const FARTHEST: u32 = 16;

impl Frame<'_> {
    /// Irradiance at a point of an object that moves.
    ///
    /// Continuous within the volumes for which the grid has probes. Elsewhere the surface nearby says what it knows: of its leaf, or of the
    /// next one along an axis. Tags do not count, since what moves has no lights.
    #[must_use]
    pub fn gather_free(&self, receiver: &Receiver) -> Gathered {
        let Some(leaf) = self.leaf_around(receiver.position) else { return Gathered::default() };
        if self.free_probes(leaf).is_empty() {
            self.gather_in(leaf, &self.bent(leaf, receiver))
        } else {
            Gathered { irradiance: self.free_blend(leaf, receiver), pairs: 0 }
        }
    }

    /// The receiver turned toward the side that the nearest of the leaf's probes on surface sees: they know nothing of the other.
    fn bent(&self, leaf: u32, receiver: &Receiver) -> Receiver {
        let (mut nearest, mut most) = (receiver.normal, 0.0);
        let lists = self.grid.leaves.get(leaf as usize).copied().unwrap_or_default();
        for i in lists.probes..lists.free_probes {
            let number = self.grid.leaf_probes.get(i as usize).copied();
            let Some(probe) = number.and_then(|n| self.grid.probes.get(n as usize)) else { continue };
            let weight = probe.stray_weight(probe.local(receiver.position), receiver.normal);
            if weight > most {
                (nearest, most) = (probe.normal, weight);
            }
        }
        let missing = (LEAST_BENT_COSINE - receiver.normal.dot(nearest)).max(0.0);
        let bent = receiver.normal + nearest * (2.0 * missing);
        let normal = bent.try_normalize().unwrap_or(nearest);
        Receiver { normal, geometric_normal: normal, ..*receiver }
    }

    /// The blend of the probes in free space of a leaf.
    fn free_blend(&self, leaf: u32, receiver: &Receiver) -> Vec3 {
        let (mut inside, mut outside) = (Vec3::ZERO, Vec3::ZERO);
        let (mut sum, mut stray_sum, mut depth) = (0.0_f32, 0.0_f32, 0.0_f32);
        for i in self.free_probes(leaf) {
            let Some(number) = self.grid.leaf_probes.get(i as usize).copied() else { continue };
            let free = number.checked_sub(self.grid.surface_probes);
            let light = free.and_then(|free| self.arrived.free.get(free as usize));
            let Some((probe, light)) = self.grid.probes.get(number as usize).zip(light) else { continue };
            let local = probe.local(receiver.position);
            let irradiance = light.irradiance(receiver.normal);
            let weight = probe.place_weight(local);
            let stray = probe.stray_weight(local, probe.normal);
            inside += irradiance * weight;
            outside += irradiance * stray;
            sum += weight;
            stray_sum += stray;
            depth = depth.max(probe.depth(local));
        }
        // Where reaches end, strays fade in.
        let reached = sum > LEAST_SUM;
        let stray_share = if reached { (1.0 - depth / FIRM_DEPTH).max(0.0) } else { 1.0 };
        let stray_share = stray_share * stray_share;
        let inside = if reached { inside * ((1.0 - stray_share) / sum) } else { Vec3::ZERO };
        let outside = if stray_sum > 0.0 { outside * (stray_share / stray_sum) } else { Vec3::ZERO };
        inside + outside
    }

    /// The leaf that holds a point, else the next one along an axis.
    fn leaf_around(&self, position: Vec3) -> Option<u32> {
        let holds = |leaf: &u32| !self.free_probes(*leaf).is_empty() || self.has_surface(*leaf);
        if let Some(leaf) = leaf_at(self.grid, position).filter(holds) {
            return Some(leaf);
        }
        for cells in 1..=FARTHEST {
            let step = cells as f32 * self.grid.cell_size;
            for away in [Vec3::NEG_Y, Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z, Vec3::Y] {
                if let Some(leaf) = leaf_at(self.grid, position + away * step).filter(holds) {
                    return Some(leaf);
                }
            }
        }
        None
    }

    /// Where the probes in free space of a leaf are in the leaves' list.
    fn free_probes(&self, leaf: u32) -> Range<u32> {
        let leaf = leaf as usize;
        let lists = self.grid.leaves.get(leaf).zip(self.grid.leaves.get(leaf + 1));
        lists.map_or(0..0, |(own, next)| own.free_probes..next.probes)
    }

    fn has_surface(&self, leaf: u32) -> bool {
        self.grid.leaves.get(leaf as usize).is_some_and(|lists| lists.probes < lists.free_probes)
    }
}

//! Phase 2 by the static grid: the near lights of a point's probes exactly, all others through the probes.

use glam::Vec3;
use vlm_format::{Grid, MOST_PROBES, NearLight};

use super::form_factor::{LightGeometry, Receivers, form_factor, form_factors, is_behind};
use super::gather::{Gathered, Receiver};
use super::grid::{Blend, blend, leaf_at};
use super::refresh::FarLight;
use super::upload::LightSet;

/// What a frame's gathering reads.
#[derive(Clone, Copy)]
pub struct Frame<'a> {
    /// The static grid.
    pub grid: &'a Grid,
    /// The lights in world space.
    pub lights: &'a LightSet,
    /// Phase 1's result, one per light, lx.
    pub radiosity: &'a [Vec3],
    /// The far light of each probe on surface.
    pub far: &'a [FarLight],
}

impl<'a> Frame<'a> {
    /// Irradiance at a point of a surface that stands still.
    #[must_use]
    pub fn gather(&self, receiver: &Receiver) -> Gathered {
        let Some(leaf) = leaf_at(self.grid, receiver.position) else { return Gathered::default() };
        let blend = blend(self.grid, leaf, receiver);
        let mut gathered = Gathered { irradiance: self.far_light(&blend, receiver), pairs: 0 };
        // The probes' lists ascend, so each light is met once, with all probes that see it.
        let mut lists = [&[] as &[NearLight]; MOST_PROBES];
        for (i, list) in lists.iter_mut().enumerate().take(blend.count as usize) {
            if blend.weights[i] > 0.0 {
                *list = self.near(&blend, i);
            }
        }
        loop {
            let heads = lists[..blend.count as usize].iter().filter_map(|list| list.first());
            let Some(light) = heads.map(|near| near.light()).min() else { break };
            let mut seen = 0.0;
            for (list, weight) in lists.iter_mut().zip(blend.weights) {
                if let Some((near, rest)) = list.split_first().filter(|(near, _)| near.light() == light) {
                    seen += weight * near.visibility();
                    *list = rest;
                }
            }
            let Some((geometry, radiosity)) = self.light(light) else { continue };
            if radiosity == Vec3::ZERO {
                continue;
            }
            gathered.pairs += 1;
            if !is_behind(geometry, receiver.position, receiver.geometric_normal) {
                let form_factor = form_factor(geometry, receiver.position, receiver.normal);
                gathered.irradiance += radiosity * (form_factor * seen);
            }
        }
        gathered
    }

    /// [`Frame::gather`] for points of one leaf: the near lights one after the other, the points several at a time. Differs by
    /// rounding alone.
    #[must_use]
    pub fn gather_together(&self, leaf: u32, receivers: &[Receiver]) -> Vec<Gathered> {
        let blends: Vec<Blend> = receivers.iter().map(|r| blend(self.grid, leaf, r)).collect();
        let far = blends.iter().zip(receivers).map(|(blend, r)| self.far_light(blend, r));
        let mut gathered: Vec<Gathered> = far.map(|irradiance| Gathered { irradiance, pairs: 0 }).collect();
        let near = self.near_of_any(&blends);
        if near.is_empty() {
            return gathered;
        }
        let points =
            Receivers::on_surfaces(receivers.iter().map(|r| (r.position, r.normal, r.geometric_normal)));
        let mut form_factor = vec![0.0; receivers.len()];
        for same in near.chunk_by(|a, b| a.0.light() == b.0.light()) {
            let Some((geometry, radiosity)) = self.light(same[0].0.light()) else { continue };
            if radiosity == Vec3::ZERO {
                continue;
            }
            form_factors(geometry, &points, &mut form_factor);
            for ((gathered, blend), form_factor) in gathered.iter_mut().zip(&blends).zip(&form_factor) {
                let seen: f32 = same.iter().map(|&(near, i)| blend.weights[i] * near.visibility()).sum();
                gathered.pairs += u64::from(seen != 0.0);
                gathered.irradiance += radiosity * (form_factor * seen);
            }
        }
        gathered
    }

    fn far_light(&self, blend: &Blend, receiver: &Receiver) -> Vec3 {
        let mut irradiance = Vec3::ZERO;
        for i in 0..blend.count as usize {
            let weight = blend.weights[i];
            if weight > 0.0
                && let Some(probe) = self.probe(blend, i)
                && let Some((place, far)) = self.grid.probes.get(probe).zip(self.far.get(probe))
            {
                irradiance += far.irradiance(receiver.normal, place.local(receiver.position)) * weight;
            }
        }
        irradiance
    }

    /// The near lights of all probes that count for some of the points, by light, with the probe's place in the leaf.
    fn near_of_any(&self, blends: &[Blend]) -> Vec<(NearLight, usize)> {
        let Some(first) = blends.first() else { return Vec::new() };
        let counts = |&i: &usize| blends.iter().any(|blend| blend.weights[i] > 0.0);
        let probes = (0..first.count as usize).filter(counts);
        let mut near: Vec<(NearLight, usize)> =
            probes.flat_map(|i| self.near(first, i).iter().map(move |&near| (near, i))).collect();
        near.sort_unstable();
        near
    }

    fn probe(&self, blend: &Blend, i: usize) -> Option<usize> {
        self.grid.leaf_probes.get(blend.first as usize + i).map(|&probe| probe as usize)
    }

    fn near(&self, blend: &Blend, i: usize) -> &'a [NearLight] {
        self.probe(blend, i).map_or(&[], |probe| self.grid.near_of(probe))
    }

    fn light(&self, light: u32) -> Option<(&'a LightGeometry, Vec3)> {
        Some((self.lights.geometry.get(light as usize)?, *self.radiosity.get(light as usize)?))
    }
}

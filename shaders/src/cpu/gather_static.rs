//! Phase 2 by the static grid: the near lights of a point's probes exactly, all others through the probes.

use glam::Vec3;
use std::ops::Range;
use vlm_format::{Grid, MOST_PROBES};

use super::form_factor::{Receivers, form_factor, form_factors, is_behind};
use super::gather::{Gathered, Receiver};
use super::grid::{Blend, blend, leaf_at};
use super::refresh::Arrived;
use super::upload::LightSet;

/// What a frame's gathering reads.
#[derive(Clone, Copy)]
pub struct Frame<'a> {
    /// The static grid.
    pub grid: &'a Grid,
    /// The lights in world space.
    pub lights: &'a LightSet,
    /// What arrives at the probes.
    pub arrived: &'a Arrived,
}

impl Frame<'_> {
    /// Irradiance at a point of a surface that stands still.
    #[must_use]
    pub fn gather(&self, receiver: &Receiver) -> Gathered {
        leaf_at(self.grid, receiver.position)
            .map_or_else(Gathered::default, |leaf| self.gather_in(leaf, receiver))
    }

    /// [`Frame::gather`] by the probes on surface of this leaf, in which the point need not lie.
    #[must_use]
    pub fn gather_in(&self, leaf: u32, receiver: &Receiver) -> Gathered {
        let blend = blend(self.grid, leaf, receiver);
        let mut gathered = Gathered { irradiance: self.far_light(&blend, receiver), pairs: 0 };
        // The probes' lists ascend, so each light is met once, with all probes that see it.
        let mut lists: [Range<usize>; MOST_PROBES] = std::array::from_fn(|_| 0..0);
        for (i, list) in lists.iter_mut().enumerate().take(blend.count as usize) {
            if blend.weights[i] > 0.0 {
                *list = self.near(&blend, i);
            }
        }
        loop {
            let heads = lists[..blend.count as usize].iter().filter(|list| list.start < list.end);
            let Some(light) = heads.map(|list| self.grid.near[list.start]).min() else { break };
            let mut radiosity = Vec3::ZERO;
            for (list, weight) in lists.iter_mut().zip(blend.weights) {
                if list.start < list.end && self.grid.near[list.start] == light {
                    radiosity += self.near_radiosity(list.start) * weight;
                    list.start += 1;
                }
            }
            let Some(geometry) = self.lights.geometry.get(light as usize) else { continue };
            if radiosity == Vec3::ZERO {
                continue;
            }
            gathered.pairs += 1;
            if !is_behind(geometry, receiver.position, receiver.geometric_normal) {
                gathered.irradiance += radiosity * form_factor(geometry, receiver.position, receiver.normal);
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
        for same in near.chunk_by(|a, b| a.light == b.light) {
            let Some(geometry) = self.lights.geometry.get(same[0].light as usize) else { continue };
            form_factors(geometry, &points, &mut form_factor);
            for ((gathered, blend), form_factor) in gathered.iter_mut().zip(&blends).zip(&form_factor) {
                let seen = |near: &NearOfLeaf| near.radiosity * blend.weights[near.place];
                let radiosity: Vec3 = same.iter().map(seen).sum();
                gathered.pairs += u64::from(radiosity != Vec3::ZERO);
                gathered.irradiance += radiosity * *form_factor;
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
                && let Some((place, far)) = self.grid.probes.get(probe).zip(self.arrived.far.get(probe))
            {
                irradiance += far.irradiance(receiver.normal, place.local(receiver.position)) * weight;
            }
        }
        irradiance
    }

    /// The near lights of all probes that count for some of the points and from which light comes, by light.
    fn near_of_any(&self, blends: &[Blend]) -> Vec<NearOfLeaf> {
        let Some(first) = blends.first() else { return Vec::new() };
        let counts = |&place: &usize| blends.iter().any(|blend| blend.weights[place] > 0.0);
        let near = |place| {
            let of_leaf = move |near| {
                let light = self.grid.near[near];
                NearOfLeaf { light, place, radiosity: self.near_radiosity(near) }
            };
            self.near(first, place).map(of_leaf)
        };
        let all = (0..first.count as usize).filter(counts).flat_map(near);
        let mut near: Vec<NearOfLeaf> = all.filter(|near| near.radiosity != Vec3::ZERO).collect();
        near.sort_unstable_by_key(|near| (near.light, near.place));
        near
    }

    fn probe(&self, blend: &Blend, i: usize) -> Option<usize> {
        self.grid.leaf_probes.get(blend.first as usize + i).map(|&probe| probe as usize)
    }

    /// The near lights of a probe of a leaf.
    fn near(&self, blend: &Blend, i: usize) -> Range<usize> {
        self.probe(blend, i).map_or(0..0, |probe| self.grid.near_range(probe))
    }

    fn near_radiosity(&self, near: usize) -> Vec3 {
        self.arrived.near.get(near).copied().unwrap_or_default()
    }
}

/// A near light of a probe of a leaf.
struct NearOfLeaf {
    light: u32,
    /// The probe's place in the leaf.
    place: usize,
    radiosity: Vec3,
}

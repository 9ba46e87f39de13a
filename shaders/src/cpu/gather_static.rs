//! Phase 2 by the static grid: the near lights of a point's leaf exactly, all others through its probes.

use glam::Vec3;
use vlm_format::{FULL_VISIBILITY, Grid, NearLight};

use super::form_factor::{Receivers, form_factor, form_factors, is_behind};
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
        for near in self.near(leaf) {
            let seen = visibility(near, &blend);
            let Some((geometry, radiosity)) = self.light(near) else { continue };
            if seen == 0.0 || radiosity == Vec3::ZERO {
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
        let near = self.near(leaf);
        if near.is_empty() {
            return gathered;
        }
        let points =
            Receivers::on_surfaces(receivers.iter().map(|r| (r.position, r.normal, r.geometric_normal)));
        let mut form_factor = vec![0.0; receivers.len()];
        for near in near {
            let Some((geometry, radiosity)) = self.light(near) else { continue };
            if radiosity == Vec3::ZERO {
                continue;
            }
            form_factors(geometry, &points, &mut form_factor);
            for ((gathered, blend), form_factor) in gathered.iter_mut().zip(&blends).zip(&form_factor) {
                let seen = visibility(near, blend);
                gathered.pairs += u64::from(seen != 0.0);
                gathered.irradiance += radiosity * (form_factor * seen);
            }
        }
        gathered
    }

    fn far_light(&self, blend: &Blend, receiver: &Receiver) -> Vec3 {
        let mut irradiance = Vec3::ZERO;
        for i in 0..blend.count {
            let weight = blend.weights[i as usize];
            let Some(&probe) = self.grid.leaf_probes.get((blend.first + i) as usize) else { continue };
            let known = self.grid.probes.get(probe as usize).zip(self.far.get(probe as usize));
            if let Some((probe, far)) = known.filter(|_| weight > 0.0) {
                irradiance += far.irradiance(receiver.normal, probe.local(receiver.position)) * weight;
            }
        }
        irradiance
    }

    fn near(&self, leaf: u32) -> &'a [NearLight] {
        let range = self.grid.leaves.get(leaf as usize).zip(self.grid.leaves.get(leaf as usize + 1));
        range.and_then(|(from, to)| self.grid.near.get(from.near as usize..to.near as usize)).unwrap_or(&[])
    }

    fn light(&self, near: &NearLight) -> Option<(&'a super::form_factor::LightGeometry, Vec3)> {
        let light = near.light as usize;
        Some((self.lights.geometry.get(light)?, *self.radiosity.get(light)?))
    }
}

/// The share of a near light that the blended probes see.
fn visibility(near: &NearLight, blend: &Blend) -> f32 {
    let mut seen = 0.0;
    for i in 0..blend.count as usize {
        let byte = (near.visibility[i / 4] >> (8 * (i % 4))) & 0xff;
        seen += blend.weights[i] * byte as f32;
    }
    seen / FULL_VISIBILITY
}

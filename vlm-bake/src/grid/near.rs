//! Which lights a probe leaves to the pixels around it, and how much of them it sees.

use rayon::prelude::*;
use vlm_format::Probe;
use vlm_shaders::cpu::form_factor::{form_factor, is_behind};
use vlm_shaders::cpu::upload::LightSet;

use super::pool::Place;
use super::transport::Row;
use super::{GridInput, GridOptions};

/// A light is near where its form factor may change over the probe's reach by more than this share of all that the probe gets. Lower values make
/// more lights near.
const LEAST_CHANGE: f32 = 2e-3;

/// A near light may seem up to this many times as bright as it is, since it lies behind the surface that the probe sees. What is beyond
/// stays far.
const MOST_BRIGHT: f32 = 2.0;

/// A near light of a probe.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NearLight {
    /// Its number.
    pub light: u32,
    /// Its form factor at the probe.
    pub form_factor: f32,
    /// What the probe gets of its sources.
    pub row: Row,
}

/// Splits each row into near lights, ascending, and the rest.
#[must_use]
pub fn split(
    input: &GridInput,
    places: &[Place],
    probes: &[Probe],
    rows: Vec<Row>,
    options: &GridOptions,
) -> (Vec<Vec<NearLight>>, Vec<Row>) {
    let part = |(i, row)| input.split(&places[i], &probes[i], row, options.near as usize);
    rows.into_par_iter().enumerate().map(part).unzip()
}

/// A light of a row that may become near.
struct Candidate {
    /// By how much the probe's light may change over its reach.
    change: f32,
    light: u32,
    /// Irradiance per radiosity of its surface, as the row has it.
    share: f32,
    form_factor: f32,
}

impl GridInput<'_> {
    fn split(&self, place: &Place, probe: &Probe, mut row: Row, most: usize) -> (Vec<NearLight>, Row) {
        let mut all: Vec<NearLight> = Vec::new();
        let mut near_shares: Vec<f32> = Vec::new();
        for Candidate { light, share, form_factor, .. } in self.candidates(place, probe, &row, most) {
            near_shares
                .push((MOST_BRIGHT * form_factor / (share * self.area_gains[light as usize])).min(1.0));
            all.push(NearLight { light, form_factor, row: Row::new() });
        }
        for (source, share) in &mut row {
            if let Some(light) = self.light_of(*source)
                && let Ok(i) = all.binary_search_by_key(&light, |near| near.light)
            {
                all[i].row.push((*source, *share * near_shares[i]));
                *share *= 1.0 - near_shares[i];
            }
        }
        row.retain(|(_, share)| *share > 0.0);
        (all, row)
    }

    /// The lights that change most, ascending by light.
    fn candidates(&self, place: &Place, probe: &Probe, row: &Row, most: usize) -> Vec<Candidate> {
        let all: f32 = row.iter().map(|(_, share)| share).sum();
        let mut by_light: Row =
            row.iter().filter_map(|&(source, share)| Some((self.light_of(source)?, share))).collect();
        by_light.sort_by_key(|(light, _)| *light);
        let candidate = |same: &[(u32, f32)]| {
            let light = same[0].0;
            let share: f32 = same.iter().map(|(_, share)| share).sum();
            let change = share * change(self.lights, probe, light);
            if change <= LEAST_CHANGE * all
                || self.lights.tags[light as usize] != 0
                || self.area_gains[light as usize] <= 0.0
            {
                return None;
            }
            Some(Candidate { change, light, share, form_factor: seen(self.lights, place, light)? })
        };
        let mut candidates: Vec<Candidate> =
            by_light.chunk_by(|a, b| a.0 == b.0).filter_map(candidate).collect();
        candidates.sort_by(|a, b| b.change.total_cmp(&a.change).then(a.light.cmp(&b.light)));
        candidates.truncate(most);
        candidates.sort_by_key(|c| c.light);
        candidates
    }
}

/// The form factor at a place; `None` where there is none.
fn seen(lights: &LightSet, place: &Place, light: u32) -> Option<f32> {
    let geometry = &lights.geometry[light as usize];
    let surface = &place.surface;
    if is_behind(geometry, surface.position, surface.geometric_normal) {
        return None;
    }
    Some(form_factor(geometry, surface.position, surface.normal)).filter(|&f| f > 1e-6)
}

/// By what share a light's form factor may change over a probe's reach, beyond what a slope follows: the square of reach over distance.
fn change(lights: &LightSet, probe: &Probe, light: u32) -> f32 {
    let centroid = lights.geometry[light as usize].centroid();
    let reach = probe.reach.iter().copied().fold(0.0, f32::max);
    (reach * reach / centroid.distance_squared(probe.position)).min(1.0)
}

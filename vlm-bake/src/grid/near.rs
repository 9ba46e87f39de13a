//! Which lights a probe leaves to the pixels around it, and how much of them it sees.

use rayon::prelude::*;
use vlm_format::{FULL_VISIBILITY, Probe};
use vlm_shaders::cpu::form_factor::{form_factor, is_behind};
use vlm_shaders::cpu::upload::LightSet;

use super::GridOptions;
use super::pool::Place;
use super::transport::Row;

/// A light is near where its form factor may change over the probe's reach by more than this share of all that the probe gets. Lower values make
/// more lights near.
const LEAST_CHANGE: f32 = 2e-3;

/// Near lights of a probe with their visibility in units of [`FULL_VISIBILITY`], ascending by light.
pub type NearRow = Vec<(u32, u8)>;

/// Splits each row into near lights and the rest.
#[must_use]
pub fn split(
    lights: &LightSet,
    places: &[Place],
    probes: &[Probe],
    rows: Vec<Row>,
    options: &GridOptions,
) -> (Vec<NearRow>, Vec<Row>) {
    let parts = rows.into_par_iter().enumerate().map(|(i, row)| {
        split_row(lights, &places[i], &probes[i], row, options.near as usize)
    });
    parts.unzip()
}

fn split_row(lights: &LightSet, place: &Place, probe: &Probe, row: Row, most: usize) -> (NearRow, Row) {
    let all: f32 = row.iter().map(|(_, share)| share).sum();
    let mut changing: Vec<(f32, usize, f32)> = Vec::new();
    for (i, &(light, share)) in row.iter().enumerate() {
        if lights.tags[light as usize] != 0 {
            continue;
        }
        let Some(form_factor) = seen(lights, place, light) else { continue };
        let change = share * change(lights, probe, light);
        if change > LEAST_CHANGE * all {
            changing.push((change, i, form_factor));
        }
    }
    changing.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    changing.truncate(most);
    changing.sort_by_key(|(_, i, _)| *i);
    let mut far = row;
    let mut near = NearRow::with_capacity(changing.len());
    for (_, i, form_factor) in changing {
        let (light, share) = far[i];
        // What a byte cannot hold stays far, so that both together are the whole.
        let visibility = (share / form_factor * FULL_VISIBILITY).round().clamp(0.0, 255.0);
        if visibility > 0.0 {
            near.push((light, visibility as u8));
            far[i].1 = (share - form_factor * visibility / FULL_VISIBILITY).max(0.0);
        }
    }
    far.retain(|(_, share)| *share > 0.0);
    (near, far)
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
    let corners = lights.geometry[light as usize].corners();
    let centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
    let reach = probe.reach.iter().copied().fold(0.0, f32::max);
    (reach * reach / centroid.distance_squared(probe.position)).min(1.0)
}

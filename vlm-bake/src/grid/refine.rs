//! Where probes should lie closer: a rough grid is compared with the light itself at other places, under several lightings.
//!
//! If the error of blending grows with the spacing `s` of probes as `e s^q`, then of all spacings that take the same number of probes the
//! squared error is least where `s ~ e^(-1 / (q + 1))`: the derivative of `e^2 s^(2 q)` by the density `1 / s^2` is then the same everywhere.

use glam::Vec3;
use rayon::prelude::*;
use vlm_format::Grid;
use vlm_shaders::cpu::gather_static::Frame;
use vlm_shaders::cpu::grid::{blend, leaf_at};
use vlm_shaders::cpu::punctual::PunctualLight;
use vlm_shaders::cpu::refresh::{far_sources, refresh};
use vlm_shaders::cpu::resolve::luminance;

use super::GridInput;
use super::pool::Place;
use super::transport::{Row, transport};

/// Places that are compared, per probe of the rough grid. Higher values find smaller errors.
const PLACES_PER_PROBE: usize = 4;

/// Rays of each. Fewer of them hide small errors in noise.
const RAYS: u32 = 128;

/// `1 / (q + 1)` with `q` near 1: borders of shadow are steps, all else is smooth.
const EXPONENT: f32 = 0.45;

/// Spacing shrinks to no less than this share of what openness alone asks for.
const SHRINK: f32 = 0.25;

/// Spacing grows by at most this factor, since what was not found may be there all the same.
const GROW: f32 = 1.6;

/// Errors are relative to the light at their place, or where it is dark to at least about this share of the mean. Lower values give dark rooms
/// more of the probes, and bright ones fewer.
const DARKEST: f32 = 0.1;

/// Errors below this share of the light do not count.
const NEGLIGIBLE: f32 = 0.01;

/// Point lights that are tried, beside the scene's own and two suns.
const POINT_LIGHTS: usize = 3;

/// Directions to suns that are tried: high, from two sides.
const SUNS: [Vec3; 2] = [Vec3::new(0.5, 1.0, 0.3), Vec3::new(-0.4, 1.0, -0.5)];

/// Changes the openness of the pool's places, which is what spacing follows, by how much `rough` errs around them.
pub fn refine(input: &GridInput, pool: &mut [Place], rough: &Grid) {
    let step = pool.len().div_ceil(rough.probes.len().max(1) * PLACES_PER_PROBE).max(1);
    let compared: Vec<Place> = pool.iter().step_by(step).copied().collect();
    let rows = compared
        .par_iter()
        .enumerate()
        .map(|(i, place)| transport(input.trace, input.stand_ins, &place.surface, RAYS, i as u64));
    let rows: Vec<Row> = rows.collect();
    let mut squared = vec![0.0_f32; compared.len()];
    for lights in lightings(input, pool) {
        add_errors(input, rough, &lights, &compared, &rows, &mut squared);
    }
    let of_probe = spread_to_probes(rough, &compared, &squared);
    let mut sorted = of_probe.clone();
    sorted.sort_by(f32::total_cmp);
    let Some(&median) = sorted.get(sorted.len() / 2) else { return };
    let floor = NEGLIGIBLE * NEGLIGIBLE;
    pool.par_iter_mut().for_each(|place| {
        let error = blended(rough, place, &of_probe).unwrap_or(median);
        let factor = ((error + floor) / (median + floor)).powf(-0.5 * EXPONENT);
        place.openness *= factor.clamp(SHRINK, GROW);
    });
}

/// The sets of lights that are tried; the scene's own come first.
fn lightings(input: &GridInput, pool: &[Place]) -> Vec<Vec<PunctualLight>> {
    let mut all = vec![input.trace.lights().to_vec()];
    all.extend(SUNS.map(|sun| vec![PunctualLight::directional(-sun.normalize_or_zero(), Vec3::ONE)]));
    let reach = pool.iter().map(|p| p.openness).filter(|o| o.is_finite()).fold(0.0, f32::max);
    all.extend((0..POINT_LIGHTS.min(pool.len())).map(|i| {
        let place = &pool[(2 * i + 1) * pool.len() / (2 * POINT_LIGHTS)];
        let height = 0.5 * place.openness.min(reach);
        vec![PunctualLight::point(
            place.surface.position + height * place.surface.geometric_normal,
            Vec3::ONE,
        )]
    }));
    all
}

/// Adds the squared error of the grid over the squared light there, less what noise alone would make.
fn add_errors(
    input: &GridInput,
    grid: &Grid,
    lights: &[PunctualLight],
    places: &[Place],
    rows: &[Row],
    squared: &mut [f32],
) {
    let radiosity = white_radiosity(input, lights);
    let exact: Vec<Sampled> = rows.par_iter().map(|row| Sampled::new(row, &radiosity)).collect();
    let mean = exact.iter().map(|e| e.irradiance).sum::<f32>() / exact.len().max(1) as f32;
    if mean <= 0.0 {
        return;
    }
    let arrived = refresh(grid, input.lights, &far_sources(input.lights, input.uncovered), &radiosity);
    let frame = Frame { grid, lights: input.lights, arrived: &arrived };
    squared.par_iter_mut().zip(places).zip(&exact).for_each(|((squared, place), exact)| {
        let gathered = luminance(frame.gather(&place.surface.receiver(0)).irradiance);
        let error = gathered - exact.irradiance;
        let there = gathered.max(exact.irradiance) * (1.0 - DARKEST) + mean * DARKEST;
        let relative = (error * error - exact.variance).max(0.0) / (there * there);
        // Lights may be so strong that squares leave single precision; then they tell nothing.
        *squared += if relative.is_finite() { relative } else { 0.0 };
    });
}

/// What the rays of a place find.
struct Sampled {
    irradiance: f32,
    /// Of the irradiance, at most: rays are stratified.
    variance: f32,
}

impl Sampled {
    fn new(row: &Row, radiosity: &[Vec3]) -> Self {
        let mut sampled = Self { irradiance: 0.0, variance: 0.0 };
        for &(source, share) in row {
            let light = luminance(radiosity[source as usize]);
            sampled.irradiance += share * light;
            sampled.variance += share * light * light / RAYS as f32;
        }
        sampled
    }
}

/// The radiosity of the sources if all surface were white and nothing shone by itself: where probes lie must not change with colours.
fn white_radiosity(input: &GridInput, lights: &[PunctualLight]) -> Vec<Vec3> {
    let irradiance = |position, normal| input.trace.irradiance_by(lights, position, normal, normal);
    let samples = input.lights.samples.par_iter().map(|s| irradiance(s.position, s.normal));
    let mut radiosity: Vec<Vec3> = samples.collect();
    let of_lights: Vec<Vec3> = (0..input.lights.len())
        .map(|light| {
            let own = input.lights.sample_range(light).unwrap_or_default();
            own.map(|sample| radiosity[sample] * input.shares[sample]).sum()
        })
        .collect();
    radiosity.extend(of_lights);
    radiosity.par_extend(input.uncovered.par_iter().map(|piece| irradiance(piece.position, piece.normal)));
    radiosity
}

/// The probes that serve a place, with their weights.
fn serving<'g>(grid: &'g Grid, place: &Place) -> impl Iterator<Item = (usize, f32)> + 'g {
    let receiver = place.surface.receiver(0);
    let blend = leaf_at(grid, receiver.position).map(|leaf| blend(grid, leaf, &receiver)).unwrap_or_default();
    (0..blend.count as usize)
        .map(move |i| (grid.leaf_probes[blend.first as usize + i] as usize, blend.weights[i]))
}

/// The mean squared error around each probe.
fn spread_to_probes(grid: &Grid, places: &[Place], squared: &[f32]) -> Vec<f32> {
    let mut sums = vec![(0.0_f32, 0.0_f32); grid.probes.len()];
    for (place, squared) in places.iter().zip(squared) {
        for (probe, weight) in serving(grid, place) {
            sums[probe].0 += weight * squared;
            sums[probe].1 += weight;
        }
    }
    sums.iter().map(|(sum, weight)| if *weight > 0.0 { sum / weight } else { 0.0 }).collect()
}

fn blended(grid: &Grid, place: &Place, of_probe: &[f32]) -> Option<f32> {
    let (mut sum, mut weights) = (0.0, 0.0);
    for (probe, weight) in serving(grid, place) {
        sum += weight * of_probe[probe];
        weights += weight;
    }
    (weights > 0.0).then(|| sum / weights)
}

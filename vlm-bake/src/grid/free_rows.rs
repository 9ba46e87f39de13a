//! The rows of probes in free space: in which share of all directions each source lies, by rays.
//!
//! A frame knows of a source no more than its middle. Close by, light does not come from there: so the shares are weighed anew, as little
//! as it takes for light of all sources alike to come from where the rays met them, up to the second band of spherical harmonics.

use glam::Vec3;
use rayon::prelude::*;
use vlm_shaders::cpu::free_light::{COEFFICIENTS, FreeLight, harmonics};
use vlm_shaders::cpu::refresh::{FarSource, far_sources};

use super::transport::{Row, shares, whole_lights};
use super::{GridInput, made_lights};
use crate::reference::directions_around;

/// How often shares are weighed anew: a source's bands fade with its share.
const ROUNDS: usize = 4;

/// No share becomes smaller or larger than this, relative to what it was. Wider limits follow directions more closely and let some sources
/// count for others.
const CHANGE: [f32; 2] = [0.1, 10.0];

/// Added to the diagonal of the equations, which sources in one plane leave without a solution.
const FIRM: f64 = 1e-5;

/// The rows of places in free space (metres).
#[must_use]
pub fn free_rows(input: &GridInput, places: &[Vec3], rays: u32) -> Vec<Row> {
    if places.is_empty() {
        return Vec::new();
    }
    let made = made_lights::made_lights(input);
    let sources = far_sources(input.lights, input.uncovered);
    let row = |(i, &place): (usize, &Vec3)| {
        let mut wanted = Moments::default();
        let met = directions_around(rays, i as u64);
        let row = shares(input.trace, input.stand_ins, place, met, rays, |direction| {
            wanted.add(direction, 1.0 / f64::from(rays));
        });
        let mut row = whole_lights(input, place, &row);
        weigh(&mut row, place, &sources, &wanted);
        made_lights::add_around(input, &made, place, &mut row);
        row
    };
    places.par_iter().enumerate().map(row).collect()
}

/// Light of all sources alike, by spherical harmonics.
#[derive(Clone, Copy, Default)]
struct Moments([f64; COEFFICIENTS]);

impl Moments {
    fn add(&mut self, direction: Vec3, share: f64) {
        for (moment, harmonic) in self.0.iter_mut().zip(harmonics(direction)) {
            *moment += share * f64::from(harmonic);
        }
    }
}

/// Changes the shares so that a frame finds the wanted light where all sources are alike.
fn weigh(row: &mut Row, place: Vec3, sources: &[FarSource], wanted: &Moments) {
    let direction = |source: u32| {
        sources.get(source as usize).map_or(Vec3::ZERO, |s| (s.centroid - place).normalize_or_zero())
    };
    let all: Vec<[f64; COEFFICIENTS]> =
        row.iter().map(|(source, _)| harmonics(direction(*source)).map(f64::from)).collect();
    let counted: Vec<f32> = row.iter().map(|(_, share)| *share).collect();
    let sum: f32 = counted.iter().sum();
    for _ in 0..ROUNDS {
        let mut equations = [[0.0; COEFFICIENTS + 1]; COEFFICIENTS];
        for (i, equation) in equations.iter_mut().enumerate() {
            equation[i] = FIRM;
            equation[COEFFICIENTS] = wanted.0[i];
        }
        for ((_, share), harmonics) in row.iter().zip(&all) {
            add_source(&mut equations, *share, harmonics);
        }
        let factors = solve(equations);
        for (((_, share), harmonics), counted) in row.iter_mut().zip(&all).zip(&counted) {
            let change: f64 = factors.iter().zip(harmonics).map(|(f, h)| f * h).sum();
            *share = (*share * (1.0 + change) as f32).clamp(CHANGE[0] * counted, CHANGE[1] * counted);
        }
        // Limits must not make light.
        let scale = sum / row.iter().map(|(_, share)| share).sum::<f32>().max(f32::MIN_POSITIVE);
        row.iter_mut().for_each(|(_, share)| *share *= scale);
    }
}

/// A source changes by one plus factors times its harmonics: what that adds to each moment, and what it gives as it is.
fn add_source(
    equations: &mut [[f64; COEFFICIENTS + 1]; COEFFICIENTS],
    share: f32,
    harmonics: &[f64; COEFFICIENTS],
) {
    for (i, equation) in equations.iter_mut().enumerate() {
        let seen = f64::from(share * FreeLight::blur(share)[FreeLight::band(i)]) * harmonics[i];
        for (term, harmonic) in equation.iter_mut().zip(harmonics) {
            *term += seen * harmonic;
        }
        equation[COEFFICIENTS] -= seen;
    }
}

/// Solves linear equations, whose right side stands last, by elimination with pivots; 0 for what they leave open.
fn solve(mut rows: [[f64; COEFFICIENTS + 1]; COEFFICIENTS]) -> [f64; COEFFICIENTS] {
    for column in 0..COEFFICIENTS {
        let size = |row: &usize| rows[*row][column].abs();
        let pivot = (column..COEFFICIENTS).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(column);
        rows.swap(column, pivot);
        let upper = rows[column];
        if upper[column].abs() < f64::MIN_POSITIVE {
            continue;
        }
        for (_, row) in rows.iter_mut().enumerate().filter(|(number, _)| *number != column) {
            let factor = row[column] / upper[column];
            row.iter_mut().zip(upper).for_each(|(a, b)| *a -= factor * b);
        }
    }
    std::array::from_fn(|i| {
        let solution = rows[i][COEFFICIENTS] / rows[i][i];
        if solution.is_finite() { solution } else { 0.0 }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_are_solved() {
        let mut rows = [[0.0; COEFFICIENTS + 1]; COEFFICIENTS];
        for (i, row) in rows.iter_mut().enumerate() {
            row[(i + 1) % COEFFICIENTS] = 2.0;
            row[i] = 1.0;
            row[COEFFICIENTS] = 3.0;
        }
        assert!(solve(rows).iter().all(|x| (x - 1.0).abs() < 1e-9));
        assert_eq!(solve([[0.0; COEFFICIENTS + 1]; COEFFICIENTS]), [0.0; COEFFICIENTS]);
    }

    #[test]
    fn light_that_comes_from_beside_the_middles_is_put_right() {
        let middles: Vec<Vec3> = directions_around(60, 1).map(|d| d + Vec3::new(0.1, 0.0, 0.2)).collect();
        let source = |centroid: &Vec3| FarSource { centroid: *centroid, ..FarSource::default() };
        let sources: Vec<FarSource> = middles.iter().map(source).collect();
        let mut wanted = Moments::default();
        directions_around(600, 2).for_each(|direction| wanted.add(direction, 1.0 / 600.0));
        let mut row: Row = (0..60).map(|source| (source, 1.0 / 60.0)).collect();
        let worst = |row: &Row| {
            let mut light = FreeLight::default();
            for (source, share) in row {
                light.add(middles[*source as usize].normalize_or_zero(), *share, Vec3::ONE);
            }
            let normals = directions_around(50, 3);
            normals.map(|n| (light.irradiance(n).x - 1.0).abs()).fold(0.0, f32::max)
        };
        assert!(worst(&row) > 0.1, "the negative control");
        weigh(&mut row, Vec3::ZERO, &sources, &wanted);
        assert!(worst(&row) < 0.01, "{}", worst(&row));
    }
}

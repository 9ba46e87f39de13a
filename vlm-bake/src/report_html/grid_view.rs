//! What the pictures show of the static grid: where its probes lie, and what a pixel reads.

use glam::Vec3;
use image::{Rgb, RgbImage};
use vlm_format::{Grid, Probe};
use vlm_shaders::cpu::grid::{blend, leaf_at};

use super::colour::ramp;
use super::facts::{Evidence, Fact, View};
use super::views::project;
use crate::camera::CameraRays;
use crate::grid_content::{near_lights, probes_of_leaf};
use crate::scene::Camera;

/// With more probes in a picture, a dot is one pixel, else three by three.
const FEW_DOTS: usize = 3000;

/// A probe shows where the surface in its pixel lies within these shares of its distance to the eye: off the surface, and along it.
const SHOWS: [f32; 2] = [0.004, 0.02];

/// Of the values that end a ramp, all but this share at either end lie within.
const OUTSIDE: f64 = 0.02;

/// Where the ramps of the grid's pictures end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GridScales {
    /// Least and greatest reach of probes along the surface, metres.
    pub reach_m: [f64; 2],
    /// Most near lights of a pixel; at least 1.
    pub near: f64,
}

impl GridScales {
    /// Of a grid over its probes and leaves.
    pub fn new(grid: &Grid) -> Self {
        let surface = grid.probes.iter().take(grid.surface_probes as usize);
        let mut reaches: Vec<f64> = surface.map(reach_m).collect();
        reaches.sort_unstable_by(f64::total_cmp);
        let leaves = grid.leaves.windows(2).map(|leaf| probes_of_leaf(grid, leaf));
        let mut near: Vec<f64> = leaves.map(|list| near_lights(grid, list.iter().copied()) as f64).collect();
        near.sort_unstable_by(f64::total_cmp);
        Self {
            reach_m: [OUTSIDE, 1.0 - OUTSIDE].map(|share| percentile(&reaches, share)),
            near: percentile(&near, 1.0 - OUTSIDE).max(1.0),
        }
    }

    /// Logarithmic.
    fn of_reach(&self, probe: &Probe) -> [u8; 3] {
        let [low, high] = self.reach_m;
        ramp((reach_m(probe) / low).ln() / (high / low).max(1.0 + 1e-6).ln())
    }
}

fn percentile(ascending: &[f64], share: f64) -> f64 {
    ascending.get((ascending.len() as f64 * share) as usize).or(ascending.last()).copied().unwrap_or(0.0)
}

/// How far a probe counts along the surface, the mean of four sides.
fn reach_m(probe: &Probe) -> f64 {
    f64::from(probe.reach.iter().sum::<f32>()) / 4.0
}

/// The number of near lights that a point evaluates; `None` where no cell holds it.
pub fn near_lights_at(grid: &Grid, fact: &Fact) -> Option<usize> {
    let point = &fact.point;
    let leaf = leaf_at(grid, point.position)?;
    let blend = blend(grid, leaf, &point.receiver(fact.surface_tag));
    let counting = (0..blend.count as usize).filter(|&i| blend.weights[i] > 0.0);
    let probes = counting.filter_map(|i| grid.leaf_probes.get(blend.first as usize + i).copied());
    Some(near_lights(grid, probes))
}

/// Draws the probes on surface that the camera sees as dots in the colour of their reach.
pub fn dots(evidence: &Evidence, view: &View, camera: &Camera, scales: &GridScales, picture: &mut RgbImage) {
    let Some(grid) = &evidence.asset.grid else { return };
    let rays = CameraRays::new(camera, view.width, view.height);
    let surface = grid.probes.iter().take(grid.surface_probes as usize);
    let seen: Vec<([u32; 2], &Probe)> =
        surface.filter_map(|probe| Some((pixel(view, camera, &rays, probe)?, probe))).collect();
    let radius = i64::from(seen.len() <= FEW_DOTS);
    for ([x, y], probe) in seen {
        let colour = scales.of_reach(probe);
        for (dx, dy) in (-radius..=radius).flat_map(|dy| (-radius..=radius).map(move |dx| (dx, dy))) {
            let at = (u32::try_from(i64::from(x) + dx), u32::try_from(i64::from(y) + dy));
            if let (Ok(x), Ok(y)) = at
                && let Some(pixel) = picture.get_pixel_mut_checked(x, y)
            {
                *pixel = Rgb(colour);
            }
        }
    }
}

/// The pixel in which a probe shows; `None` where it is hidden or outside.
fn pixel(view: &View, camera: &Camera, rays: &CameraRays, probe: &Probe) -> Option<[u32; 2]> {
    let aspect = f64::from(view.width) / f64::from(view.height);
    let [x, y] = project(camera, aspect, probe.position.as_dvec3())?;
    let (x, y) = ((x * f64::from(view.width)).floor(), (y * f64::from(view.height)).floor());
    if x < 0.0 || y < 0.0 || x >= f64::from(view.width) || y >= f64::from(view.height) {
        return None;
    }
    let (x, y) = (x as u32, y as u32);
    let fact = view.facts.get((y * view.width + x) as usize)?.as_ref()?;
    let away: Vec3 = probe.position - fact.point.position;
    let distance = fact.point.position.distance(rays.through(x, y).origin);
    let off = away.dot(fact.point.geometric_normal).abs();
    let shows = off < SHOWS[0] * distance
        && away.length() < SHOWS[1] * distance
        && probe.normal.dot(fact.point.geometric_normal) > 0.0;
    shows.then_some([x, y])
}

#[cfg(test)]
mod tests {
    use super::*;
    use vlm_format::Leaf;

    #[test]
    fn ramps_end_where_nearly_all_values_do() {
        let probe = |reach: f32| Probe { reach: [reach; 4], ..Probe::default() };
        let grid = Grid {
            probes: (1..=100).map(|i| probe(i as f32)).collect(),
            surface_probes: 100,
            leaves: vec![Leaf { probes: 0, free_probes: 1 }, Leaf { probes: 1, free_probes: 1 }],
            leaf_probes: vec![0],
            near_starts: [vec![0], vec![3; 100]].concat(),
            near: vec![5, 6, 7],
            ..Grid::default()
        };
        let scales = GridScales::new(&grid);
        assert_eq!(scales, GridScales { reach_m: [3.0, 99.0], near: 3.0 });
        assert_eq!(scales.of_reach(&probe(3.0)), ramp(0.0));
        assert_eq!(scales.of_reach(&probe(99.0)), ramp(1.0));
        assert_eq!(GridScales::new(&Grid::default()), GridScales { reach_m: [0.0; 2], near: 1.0 });
    }
}

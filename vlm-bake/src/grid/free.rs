//! Probes in free space, in the volumes in which moving objects need light.
//!
//! A lattice fills each volume; what lies in something solid moves out of it, what lies close to a surface moves off. Places that none of
//! these probes reaches, behind posts and slanted walls, get probes of their own.

use glam::{DVec3, IVec3, UVec3, Vec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use vlm_format::Probe;
use vlm_shaders::cpu::grid::leaf_at;

use super::{GridInput, cells_between, free_reach, spacing, tree};
use crate::reference::directions_around;
use crate::scene::Scene;
use crate::shade::TraceScene;
use crate::topology::area;

/// Probes are never closer than this share of the scene's extent: half of the widest spacing on surface.
const NARROWEST: f64 = 0.5 * spacing::WIDEST as f64;

/// Nor closer than this many times the edge of the surface around a sample: light is not known more finely.
const OF_SAMPLE: f64 = 1.4;

/// The most free probes over those on surface. More of them follow light through space more closely; file and refresh grow in proportion.
const MOST: f32 = 0.5;

/// At least so many are allowed.
const LEAST: usize = 64;

/// The lattice takes this share of them, places that it does not reach the rest.
const LATTICE: f32 = 0.7;

/// Reach over spacing. Higher values blend more probes, which smooths their noise and blurs borders.
const REACH: f32 = 1.1;

/// Probes keep this distance from surface, over the spacing: closer by, the samples on it are no longer small.
const OFF: f32 = 0.2;

/// Two probes are at least this far apart, over the spacing.
const APART: f32 = 0.45;

/// Places from which this share of directions meets backs lie inside something.
const MOST_BACKS: f32 = 0.5;

/// Rays by which a place finds out.
const LOOKS: u32 = 64;

/// A place is reached where some probe holds it deeper than this ([`Probe::depth`]).
const REACHED: f32 = 0.1;

/// Places in a lattice's cell along each axis that are to be reached.
const PLACES: u32 = 2;

/// Rounds in which places that no probe reaches get probes, at these distances over the spacing.
const COVERING: [f32; 3] = [0.6, 0.4, 0.3];

/// The probes in the volumes of a scene, their rows still empty; none without volumes. `surface` are those on surface.
#[must_use]
pub fn probes(input: &GridInput, bounds: [DVec3; 2], surface: &[Probe]) -> Vec<Probe> {
    let (trace, scene) = (input.trace, input.trace.scene);
    if scene.volumes.is_empty() {
        return Vec::new();
    }
    let most = ((surface.len() as f32 * MOST) as usize).max(LEAST);
    let widest = (bounds[1] - bounds[0]).max_element();
    let narrowest = (NARROWEST * widest).max(OF_SAMPLE * sample_edge(input));
    let step = step(&scene.volumes, narrowest, (LATTICE * most as f32) as usize);
    let builder = Builder { trace, step: step as f32 };
    let places: Vec<Vec3> = scene.volumes.iter().flat_map(|volume| lattice(volume, step, 1)).collect();
    let mut taken = Taken::new(APART * builder.step);
    let settled: Vec<Option<Vec3>> = places.par_iter().map(|&p| builder.settle(p)).collect();
    let mut all = builder.probes(&taken.choose(settled.into_iter().flatten(), most));
    let wanted: Vec<Vec3> = scene.volumes.iter().flat_map(|v| lattice(v, step, PLACES)).collect();
    let wanted: Vec<Vec3> = wanted.into_par_iter().filter(|&p| builder.is_free(p)).collect();
    let bounds = with_volumes(scene, bounds);
    for share in COVERING {
        let missed = missed(scene, bounds, &all, &wanted);
        let missed: Vec<Vec3> = missed.into_par_iter().map(|p| builder.moved_off(p)).collect();
        let mut round = Taken::new(share * builder.step);
        all.extend(builder.probes(&round.choose(missed, most.saturating_sub(all.len()))));
    }
    all
}

/// The box around the scene and its volumes.
#[must_use]
pub fn with_volumes(scene: &Scene, bounds: [DVec3; 2]) -> [DVec3; 2] {
    scene.volumes.iter().fold(bounds, |[low, high], [l, h]| [low.min(*l), high.max(*h)])
}

/// Edge of the surface around a sample, metres, on average.
fn sample_edge(input: &GridInput) -> f64 {
    let corners = input.lights.geometry.iter().map(|light| light.corners().map(Vec3::as_dvec3));
    let area: f64 = corners.map(area).sum();
    (area / input.light_of_sample.len().max(1) as f64).sqrt()
}

/// The narrowest spacing, metres, with which the lattices have no more than `most` places.
fn step(volumes: &[[DVec3; 2]], narrowest: f64, most: usize) -> f64 {
    let widest = volumes.iter().map(|[low, high]| (*high - *low).max_element()).fold(0.0, f64::max);
    let count = |step: f64| -> u64 {
        let cells = |volume| divisions(volume, step).to_array().map(u64::from).iter().product::<u64>();
        volumes.iter().map(cells).sum()
    };
    let mut step = narrowest.max(f64::MIN_POSITIVE);
    while step < widest && count(step) > most as u64 {
        step *= 1.02;
    }
    step
}

/// Cells of a volume along each axis, none longer than `step`.
fn divisions([low, high]: &[DVec3; 2], step: f64) -> UVec3 {
    ((*high - *low) / step).ceil().max(DVec3::ONE).as_uvec3()
}

/// The middles of a volume's cells, each cut in `parts` along each axis.
fn lattice(volume: &[DVec3; 2], step: f64, parts: u32) -> Vec<Vec3> {
    let [low, high] = *volume;
    let count = divisions(volume, step) * parts;
    let cells = cells_between(IVec3::ZERO, count.as_ivec3() - 1);
    let middle = |cell: IVec3| low + (high - low) * (cell.as_dvec3() + 0.5) / count.as_dvec3();
    cells.map(|cell| middle(cell).as_vec3()).collect()
}

struct Builder<'a> {
    trace: &'a TraceScene<'a>,
    /// Spacing, metres.
    step: f32,
}

impl Builder<'_> {
    fn probes(&self, places: &[Vec3]) -> Vec<Probe> {
        places.par_iter().map(|&p| free_reach::probe(self.trace, p, REACH * self.step)).collect()
    }

    /// Where to put the probe that is wanted at a place; `None` where all around is solid.
    fn settle(&self, place: Vec3) -> Option<Vec3> {
        let place = if self.is_inside(place) { self.way_out(place)? } else { place };
        Some(self.moved_off(place))
    }

    fn is_inside(&self, place: Vec3) -> bool {
        let back = |direction: &Vec3| {
            self.trace.path_hit(place, *direction).is_some_and(|hit| !self.trace.is_lit_side(&hit))
        };
        directions_around(LOOKS, 0).filter(back).count() as f32 > MOST_BACKS * LOOKS as f32
    }

    /// The nearest place outside of what holds this one.
    fn way_out(&self, place: Vec3) -> Option<Vec3> {
        let exit = |direction: Vec3| {
            let hit = self.trace.path_hit_within(place, direction, 0.5 * self.step)?;
            Some((hit.distance, direction)).filter(|_| !self.trace.is_lit_side(&hit))
        };
        let exits = directions_around(LOOKS, 0).filter_map(exit);
        let (distance, direction) = exits.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let outside = place + direction * (distance + OFF * self.step);
        (!self.is_inside(outside)).then_some(outside)
    }

    /// The place, or one nearby that is not as close to surface.
    fn moved_off(&self, place: Vec3) -> Vec3 {
        let wanted = OFF * self.step;
        let room = |place: Vec3| self.trace.bvh.closest(place, wanted, |_| true);
        let Some(nearest) = room(place) else { return place };
        let Some(away) = (place - nearest.point).try_normalize() else { return place };
        let most = wanted - nearest.distance;
        let free = self.trace.path_hit_within(place, away, 2.0 * most).map_or(most, |hit| 0.5 * hit.distance);
        let moved = place + away * free;
        let is_better = room(moved).is_none_or(|there| there.distance > nearest.distance);
        if is_better { moved } else { place }
    }

    /// True for places that receivers may reach: outside of solids, and not right at a surface.
    fn is_free(&self, place: Vec3) -> bool {
        let touched = self.trace.bvh.closest(place, 0.25 * OFF * self.step, |_| true);
        touched.is_none() && !self.is_inside(place)
    }
}

/// The places that no probe reaches.
fn missed(scene: &Scene, bounds: [DVec3; 2], probes: &[Probe], places: &[Vec3]) -> Vec<Vec3> {
    let grid = tree::tree_with_free(scene, bounds, probes, 0, None);
    let is_reached = |&&place: &&Vec3| {
        let Some(leaf) = leaf_at(&grid, place).map(|leaf| leaf as usize) else { return false };
        let [from, to] = [grid.leaves[leaf].free_probes, grid.leaves[leaf + 1].probes];
        let depth = |&probe: &u32| probes[probe as usize].depth(probes[probe as usize].local(place));
        grid.leaf_probes[from as usize..to as usize].iter().any(|probe| depth(probe) > REACHED)
    };
    places.par_iter().filter(|place| !is_reached(place)).copied().collect()
}

/// Places that keep others away.
struct Taken {
    distance: f32,
    cells: FxHashMap<IVec3, Vec<Vec3>>,
}

impl Taken {
    fn new(distance: f32) -> Self {
        Self { distance: distance.max(f32::MIN_POSITIVE), cells: FxHashMap::default() }
    }

    /// Takes those that are free, in their order, at most so many.
    fn choose(&mut self, places: impl IntoIterator<Item = Vec3>, most: usize) -> Vec<Vec3> {
        let mut chosen = Vec::new();
        for place in places {
            let cell = (place / self.distance).floor().as_ivec3();
            let near = |other: &Vec3| other.distance_squared(place) < self.distance * self.distance;
            let mut around = cells_between(cell - 1, cell + 1);
            let is_taken =
                around.any(|cell| self.cells.get(&cell).is_some_and(|there| there.iter().any(near)));
            if chosen.len() < most && !is_taken {
                self.cells.entry(cell).or_default().push(place);
                chosen.push(place);
            }
        }
        chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VOLUME: [DVec3; 2] = [DVec3::ZERO, DVec3::new(4.0, 2.0, 1.0)];

    #[test]
    fn lattices_have_no_more_places_than_allowed() {
        for most in [1, 10, 100, 1000] {
            let step = step(&[VOLUME, VOLUME], 0.1, most);
            let places = lattice(&VOLUME, step, 1);
            assert!(2 * places.len() <= most.max(2), "{most}: {} places", places.len());
            assert!(step <= 4.1);
            let inside = |p: &Vec3| p.cmpgt(Vec3::ZERO).all() && p.cmplt(VOLUME[1].as_vec3()).all();
            assert!(places.iter().all(inside));
        }
        assert_eq!(step(&[VOLUME], 0.5, 1000), 0.5, "never narrower");
        assert_eq!(lattice(&[DVec3::ONE; 2], 0.5, 1), [Vec3::ONE], "a volume without extent");
    }

    #[test]
    fn taken_places_keep_others_away() {
        let places = (0..100).map(|i| Vec3::X * 0.1 * i as f32);
        let chosen = Taken::new(0.95).choose(places, 5);
        assert_eq!(chosen.len(), 5);
        assert!(chosen.windows(2).all(|pair| pair[0].distance(pair[1]) >= 0.95));
    }
}

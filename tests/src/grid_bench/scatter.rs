//! The thesis' lists of lights by cell, built by scattering instead of by testing every cell against every light.
//!
//! Each light visits the rows of cells that its ball may touch, layer by layer (`span` finds which cells of a row it reaches). A
//! layer's cells are counted, their lists begin where the counts' running sum says, and are filled in the order of the lights. Layers
//! share no cells, so they are built in parallel, and lists do not depend on the number of threads.

use glam::UVec3;
use rayon::prelude::*;

use vlm_bake::scene::Scene;
use vlm_bake::topology::Lists;

use crate::active_hemisphere::{ActiveHemisphere, Lattice};
use crate::thesis::ThesisGrid;

use super::span::{LightSpans, Rows};

/// The cells of a lattice that have a list.
#[derive(Clone, Debug)]
pub struct StoredCells {
    lattice: Lattice,
    /// For each cell of the lattice.
    stored: Vec<bool>,
}

impl StoredCells {
    /// Every cell.
    #[must_use]
    pub fn all(lattice: Lattice) -> Self {
        Self { lattice, stored: vec![true; lattice.count()] }
    }

    /// The cells that hold visible surface.
    #[must_use]
    pub fn with_surface(lattice: Lattice, scene: &Scene) -> Self {
        let crossed: Vec<u32> =
            scene.triangles.par_iter().flat_map_iter(|&corners| cells_of(scene, &lattice, corners)).collect();
        let mut stored = vec![false; lattice.count()];
        crossed.into_iter().for_each(|number| stored[number as usize] = true);
        Self { lattice, stored }
    }

    /// Their numbers, ascending.
    fn numbers(&self) -> Vec<u32> {
        (0..).zip(&self.stored).filter(|(_, stored)| **stored).map(|(number, _)| number).collect()
    }

    /// Those of the layer `z`.
    fn of_layer(&self, z: u32) -> &[bool] {
        let count = self.lattice.cells.pow(2) as usize;
        &self.stored[z as usize * count..][..count]
    }
}

/// The numbers of the cells that a triangle crosses: those of its box that its plane crosses.
fn cells_of(scene: &Scene, lattice: &Lattice, corners: [u32; 3]) -> Vec<u32> {
    let [a, b, c] = corners.map(|v| scene.positions[v as usize]);
    let normal = (b - a).cross(c - a).normalize_or_zero();
    // Half a thousandth of a cell of room keeps points that rounding pushed over a border.
    let reach = (0.5 + 5e-4) * lattice.cell.dot(normal.abs());
    let [first, last] = lattice.touched_by(a.min(b).min(c), a.max(b).max(c));
    let mut numbers = Vec::new();
    for z in first.z..=last.z {
        for y in first.y..=last.y {
            for x in first.x..=last.x {
                let [low, high] = lattice.bounds(UVec3::new(x, y, z));
                if (0.5 * (low + high) - a).dot(normal).abs() <= reach {
                    numbers.push(lattice.number(UVec3::new(x, y, z)));
                }
            }
        }
    }
    numbers
}

/// Lists of lights over stored cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightLists {
    /// The stored cells, ascending.
    pub cells: Vec<u32>,
    /// One more than cells: offsets into `entries`.
    pub starts: Vec<u32>,
    /// Numbers of lights, ascending within a cell.
    pub entries: Vec<u32>,
    /// Pairs of a cell and a light that did not fit, as lists are no longer than the thesis'.
    pub dropped: u64,
    /// Pairs of a cell and a light that were tested, and rows of cells that were left out as a whole.
    pub tests: u64,
}

impl LightLists {
    /// Each stored cell with its list.
    pub fn lists(&self) -> impl Iterator<Item = (u32, &[u32])> {
        let list = |range: &[u32]| &self.entries[range[0] as usize..range[1] as usize];
        self.cells.iter().copied().zip(self.starts.windows(2).map(list))
    }

    /// What the lists take, and what finds them, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let words = self.cells.len() + self.starts.len() + self.entries.len();
        (words * size_of::<u32>()) as u64
    }

    /// Where these lists are not the thesis'; `None` where all agree.
    #[must_use]
    pub fn disagreement(&self, thesis: &ThesisGrid) -> Option<String> {
        let differs = |&(cell, list): &(u32, &[u32])| !thesis.list_of(cell).eq(list.iter().copied());
        if let Some((cell, _)) = self.lists().find(differs) {
            return Some(format!("the list of cell {cell} is another"));
        }
        let (all, dropped) = (self.cells.len() == thesis.cells(), thesis.overflow.dropped);
        (all && self.dropped != dropped)
            .then(|| format!("{} entries did not fit, not {dropped}", self.dropped))
    }
}

/// Scatters lights into the cells that they reach; lists hold the first `longest` of their cell.
#[must_use]
pub fn scatter(lights: &[ActiveHemisphere], cells: &StoredCells, longest: u32) -> LightLists {
    let lattice = &cells.lattice;
    let spans: Vec<LightSpans> = lights.par_iter().map(|light| LightSpans::new(light, lattice)).collect();
    let layers_of = spans.iter().zip(0..).flat_map(|(spans, l)| spans.layers().map(move |z| (z, l)));
    let lights_of_layer = Lists::new(lattice.cells as usize, layers_of);
    let layers: Vec<Layer> = (0..lattice.cells)
        .into_par_iter()
        .map(|z| Layer::new(z, lights_of_layer.of(z as usize), &spans, cells, longest))
        .collect();
    let mut starts = vec![0];
    for length in layers.iter().zip(0..).flat_map(|(layer, z)| layer.lengths(cells.of_layer(z))) {
        starts.push(starts.last().copied().unwrap_or(0) + length);
    }
    LightLists {
        cells: cells.numbers(),
        starts,
        dropped: layers.iter().map(|layer| layer.dropped).sum(),
        tests: layers.iter().map(|layer| layer.tests).sum(),
        entries: filled(layers),
    }
}

/// The entries of all layers.
fn filled(layers: Vec<Layer>) -> Vec<u32> {
    let mut entries = vec![0; layers.iter().map(|layer| layer.entries as usize).sum()];
    let mut rest = &mut *entries;
    let mut parts = Vec::new();
    for layer in layers {
        let (part, after) = rest.split_at_mut(layer.entries as usize);
        parts.push((part, layer));
        rest = after;
    }
    parts.into_par_iter().for_each(|(part, layer)| layer.fill(part));
    entries
}

/// The lists of one layer's cells, to be filled; those that are not stored stay empty.
struct Layer {
    reached: Vec<Reached>,
    /// By place: where a cell's list begins among the layer's entries, and where it ends.
    ranges: Vec<[u32; 2]>,
    /// The place of each cell.
    places: Vec<u32>,
    entries: u32,
    dropped: u64,
    tests: u64,
}

/// The cells of a layer that a light reaches in a row, by their places.
struct Reached {
    light: u32,
    first: u32,
    last: u32,
}

impl Layer {
    fn new(z: u32, numbers: &[u32], spans: &[LightSpans], cells: &StoredCells, longest: u32) -> Self {
        let mut tests = 0;
        let mut reached = Vec::new();
        for &light in numbers {
            let light_here = spans[light as usize].layer(z);
            for row in light_here.rows() {
                if let Some([first, last]) = light_here.span(row, &mut tests) {
                    let start = row * cells.lattice.cells;
                    reached.push(Reached { light, first: start + first, last: start + last });
                }
            }
        }
        let rows = Rows::of(&cells.lattice);
        let places: Vec<u32> = (0..cells.lattice.cells.pow(2)).map(|cell| rows.place(cell)).collect();
        let counts = counts(&reached, places.len());
        let (mut entries, mut dropped) = (0, 0);
        let mut ranges = vec![[0_u32; 2]; places.len()];
        for (&place, _) in places.iter().zip(cells.of_layer(z)).filter(|(_, stored)| **stored) {
            let (start, count) = (entries, counts[place as usize]);
            entries += count.min(longest);
            dropped += u64::from(count.saturating_sub(longest));
            ranges[place as usize] = [start, entries];
        }
        Self { reached, ranges, places, entries, dropped, tests }
    }

    /// The lengths of the stored cells' lists.
    fn lengths(&self, stored: &[bool]) -> impl Iterator<Item = u32> {
        let length = |&place: &u32| self.ranges[place as usize][1] - self.ranges[place as usize][0];
        self.places.iter().zip(stored).filter(|(_, stored)| **stored).map(move |(place, _)| length(place))
    }

    /// Writes the lights into their lists.
    fn fill(mut self, entries: &mut [u32]) {
        for Reached { light, first, last } in self.reached {
            for [next, end] in &mut self.ranges[first as usize..=last as usize] {
                if next < end {
                    entries[*next as usize] = light;
                    *next += 1;
                }
            }
        }
    }
}

/// The lights that reach each place.
fn counts(reached: &[Reached], places: usize) -> Vec<u32> {
    // First by how many more they are than at the place before.
    let mut counts = vec![0_u32; places + 1];
    for &Reached { first, last, .. } in reached {
        counts[first as usize] = counts[first as usize].wrapping_add(1);
        counts[last as usize + 1] = counts[last as usize + 1].wrapping_sub(1);
    }
    for place in 1..places {
        counts[place] = counts[place].wrapping_add(counts[place - 1]);
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{sphere_direction, unit};
    use crate::rooms::{ALBEDO, slab};
    use crate::scenes::{add, matte};
    use crate::thesis::ThesisOptions;
    use glam::{DVec3, Vec3};
    use vlm_shaders::cpu::form_factor::LightGeometry;

    /// Lights of all sizes and directions in and around a flat box far from the origin.
    fn lights(count: u64) -> Vec<LightGeometry> {
        let light = |i: u64| {
            let at = Vec3::from([0, 1, 2].map(|axis| 1.2 * unit(axis, i) - 0.1));
            let size = 0.5 * unit(3, i).powi(3) + 1e-3;
            let corner = |k: u64| {
                size * sphere_direction((unit(10 + k, i), unit(20 + k, i))) + LOW + at * (HIGH - LOW)
            };
            LightGeometry::new([0, 1, 2].map(|k| corner(k).as_dvec3()))
        };
        (0..count).map(light).collect()
    }

    const LOW: Vec3 = Vec3::new(90.0, -4.0, 20.0);
    const HIGH: Vec3 = Vec3::new(100.0, -1.0, 26.0);
    const RANGE: f32 = 4.5;
    const LONG: u32 = 1_000;

    fn thesis(lights: &[LightGeometry], cells: u32, list: u32) -> ThesisGrid {
        let options = ThesisOptions { range: RANGE, list, grid: cells };
        ThesisGrid::build(lights, LOW, HIGH, &options)
    }

    fn scattered(lights: &[LightGeometry], cells: u32, longest: u32) -> LightLists {
        let hemispheres = ActiveHemisphere::of_all(lights, RANGE);
        scatter(&hemispheres, &StoredCells::all(Lattice::over(LOW, HIGH, cells)), longest)
    }

    #[test]
    fn lists_are_those_of_testing_everything() {
        let lights = lights(600);
        for cells in [1, 7, 20] {
            let thesis = thesis(&lights, cells, LONG);
            let lists = scattered(&lights, cells, LONG);
            assert_eq!(lists.disagreement(&thesis), None, "{cells} cells");
            assert_eq!((lists.entries.len() as u64, thesis.overflow.dropped), (thesis.entries(), 0));
            assert!(!lists.entries.is_empty() && lists.tests > 0);
        }
        assert!(scattered(&lights, 20, LONG).tests < 600 * 20_u64.pow(3) / 10);
    }

    #[test]
    fn short_lists_hold_the_first_of_them() {
        let lights = lights(600);
        let thesis = thesis(&lights, 7, 4);
        assert!(thesis.overflow.dropped > 0);
        assert_eq!(scattered(&lights, 7, 4).disagreement(&thesis), None);
    }

    #[test]
    fn another_list_is_seen() {
        let lights = lights(600);
        let thesis = thesis(&lights, 7, LONG);
        let lists = scattered(&lights, 7, LONG);
        let spoilt = |spoil: &dyn Fn(&mut LightLists)| {
            let mut lists = lists.clone();
            spoil(&mut lists);
            lists.disagreement(&thesis).is_some()
        };
        assert!(!spoilt(&|_| ()));
        assert!(spoilt(&|lists| lists.entries[0] += 1));
        assert!(spoilt(&|lists| lists.dropped += 1));
        // An entry less, and one that went to the next cell.
        assert!(spoilt(&|lists| {
            lists.entries.pop();
            lists.starts.last_mut().into_iter().for_each(|end| *end -= 1);
        }));
        assert!(spoilt(&|lists| lists.starts[3] -= 1));
        // A light that moved.
        let mut moved = lights.clone();
        moved[17] = LightGeometry::new(moved[17].corners().map(|v| v.as_dvec3() + DVec3::X));
        assert!(scattered(&moved, 7, LONG).disagreement(&thesis).is_some());
    }

    #[test]
    fn the_number_of_threads_does_not_show() {
        let lights = lights(600);
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| scattered(&lights, 20, LONG))
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn cells_with_surface_are_those_that_a_slab_crosses() {
        let mut scene = Scene::default();
        add(&mut scene, &slab(Vec3::new(1.2, 1.2, 1.2), Vec3::new(3.8, 3.8, 1.8)), matte(ALBEDO));
        let lattice = Lattice::over(Vec3::ZERO, Vec3::splat(8.0), 8);
        let cells = StoredCells::with_surface(lattice, &scene);
        let expected: Vec<u32> = (1..4).flat_map(|y| (1..4).map(move |x| x + 8 * (y + 8))).collect();
        assert_eq!(cells.numbers(), expected);
        // Their lists are the others', and no other cell has one.
        let light = ActiveHemisphere { centre: Vec3::splat(2.0), radius: 2.0, normal: Vec3::X };
        let (surface, all) = (scatter(&[light], &cells, 9), scatter(&[light], &StoredCells::all(lattice), 9));
        let kept: Vec<_> = all.lists().filter(|(cell, _)| expected.contains(cell)).collect();
        assert_eq!(surface.lists().collect::<Vec<_>>(), kept);
        assert!(surface.entries.len() < all.entries.len() && !surface.entries.is_empty());
    }
}

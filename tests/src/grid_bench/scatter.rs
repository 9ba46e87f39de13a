//! Lights scattered into the cells that they reach, as compact lists over the cells that hold visible surface: the thesis' lists, built
//! the way the baker scatters probes.
//!
//! A light reaches the half ball in front of it whose radius is `range` times its own (Aquotte 2017, the active hemisphere).
//! Aquotte tests every cell against every light and pads lists of one length; here each light is scattered into
//! the few cells that it reaches, and lists are as long as they need be.

use glam::{DVec3, IVec3};
use rayon::prelude::*;

use vlm_bake::scene::Scene;
use vlm_bake::topology::{Lists, cross_of};

/// The most cells along the longest axis: bounds the look-up table at 64 MiB.
const MOST_CELLS: f64 = 256.0;

/// Cells along the longest axis where the user names no size: about the size of a piece of furniture in a room, of a bay in a hall.
pub const DEFAULT_CELLS: f64 = 24.0;

/// Lists of lights over the cells that hold surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightLists {
    /// Edge of a cell, metres.
    pub cell_size: f32,
    /// Cells along x, y, z.
    pub dimensions: [u32; 3],
    /// The stored cells, ascending.
    pub cells: Vec<u32>,
    /// One more than cells: offsets into `entries`.
    pub starts: Vec<u32>,
    /// Numbers of lights, ascending within a cell.
    pub entries: Vec<u32>,
}

/// A cubic lattice over a box.
struct Lattice {
    origin: DVec3,
    size: f64,
    dimensions: [u32; 3],
}

impl Lattice {
    fn over(bounds: [DVec3; 2], cell_size: Option<f32>) -> Self {
        let extent = (bounds[1] - bounds[0]).max_element().max(f64::MIN_POSITIVE);
        let least = extent / MOST_CELLS;
        let asked = cell_size.map_or(extent / DEFAULT_CELLS, f64::from);
        let size = f64::from(if asked > least { asked } else { least } as f32);
        // A hair of room on each side, so that surface on the border of the box lies inside.
        let origin = (bounds[0] - 1e-3 * size).as_vec3().as_dvec3();
        let dimensions = ((bounds[1] - origin) / size + 1e-3).floor().max(DVec3::ZERO).as_uvec3() + 1;
        Self { origin, size, dimensions: dimensions.to_array() }
    }

    fn cell_of(&self, p: DVec3) -> IVec3 {
        let most = IVec3::from_array(self.dimensions.map(|d| d as i32)) - 1;
        ((p - self.origin) / self.size).floor().as_ivec3().clamp(IVec3::ZERO, most)
    }

    fn number(&self, cell: IVec3) -> u32 {
        let [x, y, z] = cell.to_array().map(|c| c as u32);
        x + self.dimensions[0] * (y + self.dimensions[1] * z)
    }

    /// The cells of the box between two corners, x fastest.
    fn between(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = IVec3> {
        let (low, high) = (self.cell_of(low), self.cell_of(high));
        (low.z..=high.z)
            .flat_map(move |z| (low.y..=high.y).map(move |y| (y, z)))
            .flat_map(move |(y, z)| (low.x..=high.x).map(move |x| IVec3::new(x, y, z)))
    }

    fn bounds(&self, cell: IVec3) -> [DVec3; 2] {
        let low = self.origin + cell.as_dvec3() * self.size;
        [low, low + self.size]
    }
}

/// Builds the grid over lights with these world-space corners; `None` without lights.
#[must_use]
pub fn light_lists(
    scene: &Scene,
    lights: &[[DVec3; 3]],
    cell_size: Option<f32>,
    range: f32,
) -> Option<LightLists> {
    if lights.is_empty() {
        return None;
    }
    let lattice = Lattice::over(scene.bounds()?, cell_size);
    let cells = surface_cells(scene, &lattice);
    let lists = scatter(lights, &lattice, &cells, f64::from(range));
    Some(LightLists {
        cell_size: lattice.size as f32,
        dimensions: lattice.dimensions,
        cells,
        starts: lists.starts,
        entries: lists.items,
    })
}

/// The numbers of the cells that hold visible surface, ascending.
fn surface_cells(scene: &Scene, lattice: &Lattice) -> Vec<u32> {
    let mut cells: Vec<u32> = scene
        .triangles
        .par_iter()
        .flat_map_iter(|corners| {
            let [a, b, c] = corners.map(|v| scene.positions[v as usize].as_dvec3());
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let low = a.min(b).min(c);
            let high = a.max(b).max(c);
            // A cell far from the plane on either side holds nothing of the triangle. Half a thousandth of a cell of room keeps
            // points that rounding pushed over a border.
            let reach = (0.5 + 5e-4) * lattice.size * normal.abs().element_sum();
            let room = DVec3::splat(5e-4 * lattice.size);
            lattice.between(low - room, high + room).filter_map(move |cell| {
                let [near, far] = lattice.bounds(cell);
                let off = ((near + far) / 2.0 - a).dot(normal).abs();
                (off <= reach).then(|| lattice.number(cell))
            })
        })
        .collect();
    cells.par_sort_unstable();
    cells.dedup();
    cells
}

/// Scatters the lights: counts the lights of each stored cell, then fills the lists in the order of the lights.
fn scatter(lights: &[[DVec3; 3]], lattice: &Lattice, cells: &[u32], range: f64) -> Lists {
    let reached: Vec<Vec<u32>> =
        lights.par_iter().map(|&corners| reached_cells(corners, lattice, cells, range)).collect();
    let lights = reached.iter().zip(0..);
    Lists::new(cells.len(), lights.flat_map(|(cells, light)| cells.iter().map(move |&cell| (cell, light))))
}

/// The stored cells (as indices into `cells`) that the half ball in front of a light touches.
fn reached_cells(corners: [DVec3; 3], lattice: &Lattice, cells: &[u32], range: f64) -> Vec<u32> {
    let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
    let normal = cross_of(corners).normalize_or_zero();
    let radius = range * corners.iter().map(|v| v.distance(centre)).fold(0.0, f64::max);
    lattice
        .between(centre - radius, centre + radius)
        .filter(|&cell| {
            let [low, high] = lattice.bounds(cell);
            let near = centre.clamp(low, high).distance_squared(centre) <= radius * radius;
            let foremost = DVec3::select(normal.cmpgt(DVec3::ZERO), high, low);
            near && (foremost - centre).dot(normal) > 0.0
        })
        .filter_map(|cell| cells.binary_search(&lattice.number(cell)).ok().map(|i| i as u32))
        .collect()
}

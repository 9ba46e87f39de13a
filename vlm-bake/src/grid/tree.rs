//! Cells over the scene, divided until each lists few probes; probes are scattered into the cells that they reach.

use glam::{DVec3, IVec3, Vec3};
use rayon::prelude::*;
use vlm_format::{Grid, Leaf, MOST_PROBES, Probe};
use vlm_shaders::cpu::grid::leaf_at;

use super::cells_between;
use super::pool::Place;
use crate::scene::Scene;
use crate::topology::Lists;

/// The most cells along the longest axis: bounds the coarsest level.
const MOST_CELLS: f64 = 256.0;

/// Cells along the longest axis where the user names no size.
pub const DEFAULT_CELLS: f64 = 16.0;

/// How often a cell is divided at most.
const DEEPEST: u32 = 6;

/// Divides the cells that hold surface: a grid whose probes, all on surface, have no rows yet.
#[must_use]
pub fn tree(scene: &Scene, bounds: [DVec3; 2], probes: &[Probe], cell_size: Option<f32>) -> Grid {
    tree_with_free(scene, bounds, probes, probes.len(), cell_size)
}

/// [`tree`] with cells for probes in free space, too, which stand after so many on surface.
#[must_use]
pub fn tree_with_free(
    scene: &Scene,
    bounds: [DVec3; 2],
    probes: &[Probe],
    surface_probes: usize,
    cell_size: Option<f32>,
) -> Grid {
    let mut grid = lattice(bounds, cell_size);
    let size = f64::from(grid.cell_size);
    let roots: usize = grid.dimensions.iter().map(|&d| d as usize).product();
    let corner = |cell: IVec3| grid.origin.as_dvec3() + cell.as_dvec3() * size;
    let triangles = triangles_by_cell(scene, &grid, roots);
    let probes_of = probes_by_cell(probes, &grid, roots);
    let builder = Builder { scene, probes, surface_probes };
    let built: Vec<Node> = (0..roots)
        .into_par_iter()
        .map(|cell| {
            let place = cell_place(cell, grid.dimensions);
            let bounds = Cube { low: corner(place), size };
            let (surface, free) = builder.kinds(probes_of.of(cell));
            builder.node(&bounds, triangles.of(cell), surface, free, 0)
        })
        .collect();
    grid.probes = probes.to_vec();
    grid.surface_probes = surface_probes as u32;
    grid.cells = vec![0; roots];
    built.into_iter().enumerate().for_each(|(cell, node)| store(&mut grid, cell, node));
    let end = grid.leaf_probes.len() as u32;
    grid.leaves.push(Leaf { probes: end, free_probes: end });
    grid
}

/// A place is reached where the weights of its probes sum to this. Lower values leave more places to the very edge of some probe's reach.
const REACHED: f32 = 0.05;

/// Places of the pool that no probe reaches.
#[must_use]
pub fn uncovered(grid: &Grid, pool: &[Place]) -> Vec<u32> {
    let reached = |place: &Place| {
        let surface = &place.surface;
        let Some(leaf) = leaf_at(grid, surface.position) else { return false };
        let [from, to] = [leaf, leaf + 1].map(|leaf| grid.leaves[leaf as usize].probes as usize);
        let weight = |&probe: &u32| {
            let probe = &grid.probes[probe as usize];
            probe.normal_weight(surface.normal) * probe.place_weight(probe.local(surface.position))
        };
        grid.leaf_probes[from..to].iter().map(weight).sum::<f32>() > REACHED
    };
    (0..pool.len() as u32).into_par_iter().filter(|&i| !reached(&pool[i as usize])).collect()
}

fn lattice(bounds: [DVec3; 2], cell_size: Option<f32>) -> Grid {
    let extent = (bounds[1] - bounds[0]).max_element().max(f64::MIN_POSITIVE);
    let least = extent / MOST_CELLS;
    let asked = cell_size.map_or(extent / DEFAULT_CELLS, f64::from);
    let cell_size = if asked > least { asked } else { least } as f32;
    let size = f64::from(cell_size);
    // A hair of room on each side, so that surface on the border of the box lies inside.
    let origin = (bounds[0] - 1e-3 * size).as_vec3();
    let dimensions = ((bounds[1] - origin.as_dvec3()) / size + 1e-3).floor().max(DVec3::ZERO).as_uvec3() + 1;
    Grid { origin, cell_size, dimensions: dimensions.to_array(), ..Grid::default() }
}

fn cell_place(cell: usize, [nx, ny, _]: [u32; 3]) -> IVec3 {
    let (nx, ny) = (nx as usize, ny as usize);
    IVec3::new((cell % nx) as i32, (cell / nx % ny) as i32, (cell / nx / ny) as i32)
}

/// A cell in space.
#[derive(Clone, Copy)]
struct Cube {
    low: DVec3,
    size: f64,
}

impl Cube {
    fn child(&self, octant: usize) -> Self {
        let half = 0.5 * self.size;
        let step = DVec3::new((octant & 1) as f64, (octant >> 1 & 1) as f64, (octant >> 2 & 1) as f64);
        Self { low: self.low + step * half, size: half }
    }

    /// True if a slab around the plane through `at`, from `below` to `above` along `normal`, meets the cell.
    fn meets_slab(&self, at: DVec3, normal: DVec3, below: f64, above: f64) -> bool {
        let half = 0.5 * self.size;
        let height = (self.low + half - at).dot(normal);
        let radius = half * normal.abs().element_sum();
        height + radius >= -below && height - radius <= above
    }

    fn meets_box(&self, low: DVec3, high: DVec3) -> bool {
        (low.cmple(self.low + self.size) & high.cmpge(self.low)).all()
    }
}

/// A cell with what it holds.
enum Node {
    Empty,
    /// Probes on surface, and in free space.
    Leaf(Vec<u32>, Vec<u32>),
    Divided(Box<[Node; 8]>),
}

struct Builder<'a> {
    scene: &'a Scene,
    probes: &'a [Probe],
    /// The rest lies in free space.
    surface_probes: usize,
}

impl Builder<'_> {
    /// Probes on surface and in free space, of an ascending list.
    fn kinds<'l>(&self, probes: &'l [u32]) -> (&'l [u32], &'l [u32]) {
        probes.split_at(probes.partition_point(|&p| (p as usize) < self.surface_probes))
    }

    fn node(&self, cube: &Cube, triangles: &[u32], around: &[u32], free: &[u32], depth: u32) -> Node {
        let triangles: Vec<u32> =
            triangles.iter().copied().filter(|&t| triangle_meets(self.scene, t, cube)).collect();
        let mut probes =
            if triangles.is_empty() { Vec::new() } else { self.reaching_or_nearest(around, cube) };
        let free = self.free(free, cube);
        if probes.is_empty() && free.is_empty() {
            return Node::Empty;
        }
        let is_fine = probes.len() <= MOST_PROBES && !self.divides_free(&free, cube);
        if is_fine || depth == DEEPEST {
            self.keep_nearest(&mut probes, cube);
            return Node::Leaf(probes, free);
        }
        let child = |octant| self.node(&cube.child(octant), &triangles, &probes, &free, depth + 1);
        Node::Divided(Box::new(std::array::from_fn(child)))
    }

    /// The probes that reach the cell. Where none does, all of the larger cell, as far as a leaf may list them.
    fn reaching_or_nearest(&self, around: &[u32], cube: &Cube) -> Vec<u32> {
        let mut probes: Vec<u32> =
            around.iter().copied().filter(|&p| probe_meets(&self.probes[p as usize], cube)).collect();
        if probes.is_empty() {
            probes = around.to_vec();
            self.keep_nearest(&mut probes, cube);
        }
        probes
    }

    /// Likewise in free space; within a volume none of its cells stays empty.
    fn free(&self, around: &[u32], cube: &Cube) -> Vec<u32> {
        let (first, end) = (self.surface_probes as u32, self.probes.len() as u32);
        let meets = |[low, high]: &[DVec3; 2]| cube.meets_box(*low, *high);
        if first == end {
            return Vec::new();
        }
        let reaching: Vec<u32> =
            around.iter().copied().filter(|&p| probe_meets(&self.probes[p as usize], cube)).collect();
        if !reaching.is_empty() || !self.scene.volumes.iter().any(meets) {
            return reaching;
        }
        let mut nearest = if around.is_empty() { (first..end).collect() } else { around.to_vec() };
        self.keep_nearest(&mut nearest, cube);
        nearest
    }

    /// True where dividing a cell shortens its list of probes in free space, which overlap: below their reach it would not.
    fn divides_free(&self, free: &[u32], cube: &Cube) -> bool {
        let reach = |&p: &u32| f64::from(self.probes[p as usize].reach.iter().copied().fold(0.0, f32::max));
        free.len() > MOST_PROBES && cube.size > free.iter().map(reach).fold(0.0, f64::max)
    }

    /// Of too many probes those stay that weigh most in the middle of the cell.
    fn keep_nearest(&self, probes: &mut Vec<u32>, cube: &Cube) {
        if probes.len() <= MOST_PROBES {
            return;
        }
        let middle = (cube.low + 0.5 * cube.size).as_vec3();
        let away = |&p: &u32| {
            let probe = &self.probes[p as usize];
            let reach = probe.reach.iter().copied().fold(0.0, f32::max);
            middle.distance(probe.position) / reach
        };
        probes.sort_by(|a, b| away(a).total_cmp(&away(b)).then(a.cmp(b)));
        probes.truncate(MOST_PROBES);
        probes.sort_unstable();
    }
}

fn store(grid: &mut Grid, cell: usize, node: Node) {
    match node {
        Node::Empty => {}
        Node::Leaf(probes, free) => {
            grid.cells[cell] = 2 * grid.leaves.len() as u32 + 1;
            let start = grid.leaf_probes.len() as u32;
            grid.leaf_probes.extend(probes);
            let free_probes = grid.leaf_probes.len() as u32;
            grid.leaf_probes.extend(free);
            grid.leaves.push(Leaf { probes: start, free_probes });
        }
        Node::Divided(children) => {
            let first = grid.cells.len();
            grid.cells[cell] = 2 * first as u32;
            grid.cells.resize(first + 8, 0);
            children.into_iter().enumerate().for_each(|(i, child)| store(grid, first + i, child));
        }
    }
}

/// The visible triangles that may touch each cell of the coarsest level.
fn triangles_by_cell(scene: &Scene, grid: &Grid, cells: usize) -> Lists {
    let touched = |t: usize| {
        let [a, b, c] = scene.corners(t).unwrap_or_default().map(Vec3::as_dvec3);
        (a.min(b).min(c), a.max(b).max(c))
    };
    scatter(scene.triangles.len(), touched, grid, cells)
}

/// The probes whose reach may touch each cell of the coarsest level.
fn probes_by_cell(probes: &[Probe], grid: &Grid, cells: usize) -> Lists {
    scatter(probes.len(), |p| probe_box(&probes[p]), grid, cells)
}

/// Scatters things with boxes over the cells that these touch: counted, then filled.
fn scatter(
    count: usize,
    bounds: impl Fn(usize) -> (DVec3, DVec3) + Sync,
    grid: &Grid,
    cells: usize,
) -> Lists {
    let size = f64::from(grid.cell_size);
    let most = IVec3::from_array(grid.dimensions.map(|d| d as i32)) - 1;
    let cell_of =
        |p: DVec3| ((p - grid.origin.as_dvec3()) / size).floor().as_ivec3().clamp(IVec3::ZERO, most);
    let [nx, ny, _] = grid.dimensions;
    let touched = |i: usize| {
        let (low, high) = bounds(i);
        let room = DVec3::splat(1e-3 * size);
        let number = |cell: IVec3| cell.x as u32 + nx * (cell.y as u32 + ny * cell.z as u32);
        cells_between(cell_of(low - room), cell_of(high + room)).map(number).collect::<Vec<u32>>()
    };
    let touched: Vec<Vec<u32>> = (0..count).into_par_iter().map(touched).collect();
    let pairs = touched.iter().zip(0..);
    Lists::new(cells, pairs.flat_map(|(cells, i)| cells.iter().map(move |&cell| (cell, i))))
}

/// Points keep their cell though rounding moves them by this share of it.
const ROUNDING: f64 = 1e-3;

fn triangle_meets(scene: &Scene, triangle: u32, cube: &Cube) -> bool {
    let [a, b, c] = scene.corners(triangle as usize).unwrap_or_default().map(Vec3::as_dvec3);
    let room = ROUNDING * cube.size;
    let normal = (b - a).cross(c - a).normalize_or_zero();
    cube.meets_box(a.min(b).min(c) - room, a.max(b).max(c) + room) && cube.meets_slab(a, normal, room, room)
}

/// The axes of a probe with its reach against and along each, in f64.
fn axes(probe: &Probe) -> [(DVec3, f64, f64); 3] {
    let [left, right, back, front] = probe.reach.map(f64::from);
    let (normal, tangent) = (probe.normal.as_dvec3(), probe.tangent.as_dvec3());
    [
        (tangent, left, right),
        (normal.cross(tangent), back, front),
        (normal, f64::from(probe.reach_down), f64::from(probe.reach_up)),
    ]
}

fn probe_box(probe: &Probe) -> (DVec3, DVec3) {
    let at = probe.position.as_dvec3();
    let (mut low, mut high) = (at, at);
    for (axis, below, above) in axes(probe) {
        let (a, b) = (axis * -below, axis * above);
        low += a.min(b);
        high += a.max(b);
    }
    (low, high)
}

fn probe_meets(probe: &Probe, cube: &Cube) -> bool {
    let (low, high) = probe_box(probe);
    let at = probe.position.as_dvec3();
    cube.meets_box(low, high)
        && axes(probe).into_iter().all(|(axis, below, above)| cube.meets_slab(at, axis, below, above))
}

//! Stage 11: the static grid, from which a frame gathers its indirect light.
//!
//! **Probes** lie on the exposed surface, denser where light changes over short distances. From each, rays over the
//! hemisphere find what share of its light comes from which surface, and so from which light: occlusion is known
//! at the probe, whatever the lights will shine. Lights so near that a probe's light varies over its reach become *near*: the frame
//! evaluates their form factor at each pixel, times the radiosity that the probes see of them. All others are *far*: the frame sums them once
//! per probe, and pixels blend their probes.
//!
//! Receivers that move find **free** probes in the volumes that artists mark, with light from all sides.
//!
//! Steps: `uncovered -> stand_in -> pool`, then for a rough grid, from which `refine` learns, and for the final one
//! `spacing -> reach -> transport, made_lights -> near -> free -> tree`.

mod free;
mod free_reach;
mod free_rows;
mod made_lights;
mod near;
mod pool;
mod reach;
mod refine;
mod relief;
mod spacing;
mod stand_in;
mod transport;
mod tree;
mod uncovered;

pub use pool::LEAST_PLACES;
pub use stand_in::StandIns;
pub use transport::transport;
pub use uncovered::Pieces;

use glam::{DVec3, IVec3, Vec3};
use vlm_format::{Grid, Probe, RowWriter, Uncovered};
use vlm_shaders::cpu::upload::LightSet;

use self::near::NearLight;
use self::pool::Place;
use self::transport::Row;
use crate::progress::Progress;
use crate::scene::Scene;
use crate::shade::TraceScene;

/// What a grid costs and how exact it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GridOptions {
    /// Number of probes on surface; 0 for no grid. More of them resolve borders of shadow and corners better; file, bake and refresh grow in
    /// proportion.
    pub probes: u32,
    /// Directions traced from each probe. Noise of the far light falls with its square root or better; the bake's time and,
    /// less than in proportion, the file grow.
    pub rays: u32,
    /// The most near lights of a probe; 0 leaves everything to the far light. Higher values follow the light of nearby surface more closely,
    /// and cost a form factor each at every pixel.
    pub near: u32,
    /// Edge of the coarsest cells, metres; `None` chooses one that suits the scene.
    pub cell_size: Option<f32>,
    /// At least so many places on surface are candidates for probes. Fewer of them build small grids faster, and place probes less evenly.
    pub least_places: u32,
}

/// What the builder starts from.
pub struct GridInput<'a> {
    /// The scene, ready for rays.
    pub trace: &'a TraceScene<'a>,
    /// Which light stands for which surface.
    pub stand_ins: &'a StandIns,
    /// The lights in world space.
    pub lights: &'a LightSet,
    /// The light of each sample.
    pub light_of_sample: &'a [u32],
    /// Area of each light over that of the surface for which it stands: radiosity of that surface over the light's own, colours aside.
    pub area_gains: &'a [f32],
    /// The share of its light's area that each sample speaks for.
    pub shares: &'a [f32],
    /// The lights that artists made.
    pub made: &'a [u32],
    /// Surface for which no light stands.
    pub uncovered: &'a [Uncovered],
}

impl GridInput<'_> {
    /// The light to which a source belongs; `None` for surface for which none stands.
    fn light_of(&self, source: u32) -> Option<u32> {
        let samples = self.light_of_sample.len() as u32;
        let of_sample = self.light_of_sample.get(source as usize).copied();
        of_sample.or_else(|| (source - samples < self.lights.len() as u32).then_some(source - samples))
    }
}

/// Builds the grid; `None` without lights or without surface.
#[must_use]
pub fn grid(input: &GridInput, options: &GridOptions, progress: &dyn Progress) -> Option<Grid> {
    let bounds = input.trace.scene.bounds()?;
    if input.lights.is_empty() || options.probes == 0 {
        return None;
    }
    let mut pool = pool::pool(input.trace, options.probes, options.least_places);
    let rough = GridOptions {
        probes: (options.probes as f32 * ROUGH_PROBES) as u32,
        rays: (options.rays as f32 * ROUGH_RAYS) as u32,
        ..*options
    };
    let found = built(input, &pool, bounds, &rough, Pass::Rough, progress)?;
    refine::refine(input, &mut pool, &found);
    // How many more probes than asked for it takes to cover all surface, the rough grid tells.
    let excess = found.probes.len() as f32 / rough.probes.max(1) as f32;
    let probes = options.probes as f32 / excess.clamp(0.5, 2.0);
    built(input, &pool, bounds, &GridOptions { probes: probes as u32, ..*options }, Pass::Final, progress)
}

/// Share of the probes for the grid that tells where probes should lie closer. More of them find smaller places.
const ROUGH_PROBES: f32 = 0.5;

/// Likewise of the rays. Fewer of them take noise for error.
const ROUGH_RAYS: f32 = 0.25;

/// What a grid is built for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Pass {
    /// To learn where probes should lie closer, on surface alone.
    Rough,
    /// To be written.
    Final,
}

/// The grid whose probes' spacing follows the openness of the pool; `None` if it was cancelled.
fn built(
    input: &GridInput,
    pool: &[Place],
    bounds: [DVec3; 2],
    options: &GridOptions,
    pass: Pass,
    progress: &dyn Progress,
) -> Option<Grid> {
    let spacing = spacing::Spacing::new(pool, bounds, options.probes);
    let mut chosen = spacing.spread(pool, 0..pool.len() as u32, 1.0);
    let mut probes = reach::probes(input.trace, pool, &spacing, &chosen);
    for share in COVERING {
        if progress.is_cancelled() {
            return None;
        }
        let cells = tree::tree(input.trace.scene, bounds, &probes, options.cell_size);
        let missed = tree::uncovered(&cells, pool);
        let more = spacing.spread(pool, missed, share);
        probes.extend(reach::probes(input.trace, pool, &spacing, &more));
        chosen.extend(more);
    }
    let places: Vec<_> = chosen.iter().map(|&i| pool[i as usize]).collect();
    let stage = if pass == Pass::Rough { "rough transport" } else { "transport" };
    progress.begin(stage, places.len() as u64);
    let rows = transport::rows(input, &places, options.rays, progress);
    if progress.is_cancelled() {
        return None;
    }
    let (mut near, mut far) = near::split(input, &places, &probes, rows, options);
    let surface_probes = probes.len();
    if pass == Pass::Final {
        probes.extend(free::probes(input, bounds, &probes));
    }
    let free: Vec<Vec3> = probes[surface_probes..].iter().map(|probe| probe.position).collect();
    far.extend(free_rows::free_rows(input, &free, options.rays));
    near.resize(far.len(), Vec::new());
    let bounds = if free.is_empty() { bounds } else { free::with_volumes(input.trace.scene, bounds) };
    let cells = tree::tree_with_free(input.trace.scene, bounds, &probes, surface_probes, options.cell_size);
    let mut grid = encode(cells, probes, &near, &far, input.light_of_sample);
    grid.surface_probes = surface_probes as u32;
    grid.sample_shares = input.shares.to_vec();
    grid.surface_gains = input.area_gains.to_vec();
    grid.uncovered = input.uncovered.to_vec();
    Some(grid)
}

/// The cells of the box between two, both included, x fastest.
fn cells_between(low: IVec3, high: IVec3) -> impl Iterator<Item = IVec3> {
    let rows = (low.z..=high.z).flat_map(move |z| (low.y..=high.y).map(move |y| (y, z)));
    rows.flat_map(move |(y, z)| (low.x..=high.x).map(move |x| IVec3::new(x, y, z)))
}

/// Surface that no probe reaches, behind walls, steps and edges, gets probes of its own in as many rounds, at these shares of their
/// spacing. More rounds leave less of it.
const COVERING: [f32; 3] = [0.9, 0.6, 0.4];

/// Packs the rows into the grid.
fn encode(
    mut grid: Grid,
    mut probes: Vec<Probe>,
    near: &[Vec<NearLight>],
    far: &[Row],
    light_of_sample: &[u32],
) -> Grid {
    let mut rows = RowWriter::default();
    let mut near_rows: Vec<(u32, Vec<(u32, u8)>)> = Vec::new();
    grid.near_starts = vec![0];
    for ((probe, row), near) in probes.iter_mut().zip(far).zip(near) {
        let weights = near.iter().flat_map(|near| &near.row).chain(row).map(|(_, weight)| *weight);
        probe.row_scale = weights.fold(0.0, f32::max) / 255.0;
        let mut rounding = Rounding { scale: probe.row_scale, carried: 0.0 };
        rows.push(0, rounding.row(row));
        for near in near {
            let row = rounding.row(&near.row);
            if !row.is_empty() {
                let first = light_of_sample.partition_point(|&light| light < near.light);
                near_rows.push((first as u32, row));
                grid.near.push(near.light);
                grid.near_form_factors.push(near.form_factor);
            }
        }
        grid.near_starts.push(grid.near.len() as u32);
    }
    near_rows.into_iter().for_each(|(first, row)| rows.push(first, row));
    grid.probes = probes;
    grid.row_starts = rows.starts;
    grid.rows = rows.words;
    grid
}

/// Rounds weights to bytes, and carries what is lost on to the next, so that the sum stays.
struct Rounding {
    scale: f32,
    carried: f32,
}

impl Rounding {
    fn row(&mut self, row: &[(u32, f32)]) -> Vec<(u32, u8)> {
        let round = |&(source, weight): &(u32, f32)| {
            let exact = weight / self.scale + self.carried;
            let rounded = exact.round().clamp(0.0, 255.0);
            self.carried = exact - rounded;
            (rounded > 0.0).then_some((source, rounded as u8))
        };
        row.iter().filter_map(round).collect()
    }
}

impl Scene {
    /// The box around all visible triangles in world space, or `None` without triangles.
    #[must_use]
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let used = self.triangles.iter().flatten().map(|&v| self.positions[v as usize]);
        let (low, high) = used.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        low.is_finite().then(|| [low.as_dvec3(), high.as_dvec3()])
    }
}

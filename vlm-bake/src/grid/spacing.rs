//! How far probes lie apart, and which places of the pool become probes.

use glam::{DVec3, IVec3, Vec3};
use rustc_hash::FxHashMap;

use super::cells_between;
use super::pool::Place;

/// Probes are at most this share of the scene's extent apart.
pub(super) const WIDEST: f32 = 1.0 / 16.0;

/// The narrowest spacing over the widest. Lower values follow contact shadows into smaller corners, where few pixels see
/// them.
const NARROWEST: f32 = 1.0 / 24.0;

/// Area per probe over the square of its spacing, where no more disks of that diameter fit (Feder 1980: they cover 0.547 of the area).
const PACKING: f32 = 1.44;

/// Two probes of one place must look different ways by more than this (cosine) to be two.
const SAME_WAY: f32 = 0.7;

/// Spacing of probes over the pool.
pub struct Spacing {
    /// Spacing over openness.
    factor: f32,
    narrowest: f32,
    widest: f32,
}

impl Spacing {
    /// Chooses the spacing that gives about so many probes.
    #[must_use]
    pub fn new(pool: &[Place], bounds: [DVec3; 2], probes: u32) -> Self {
        let widest = WIDEST * (bounds[1] - bounds[0]).max_element() as f32;
        let mut spacing = Self { factor: 1.0, narrowest: widest * NARROWEST, widest };
        let (mut low, mut high) = (1e-4_f32, 1e3_f32);
        for _ in 0..40 {
            spacing.factor = (low * high).sqrt();
            let count: f32 = pool.iter().map(|p| (p.area / (PACKING * spacing.at(p).powi(2))).min(1.0)).sum();
            if count > probes as f32 { low = spacing.factor } else { high = spacing.factor }
        }
        spacing
    }

    /// Distance to the next probe at a place, metres.
    #[must_use]
    pub fn at(&self, place: &Place) -> f32 {
        (self.factor * place.openness).clamp(self.narrowest, self.widest)
    }

    /// Some of the `candidates`, none nearer to another than `share` of their spacing.
    #[must_use]
    pub fn spread(&self, pool: &[Place], candidates: impl IntoIterator<Item = u32>, share: f32) -> Vec<u32> {
        let mut order: Vec<u32> = candidates.into_iter().collect();
        order.sort_unstable_by_key(|&i| shuffled(i));
        let mut near = Neighbourhood::new(share * self.narrowest);
        let mut chosen = Vec::new();
        for i in order {
            let distance = share * self.at(&pool[i as usize]);
            if !near.is_taken(pool, i, distance) {
                near.insert(pool, i, distance);
                chosen.push(i);
            }
        }
        chosen
    }
}

/// A fixed random order.
fn shuffled(i: u32) -> u32 {
    let mut x = i.wrapping_mul(0x9e37_79b9);
    x ^= x >> 16;
    x = x.wrapping_mul(0x85eb_ca6b);
    x ^ (x >> 13)
}

/// Levels of spacing, each twice as wide as the one before.
const LEVELS: usize = 8;

/// The places taken so far, by level of their spacing and cell.
struct Neighbourhood {
    narrowest: f32,
    levels: [FxHashMap<IVec3, Vec<(u32, f32)>>; LEVELS],
}

impl Neighbourhood {
    fn new(narrowest: f32) -> Self {
        Self { narrowest, levels: Default::default() }
    }

    /// The level whose cells are at least as wide as a distance.
    fn level(&self, distance: f32) -> usize {
        ((distance / self.narrowest).log2().ceil().max(0.0) as usize).min(LEVELS - 1)
    }

    fn cell_size(&self, level: usize) -> f32 {
        self.narrowest * (1 << (level + 1)) as f32
    }

    fn insert(&mut self, pool: &[Place], i: u32, distance: f32) {
        let level = self.level(distance);
        let cell = (pool[i as usize].surface.position / self.cell_size(level)).floor().as_ivec3();
        self.levels[level].entry(cell).or_default().push((i, distance));
    }

    /// A place nearer than the lesser of both distances is taken.
    fn is_taken(&self, pool: &[Place], i: u32, distance: f32) -> bool {
        let place = &pool[i as usize].surface;
        (0..LEVELS).any(|level| {
            let size = self.cell_size(level);
            let reach = Vec3::splat(distance.min(0.5 * size));
            let low = ((place.position - reach) / size).floor().as_ivec3();
            let high = ((place.position + reach) / size).floor().as_ivec3();
            let blocks = |&(other, spacing): &(u32, f32)| {
                let other = &pool[other as usize].surface;
                let least = distance.min(spacing);
                other.position.distance_squared(place.position) < least * least
                    && other.geometric_normal.dot(place.geometric_normal) > SAME_WAY
            };
            cells_between(low, high)
                .any(|cell| self.levels[level].get(&cell).is_some_and(|there| there.iter().any(blocks)))
        })
    }
}

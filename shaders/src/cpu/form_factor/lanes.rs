//! One light against many receivers: the same functions over blocks of lanes, which the compiler turns into SIMD for the
//! widest instruction set that the processor has.
//!
//! Receivers rather than lights fill the lanes: a light has four times the numbers of a receiver, and all lanes share it.
//! Every lane runs [`far_triangle`]; the few pairs that it cannot serve are collected and run through the clipped polygon,
//! again by blocks, so that neither branch costs the other's time.

use glam::Vec3;
use pulp::{Arch, NullaryFnOnce};

use super::arithmetic::dot;
use super::far::far_triangle;
use super::light::LightGeometry;
use super::near::Heights;
use super::{close, far_form_factor};

/// Receivers per block: one AVX-512 register, or two of AVX.
pub const LANES: usize = 16;

/// Receivers as the lanes read them: one array per coordinate, in blocks.
#[derive(Clone, Debug, Default)]
pub struct Receivers {
    blocks: Vec<Block>,
    len: usize,
}

/// `LANES` receivers: the coordinates of `x`, then those of `n`.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Block {
    x: [[f32; LANES]; 3],
    n: [[f32; LANES]; 3],
}

impl Block {
    const EMPTY: Self = Self { x: [[0.0; LANES]; 3], n: [[0.0; LANES]; 3] };

    #[inline(always)]
    fn get(&self, lane: usize) -> (Vec3, Vec3) {
        let at = |c: &[[f32; LANES]; 3]| Vec3::new(c[0][lane], c[1][lane], c[2][lane]);
        (at(&self.x), at(&self.n))
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, x: Vec3, n: Vec3) {
        for axis in 0..3 {
            self.x[axis][lane] = x[axis];
            self.n[axis][lane] = n[axis];
        }
    }
}

impl Receivers {
    /// Points and their normals.
    #[must_use]
    pub fn new(receivers: impl IntoIterator<Item = (Vec3, Vec3)>) -> Self {
        let mut all = Self::default();
        for (x, n) in receivers {
            let lane = all.len % LANES;
            if lane == 0 {
                all.blocks.push(Block::EMPTY);
            }
            if let Some(block) = all.blocks.last_mut() {
                block.set(lane, x, n);
            }
            all.len += 1;
        }
        all
    }

    /// Number of receivers.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// True without receivers.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

/// The form factor of `light` at each receiver, into `results`: [`super::form_factor`], several at a time.
///
/// Where the processor has fused arithmetic the last bits differ from the scalar function's, by no more than the error
/// of either; elsewhere they are the same. Results beyond the shorter of both are left as they are.
pub fn form_factors(light: &LightGeometry, receivers: &Receivers, results: &mut [f32]) {
    match Arch::new() {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(simd) => simd.vectorize(Batch::<true> { light, receivers, results }),
        #[cfg(target_arch = "x86_64")]
        Arch::V3(simd) => simd.vectorize(Batch::<true> { light, receivers, results }),
        _ => Batch::<false> { light, receivers, results }.call(),
    }
}

/// [`form_factors`] without any instruction set beyond the target's own: the same bits as the scalar function.
pub fn form_factors_portable(light: &LightGeometry, receivers: &Receivers, results: &mut [f32]) {
    Batch::<false> { light, receivers, results }.call();
}

struct Batch<'a, const FUSED: bool> {
    light: &'a LightGeometry,
    receivers: &'a Receivers,
    results: &'a mut [f32],
}

impl<const FUSED: bool> NullaryFnOnce for Batch<'_, FUSED> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let count = self.receivers.len.min(self.results.len());
        let tiles = self.receivers.blocks.chunks(TILE / LANES);
        for (blocks, results) in tiles.zip(self.results[..count].chunks_mut(TILE)) {
            tile::<FUSED>(self.light, blocks, results);
        }
    }
}

/// Receivers per round of far lanes and close ones: what the list of close ones holds.
const TILE: usize = 1024;

#[inline(always)]
fn tile<const FUSED: bool>(light: &LightGeometry, blocks: &[Block], results: &mut [f32]) {
    let mut waiting = [0u16; TILE];
    let mut waiting_count = 0;
    for (b, (block, results)) in blocks.iter().zip(results.chunks_mut(LANES)).enumerate() {
        let (far, is_close) = far_block::<FUSED>(light, block);
        results.copy_from_slice(&far[..results.len()]);
        if is_close != [0; LANES] {
            for (lane, &is_close) in is_close[..results.len()].iter().enumerate() {
                // Branch-free append: the slot is overwritten unless the lane is close.
                waiting[waiting_count] = (b * LANES + lane) as u16;
                waiting_count += is_close as usize;
            }
        }
    }
    for close in waiting[..waiting_count].chunks(LANES) {
        let mut block = Block::EMPTY;
        for (lane, &i) in close.iter().enumerate() {
            let (x, n) = blocks[i as usize / LANES].get(i as usize % LANES);
            block.set(lane, x, n);
        }
        let values = close_block::<FUSED>(light, &block);
        for (&i, value) in close.iter().zip(values) {
            results[i as usize] = value;
        }
    }
}

/// [`far_triangle`] for each lane, and which lanes it cannot serve.
#[inline(always)]
fn far_block<const FUSED: bool>(light: &LightGeometry, block: &Block) -> ([f32; LANES], [u32; LANES]) {
    let mut results = [0.0; LANES];
    let mut is_close = [0; LANES];
    for lane in 0..LANES {
        let (x, n) = block.get(lane);
        let r = (light.v0 - x) * light.scale;
        let heights = Heights::new::<FUSED>(light, r, n);
        let is_lit = (dot::<FUSED>(light.normal, r) < 0.0) & heights.any_above();
        let (sum, is_far) = far_triangle::<FUSED>(light, r, n);
        let by_far = is_far & heights.all_above();
        results[lane] = if is_lit & by_far { far_form_factor(sum) } else { 0.0 };
        is_close[lane] = u32::from(is_lit & !by_far);
    }
    (results, is_close)
}

#[inline(always)]
fn close_block<const FUSED: bool>(light: &LightGeometry, block: &Block) -> [f32; LANES] {
    let mut results = [0.0; LANES];
    for (lane, result) in results.iter_mut().enumerate() {
        let (x, n) = block.get(lane);
        let heights = Heights::new::<FUSED>(light, (light.v0 - x) * light.scale, n);
        *result = close::<FUSED>(light, x, n, &heights);
    }
    results
}

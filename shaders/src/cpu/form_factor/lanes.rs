//! One light against many receivers: the same functions over blocks of lanes, which the compiler turns into SIMD for the
//! widest instruction set that the processor has.
//!
//! Receivers rather than lights fill the lanes: a light has four times the numbers of a receiver, and all lanes share it.
//! Every lane runs [`far_triangle`]; the few pairs that it cannot serve are collected and run through the clipped polygon,
//! again by blocks, so that neither branch costs the other's time.

use glam::Vec3;
use pulp::{Arch, Simd, WithSimd};

use super::clip::Heights;
use super::light::LightGeometry;
use super::real::{LaneMask, Lanes, Real, Vector};
use super::{Seen, close_clipped, close_whole, form_factor, is_behind};

/// Receivers per block: one AVX-512 register, or two of AVX.
pub const LANES: usize = 16;

/// Receivers as the lanes read them: one array per coordinate, in blocks.
#[derive(Clone, Debug, Default)]
pub struct Receivers {
    blocks: Vec<Block>,
    /// Normals of the surfaces themselves, where they differ from the receivers'; empty, or one per block.
    surfaces: Vec<[[f32; LANES]; 3]>,
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
        let Self { x: [x0, x1, x2], n: [n0, n1, n2] } = self;
        (Vec3::new(x0[lane], x1[lane], x2[lane]), Vec3::new(n0[lane], n1[lane], n2[lane]))
    }

    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, register: usize) -> (Vector<Lanes<S>>, Vector<Lanes<S>>) {
        (load(simd, &self.x, register), load(simd, &self.n, register))
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, x: Vec3, n: Vec3) {
        set(&mut self.x, lane, x);
        set(&mut self.n, lane, n);
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

    /// Points, their shading normals, and the normals of the surfaces themselves: a light wholly behind the surface gives
    /// nothing.
    #[must_use]
    pub fn on_surfaces(receivers: impl IntoIterator<Item = (Vec3, Vec3, Vec3)>) -> Self {
        let mut surfaces = Vec::new();
        let mut bent = false;
        let mut all = Self::new(receivers.into_iter().enumerate().map(|(i, (x, n, surface))| {
            if i % LANES == 0 {
                surfaces.push([[0.0; LANES]; 3]);
            }
            if let Some(block) = surfaces.last_mut() {
                set(block, i % LANES, surface);
            }
            bent |= n != surface;
            (x, n)
        }));
        if bent {
            all.surfaces = surfaces;
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

/// The form factor of `light` at each receiver, into `results`: [`form_factor`], several at a time.
///
/// With AVX2 and FMA or AVX-512 products and sums are fused, so the last bits differ from the scalar function's, by no
/// more than the error of either; without, this is the scalar function. Results beyond the shorter of both are left as
/// they are.
pub fn form_factors(light: &LightGeometry, receivers: &Receivers, results: &mut [f32]) {
    let batch = Batch { light, receivers, results };
    match Arch::new() {
        Arch::Scalar => batch.one_by_one(),
        #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
        arch => arch.dispatch(batch),
    }
}

struct Batch<'a> {
    light: &'a LightGeometry,
    receivers: &'a Receivers,
    results: &'a mut [f32],
}

impl Batch<'_> {
    fn one_by_one(self) {
        for (i, result) in self.results.iter_mut().take(self.receivers.len).enumerate() {
            let (x, n) = self.receivers.blocks[i / LANES].get(i % LANES);
            let surface = self.receivers.surfaces.get(i / LANES).map_or(n, |block| {
                let lane = i % LANES;
                Vec3::new(block[0][lane], block[1][lane], block[2][lane])
            });
            *result = if is_behind(self.light, x, surface) { 0.0 } else { form_factor(self.light, x, n) };
        }
    }
}

impl WithSimd for Batch<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        // The lists of a large tile take longer to clear than a handful of receivers to evaluate.
        if self.receivers.len <= SMALL_TILE {
            self.by_tiles::<S, SMALL_TILE>(simd);
        } else {
            self.by_tiles::<S, TILE>(simd);
        }
    }
}

impl Batch<'_> {
    #[inline(always)]
    fn by_tiles<S: Simd, const SIZE: usize>(self, simd: S) {
        let count = self.receivers.len.min(self.results.len());
        let tiles = self.receivers.blocks.chunks(SIZE / LANES);
        let mut waiting = [Waiting::<SIZE>::NONE; CLASSES];
        for (i, (blocks, results)) in tiles.zip(self.results[..count].chunks_mut(SIZE)).enumerate() {
            let surfaces = self.receivers.surfaces.get(i * (SIZE / LANES)..).unwrap_or(&[]);
            tile(simd, self.light, blocks, surfaces, results, &mut waiting);
        }
    }
}

/// Receivers per round of far lanes and close ones: what the lists of close ones hold. Fewer leave registers half empty.
const TILE: usize = 4096;

/// The same for a few receivers, such as the pixels of a grid's cell.
const SMALL_TILE: usize = 64;

/// Kinds of close receivers, which take forms of different length: the light is whole, or one or two of its corners are
/// above the horizon.
const CLASSES: usize = 3;

/// Receivers of a tile that wait for one of the slower forms.
#[derive(Clone, Copy)]
struct Waiting<const SIZE: usize> {
    lanes: [u16; SIZE],
    count: usize,
}

impl<const SIZE: usize> Waiting<SIZE> {
    const NONE: Self = Self { lanes: [0; SIZE], count: 0 };
}

#[inline(always)]
fn tile<S: Simd, const SIZE: usize>(
    simd: S,
    light: &LightGeometry,
    blocks: &[Block],
    surfaces: &[[[f32; LANES]; 3]],
    results: &mut [f32],
    waiting: &mut [Waiting<SIZE>; CLASSES],
) {
    for list in waiting.iter_mut() {
        list.count = 0;
    }
    for (b, (block, results)) in blocks.iter().zip(results.chunks_mut(LANES)).enumerate() {
        let (mut far, mut class) = ([0.0; LANES], [0.0; LANES]);
        if far_block(simd, light, block, surfaces.get(b), &mut far, &mut class) {
            let mut left = bits(&class) & ((1 << results.len()) - 1);
            while left != 0 {
                let lane = left.trailing_zeros() as usize;
                left &= left - 1;
                let list = &mut waiting[class[lane] as usize - 1];
                list.lanes[list.count] = (b * LANES + lane) as u16;
                list.count += 1;
            }
        }
        results.copy_from_slice(&far[..results.len()]);
    }
    let [whole, one_above, two_above] = waiting;
    finish::<S, SIZE, true>(simd, light, whole, blocks, results);
    // Apart, as the second triangle of a quad is not evaluated for a register of triangles.
    finish::<S, SIZE, false>(simd, light, one_above, blocks, results);
    finish::<S, SIZE, false>(simd, light, two_above, blocks, results);
}

/// A bit per lane that is above 0.
#[inline(always)]
fn bits(class: &[f32; LANES]) -> u32 {
    let mut bits = 0;
    for (lane, class) in class.iter().enumerate() {
        bits |= u32::from(*class > 0.0) << lane;
    }
    bits
}

/// Evaluates the receivers that wait, a register at a time: lights wholly above the horizon, or cut by it.
#[inline(always)]
fn finish<S: Simd, const SIZE: usize, const IS_WHOLE: bool>(
    simd: S,
    light: &LightGeometry,
    waiting: &Waiting<SIZE>,
    blocks: &[Block],
    results: &mut [f32],
) {
    for lanes in waiting.lanes[..waiting.count].chunks(LANES) {
        let mut block = Block::EMPTY;
        for (lane, &i) in lanes.iter().enumerate() {
            let (x, n) = blocks[i as usize / LANES].get(i as usize % LANES);
            block.set(lane, x, n);
        }
        let mut values = [0.0; LANES];
        for register in 0..registers::<S>().min(lanes.len().div_ceil(S::F32_LANES)) {
            let (x, n) = block.load(simd, register);
            let form_factor = if IS_WHOLE { close_whole(light, x, n) } else { close_clipped(light, x, n) };
            store(&mut values, register, form_factor);
        }
        for (&i, value) in lanes.iter().zip(values) {
            results[i as usize] = value;
        }
    }
}

/// The far form of every lane into `far`, which holds zeros, 0 where there is no light, and the class from 1 of the lanes that need another form; true
/// if any does.
#[inline(always)]
fn far_block<S: Simd>(
    simd: S,
    light: &LightGeometry,
    block: &Block,
    surface: Option<&[[f32; LANES]; 3]>,
    far: &mut [f32; LANES],
    class: &mut [f32; LANES],
) -> bool {
    let mut any = false;
    for register in 0..registers::<S>() {
        let (x, n) = block.load(simd, register);
        let mut seen = Seen::new(light, x, n);
        if let Some(surface) = surface {
            let heights = Heights::new(light, seen.r, load(simd, surface, register));
            seen.is_lit = seen.is_lit & heights.any_above();
        }
        let zero = seen.normal_r.zero();
        // Neighbouring receivers face the same way.
        if !zero.any(seen.is_lit) {
            continue;
        }
        let (result, is_far) = seen.far(light, n);
        let above = seen.heights.all_above();
        store(far, register, Real::select(seen.is_lit & above & is_far, result, zero));
        let is_close: LaneMask<S> = seen.is_lit & !(above & is_far);
        if zero.any(is_close) {
            any = true;
            let cut = Real::select(seen.heights.two_above(), zero.splat(3.0), zero.splat(2.0));
            let kind = Real::select(above, zero.one(), cut);
            store(class, register, Real::select(is_close, kind, zero));
        }
    }
    any
}

#[inline(always)]
fn set(block: &mut [[f32; LANES]; 3], lane: usize, v: Vec3) {
    for axis in 0..3 {
        block[axis][lane] = v[axis];
    }
}

/// Registers per block.
#[inline(always)]
fn registers<S: Simd>() -> usize {
    LANES / S::F32_LANES
}

#[inline(always)]
fn load<S: Simd>(simd: S, [x, y, z]: &[[f32; LANES]; 3], register: usize) -> Vector<Lanes<S>> {
    Vector {
        x: Lanes { simd, values: S::as_simd_f32s(x).0[register] },
        y: Lanes { simd, values: S::as_simd_f32s(y).0[register] },
        z: Lanes { simd, values: S::as_simd_f32s(z).0[register] },
    }
}

#[inline(always)]
fn store<S: Simd>(values: &mut [f32; LANES], register: usize, lanes: Lanes<S>) {
    S::as_mut_simd_f32s(values).0[register] = lanes.values;
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// Every instruction set that this processor has, not only the widest.
    fn by_each(light: &LightGeometry, receivers: &Receivers) -> Vec<Vec<f32>> {
        fn run(simd: impl Simd, light: &LightGeometry, receivers: &Receivers) -> Vec<f32> {
            let mut results = vec![f32::NAN; receivers.len()];
            simd.vectorize(Batch { light, receivers, results: &mut results });
            results
        }
        let mut all = vec![run(pulp::Scalar, light, receivers)];
        #[cfg(target_arch = "x86_64")]
        {
            all.extend(pulp::x86::V3::try_new().map(|simd| run(simd, light, receivers)));
            all.extend(pulp::x86::V4::try_new().map(|simd| run(simd, light, receivers)));
        }
        all
    }

    #[test]
    fn every_instruction_set_agrees_with_the_scalar_form() {
        let corner = |x: f64, y: f64| DVec3::new(x, y, 1.0);
        let light = LightGeometry::new([corner(0.0, 0.0), corner(0.1, 1.0), corner(1.0, 0.0)]);
        let at = |i: u32| Vec3::new((i % 7) as f32, (i % 11) as f32, (i % 5) as f32) * 0.4 - 1.0;
        let surface = |i: u32| Vec3::new(0.0, 0.6, if i.is_multiple_of(3) { -0.8 } else { 0.8 });
        // Both sizes of tile.
        for count in [50, 5000] {
            let points: Vec<_> =
                (0..count).map(|i| (at(i), Vec3::new(0.48, -0.6, 0.64), surface(i))).collect();
            let receivers = Receivers::on_surfaces(points.iter().copied());
            for results in by_each(&light, &receivers) {
                let mut lit = 0;
                for (&(x, n, surface), result) in points.iter().zip(results) {
                    let alone = if is_behind(&light, x, surface) { 0.0 } else { form_factor(&light, x, n) };
                    assert!((alone - result).abs() < 1e-6, "{x}: {alone} {result}");
                    lit += u32::from(alone > 0.0);
                }
                assert!(lit > count / 8, "{lit} of {count}");
            }
        }
    }
}

//! The processor's own limit: fused products and sums per second of one core, at the widest registers it has.

use std::hint::black_box;
use std::time::Instant;

use pulp::{Arch, Simd, WithSimd};

/// Independent chains: enough to hide the latency of two units.
const CHAINS: usize = 12;
const ROUNDS: usize = 200_000;

/// Billions of floating-point operations per second, a fused product and sum counted as two; the best of a few runs.
#[must_use]
pub fn peak_gflops() -> f64 {
    let arch = Arch::new();
    (0..20).map(|_| arch.dispatch(Chains)).fold(0.0, f64::max)
}

struct Chains;

impl WithSimd for Chains {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let factor = simd.splat_f32s(black_box(0.999_999));
        let addend = simd.splat_f32s(black_box(1e-6));
        let mut chains = [simd.splat_f32s(black_box(1.0)); CHAINS];
        let start = Instant::now();
        for _ in 0..ROUNDS {
            for chain in &mut chains {
                *chain = simd.mul_add_e_f32s(*chain, factor, addend);
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        black_box(chains.map(|chain| simd.reduce_sum_f32s(chain)));
        (2 * CHAINS * ROUNDS * S::F32_LANES) as f64 / seconds / 1e9
    }
}

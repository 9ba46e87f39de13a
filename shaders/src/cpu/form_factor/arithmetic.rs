//! Sums of products, fused or not, and the arctangent's polynomial.

use glam::Vec3;

/// `a b + c`. `FUSED` rounds once, which is as fast as one product where the processor has it and slow where it has not.
#[inline(always)]
pub fn mul_add<const FUSED: bool>(a: f32, b: f32, c: f32) -> f32 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// `a . b`.
#[inline(always)]
pub fn dot<const FUSED: bool>(a: Vec3, b: Vec3) -> f32 {
    mul_add::<FUSED>(a.x, b.x, mul_add::<FUSED>(a.y, b.y, a.z * b.z))
}

/// `a x b`.
#[inline(always)]
pub fn cross<const FUSED: bool>(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(
        mul_add::<FUSED>(a.y, b.z, -(a.z * b.y)),
        mul_add::<FUSED>(a.z, b.x, -(a.x * b.z)),
        mul_add::<FUSED>(a.x, b.y, -(a.y * b.x)),
    )
}

/// `p + t e`.
#[inline(always)]
pub fn along<const FUSED: bool>(p: Vec3, t: f32, e: Vec3) -> Vec3 {
    Vec3::new(mul_add::<FUSED>(t, e.x, p.x), mul_add::<FUSED>(t, e.y, p.y), mul_add::<FUSED>(t, e.z, p.z))
}

/// `t Q(t) = atan(sqrt t) / sqrt t - 1` for `t` from 0 to 1, to 1.5e-8.
///
/// Minimax fit, so that no built-in arctangent is needed: WGSL allows those 4096 units in the last place. Degree 6 would
/// err by 1e-7, which shows beside the rounding errors; degree 8 gains nothing in f32.
#[inline(always)]
pub fn arctangent_excess<const FUSED: bool>(t: f32) -> f32 {
    let q = 0.002_974_605_2;
    let q = mul_add::<FUSED>(q, t, -0.016_581_241);
    let q = mul_add::<FUSED>(q, t, 0.043_553_628);
    let q = mul_add::<FUSED>(q, t, -0.075_805_85);
    let q = mul_add::<FUSED>(q, t, 0.106_789_43);
    let q = mul_add::<FUSED>(q, t, -0.142_142_1);
    let q = mul_add::<FUSED>(q, t, 0.199_941_37);
    let q = mul_add::<FUSED>(q, t, -0.333_331_67);
    q * t
}

//! Numbers that the kernel runs on: one at a time, or as many as a register holds. The formulas are written once.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use glam::Vec3;
use pulp::Simd;

/// A single-precision number, or one per lane. Comparisons are false for NaN.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// What comparisons give.
    type Mask: Copy + BitAnd<Output = Self::Mask> + BitOr<Output = Self::Mask> + Not<Output = Self::Mask>;

    /// `value` in every lane; `self` only says of which kind.
    fn splat(self, value: f32) -> Self;
    /// `self * b + c`, rounded once where the processor does that as fast as one product.
    fn times_plus(self, b: Self, c: Self) -> Self;
    /// Square root.
    fn root(self) -> Self;
    /// The larger one; `floor` for NaN.
    fn at_least(self, floor: f32) -> Self;
    /// `self < other`.
    fn below(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn up_to(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is set, else `no`; both are evaluated.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Some lane is set.
    fn any(self, mask: Self::Mask) -> bool;

    /// 0.
    #[inline(always)]
    fn zero(self) -> Self {
        self.splat(0.0)
    }

    /// 1.
    #[inline(always)]
    fn one(self) -> Self {
        self.splat(1.0)
    }

    /// `self > 0`.
    #[inline(always)]
    fn is_above(self) -> Self::Mask {
        self.zero().below(self)
    }
}

impl Real for f32 {
    type Mask = bool;

    #[inline(always)]
    fn splat(self, value: f32) -> Self {
        value
    }

    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        self * b + c
    }

    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn at_least(self, floor: f32) -> Self {
        self.max(floor)
    }

    #[inline(always)]
    fn below(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn up_to(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn any(self, mask: bool) -> bool {
        mask
    }
}

/// A register of numbers.
#[derive(Clone, Copy, Debug)]
pub struct Lanes<S: Simd> {
    /// Proof that the processor has the instructions.
    pub simd: S,
    /// The numbers.
    pub values: S::f32s,
}

/// A register of truths.
#[derive(Clone, Copy, Debug)]
pub struct LaneMask<S: Simd> {
    simd: S,
    /// One per lane.
    pub values: S::m32s,
}

macro_rules! lanes_operator {
    ($trait:ident, $method:ident, $operation:ident) => {
        impl<S: Simd> $trait for Lanes<S> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self { simd: self.simd, values: self.simd.$operation(self.values, other.values) }
            }
        }
    };
}

lanes_operator!(Add, add, add_f32s);
lanes_operator!(Sub, sub, sub_f32s);
lanes_operator!(Mul, mul, mul_f32s);
lanes_operator!(Div, div, div_f32s);

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self { simd: self.simd, values: self.simd.neg_f32s(self.values) }
    }
}

impl<S: Simd> BitAnd for LaneMask<S> {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self { simd: self.simd, values: self.simd.and_m32s(self.values, other.values) }
    }
}

impl<S: Simd> BitOr for LaneMask<S> {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self { simd: self.simd, values: self.simd.or_m32s(self.values, other.values) }
    }
}

impl<S: Simd> Not for LaneMask<S> {
    type Output = Self;

    #[inline(always)]
    fn not(self) -> Self {
        Self { simd: self.simd, values: self.simd.not_m32s(self.values) }
    }
}

impl<S: Simd> Real for Lanes<S> {
    type Mask = LaneMask<S>;

    #[inline(always)]
    fn splat(self, value: f32) -> Self {
        Self { simd: self.simd, values: self.simd.splat_f32s(value) }
    }

    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        Self { simd: self.simd, values: self.simd.mul_add_e_f32s(self.values, b.values, c.values) }
    }

    #[inline(always)]
    fn root(self) -> Self {
        Self { simd: self.simd, values: self.simd.sqrt_f32s(self.values) }
    }

    #[inline(always)]
    fn at_least(self, floor: f32) -> Self {
        let floor = self.splat(floor);
        Self::select(floor.below(self), self, floor)
    }

    #[inline(always)]
    fn below(self, other: Self) -> LaneMask<S> {
        LaneMask { simd: self.simd, values: self.simd.less_than_f32s(self.values, other.values) }
    }

    #[inline(always)]
    fn up_to(self, other: Self) -> LaneMask<S> {
        LaneMask { simd: self.simd, values: self.simd.less_than_or_equal_f32s(self.values, other.values) }
    }

    #[inline(always)]
    fn select(mask: LaneMask<S>, yes: Self, no: Self) -> Self {
        Self { simd: yes.simd, values: yes.simd.select_f32s(mask.values, yes.values, no.values) }
    }

    #[inline(always)]
    fn any(self, mask: LaneMask<S>) -> bool {
        self.simd.first_true_m32s(mask.values) < S::F32_LANES
    }
}

/// A vector, or one per lane.
#[derive(Clone, Copy, Debug)]
pub struct Vector<R> {
    /// Coordinate.
    pub x: R,
    /// Coordinate.
    pub y: R,
    /// Coordinate.
    pub z: R,
}

impl From<Vec3> for Vector<f32> {
    #[inline(always)]
    fn from(v: Vec3) -> Self {
        Self { x: v.x, y: v.y, z: v.z }
    }
}

impl<R: Real> Vector<R> {
    /// `value` in every lane.
    #[inline(always)]
    pub fn splat(self, value: Vec3) -> Self {
        Self { x: self.x.splat(value.x), y: self.x.splat(value.y), z: self.x.splat(value.z) }
    }

    /// `self . b`.
    #[inline(always)]
    pub fn dot(self, b: Self) -> R {
        self.x.times_plus(b.x, self.y.times_plus(b.y, self.z * b.z))
    }

    /// `self x b`.
    #[inline(always)]
    pub fn cross(self, b: Self) -> Self {
        Self {
            x: self.y.times_plus(b.z, -(self.z * b.y)),
            y: self.z.times_plus(b.x, -(self.x * b.z)),
            z: self.x.times_plus(b.y, -(self.y * b.x)),
        }
    }

    /// `self + t e`.
    #[inline(always)]
    pub fn along(self, t: R, e: Self) -> Self {
        Self { x: t.times_plus(e.x, self.x), y: t.times_plus(e.y, self.y), z: t.times_plus(e.z, self.z) }
    }

    /// [`Real::select`] of each coordinate.
    #[inline(always)]
    pub fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        Self {
            x: R::select(mask, yes.x, no.x),
            y: R::select(mask, yes.y, no.y),
            z: R::select(mask, yes.z, no.z),
        }
    }
}

/// The same three in the same cycle, from the second where the first mask is set, from the third where the second is.
#[inline(always)]
pub fn turn<R: Real>([second, third]: [R::Mask; 2], [a, b, c]: [R; 3]) -> [R; 3] {
    [
        R::select(third, c, R::select(second, b, a)),
        R::select(third, a, R::select(second, c, b)),
        R::select(third, b, R::select(second, a, c)),
    ]
}

impl<R: Real> Vector<R> {
    /// [`turn`] of each coordinate.
    #[inline(always)]
    pub fn turn(which: [R::Mask; 2], [a, b, c]: [Self; 3]) -> [Self; 3] {
        let [ax, bx, cx] = turn(which, [a.x, b.x, c.x]);
        let [ay, by, cy] = turn(which, [a.y, b.y, c.y]);
        let [az, bz, cz] = turn(which, [a.z, b.z, c.z]);
        [Self { x: ax, y: ay, z: az }, Self { x: bx, y: by, z: bz }, Self { x: cx, y: cy, z: cz }]
    }
}

impl<R: Real> Add for Vector<R> {
    type Output = Self;

    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self { x: self.x + b.x, y: self.y + b.y, z: self.z + b.z }
    }
}

impl<R: Real> Sub for Vector<R> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self { x: self.x - b.x, y: self.y - b.y, z: self.z - b.z }
    }
}

impl<R: Real> Mul<R> for Vector<R> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, t: R) -> Self {
        Self { x: self.x * t, y: self.y * t, z: self.z * t }
    }
}

impl<R: Real> Neg for Vector<R> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}

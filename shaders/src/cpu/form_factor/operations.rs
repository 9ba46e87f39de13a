//! Counts the arithmetic of a form factor, so that its rate can be held against a processor's limit.

use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

use glam::Vec3;

use super::Seen;
use super::light::LightGeometry;
use super::real::{Real, Vector};

/// Floating-point operations of one pair by the far form, which nearly all pairs take: a fused product and sum is two, a
/// quotient or root one; comparisons, selections and changes of sign are free.
#[must_use]
pub fn far_operations() -> u32 {
    COUNT.set(0);
    let vector = |v: Vec3| Vector { x: Counted(v.x), y: Counted(v.y), z: Counted(v.z) };
    let light = LightGeometry::new([[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0]].map(Into::into));
    let (x, n) = (vector(Vec3::new(0.0, 0.0, -9.0)), vector(Vec3::Z));
    let _ = Seen::new(&light, x, n).far(&light, n);
    COUNT.get()
}

thread_local! {
    static COUNT: Cell<u32> = const { Cell::new(0) };
}

/// A number that counts what is done with it.
#[derive(Clone, Copy, Debug)]
struct Counted(f32);

fn counted(operations: u32, value: f32) -> Counted {
    COUNT.set(COUNT.get() + operations);
    Counted(value)
}

macro_rules! counted_operator {
    ($trait:ident, $method:ident) => {
        impl $trait for Counted {
            type Output = Self;

            fn $method(self, other: Self) -> Self {
                counted(1, self.0.$method(other.0))
            }
        }
    };
}

counted_operator!(Add, add);
counted_operator!(Sub, sub);
counted_operator!(Mul, mul);
counted_operator!(Div, div);

impl Neg for Counted {
    type Output = Self;

    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Real for Counted {
    type Mask = bool;

    fn splat(self, value: f32) -> Self {
        Self(value)
    }

    fn times_plus(self, b: Self, c: Self) -> Self {
        counted(2, self.0 * b.0 + c.0)
    }

    fn root(self) -> Self {
        counted(1, self.0.sqrt())
    }

    fn at_least(self, floor: f32) -> Self {
        Self(self.0.max(floor))
    }

    fn below(self, other: Self) -> bool {
        self.0 < other.0
    }

    fn up_to(self, other: Self) -> bool {
        self.0 <= other.0
    }

    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    fn any(self, mask: bool) -> bool {
        mask
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dot_product_is_five_operations() {
        COUNT.set(0);
        let v = Vector { x: Counted(1.0), y: Counted(2.0), z: Counted(3.0) };
        assert_eq!(v.dot(v).0, 14.0);
        assert_eq!(COUNT.get(), 5);
        assert!(far_operations() > 100);
    }
}

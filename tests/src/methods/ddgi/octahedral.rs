//! Directions on a square: the octahedral map (Cigolle et al. 2014, "A Survey of Efficient Representations for
//! Independent Unit Vectors").

use std::ops::{Add, Mul};

use glam::{Vec2, Vec3};

/// The unit vector of a point of the square -1..1.
#[must_use]
pub fn decode(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let xy = if z < 0.0 { fold(p) } else { p };
    xy.extend(z).normalize_or_zero()
}

/// The point of the square -1..1 of a direction.
#[must_use]
pub fn encode(d: Vec3) -> Vec2 {
    let p = d.truncate() / d.abs().element_sum().max(f32::MIN_POSITIVE);
    if d.z < 0.0 { fold(p) } else { p }
}

/// The lower half of the octahedron lies in the square's corners.
fn fold(p: Vec2) -> Vec2 {
    (Vec2::ONE - Vec2::new(p.y.abs(), p.x.abs())) * Vec2::new(1.0_f32.copysign(p.x), 1.0_f32.copysign(p.y))
}

/// The direction of texel `index` of a square of `side` texels to a side.
#[must_use]
pub fn texel_direction(index: usize, side: usize) -> Vec3 {
    let centre = Vec2::new((index % side) as f32 + 0.5, (index / side) as f32 + 0.5);
    decode(centre * (2.0 / side as f32) - 1.0)
}

/// Bilinear look-up of `texels` (`side` to a side) in a direction; the square's edges continue at themselves, mirrored.
#[must_use]
pub fn sample<T: Copy + Default + Add<Output = T> + Mul<f32, Output = T>>(
    texels: &[T],
    side: usize,
    direction: Vec3,
) -> T {
    let at = (encode(direction) + 1.0) * (0.5 * side as f32) - 0.5;
    let low = at.floor();
    let (part, x, y) = (at - low, low.x as i32, low.y as i32);
    let texel = |x: i32, y: i32| texels.get(wrap(x, y, side as i32)).copied().unwrap_or_default();
    let row = |y: i32| texel(x, y) * (1.0 - part.x) + texel(x + 1, y) * part.x;
    row(y) * (1.0 - part.y) + row(y + 1) * part.y
}

fn wrap(mut x: i32, mut y: i32, side: i32) -> usize {
    if x < 0 || x >= side {
        (x, y) = (if x < 0 { -1 - x } else { 2 * side - 1 - x }, side - 1 - y);
    }
    if y < 0 || y >= side {
        (x, y) = (side - 1 - x, if y < 0 { -1 - y } else { 2 * side - 1 - y });
    }
    (y * side + x) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::fibonacci_direction;

    #[test]
    fn encoding_is_undone_by_decoding() {
        for i in 0..500 {
            let d = fibonacci_direction(i, 500);
            assert!(decode(encode(d)).distance(d) < 1e-5, "{d}");
        }
    }

    #[test]
    fn look_up_gives_back_a_smooth_function_everywhere() {
        let value = |d: Vec3| 2.0 + d.x - 0.5 * d.y + 0.25 * d.z;
        let texels: Vec<f32> = (0..32 * 32).map(|i| value(texel_direction(i, 32))).collect();
        let error = |d: Vec3| (sample(&texels, 32, d) - value(d)).abs();
        let worst = (0..2000).map(|i| error(fibonacci_direction(i, 2000))).fold(0.0, f32::max);
        // The map bends at the octahedron's edges, where interpolation cuts the corner; a wrong seam errs by 1.
        assert!(worst < 0.03, "{worst}");
    }
}

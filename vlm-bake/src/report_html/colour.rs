//! Colours of the pictures and of their legends, sRGB.

use colorous::{Gradient, TABLEAU10, VIRIDIS};
use glam::Vec3;
use vlm_shaders::cpu::resolve::encode_srgb;

/// Where nothing is seen.
pub const BACKGROUND: [u8; 3] = [24, 26, 30];

/// Surface that a picture has nothing to say about.
pub const PLAIN: [u8; 3] = [168, 168, 172];

/// Surface that makes no lights.
pub const MAKES_NONE: [u8; 3] = [92, 94, 104];

/// A light reaches its own surface.
pub const VIOLATION: [u8; 3] = [228, 26, 28];

/// A light comes out somewhere else.
pub const POKING: [u8; 3] = [240, 140, 20];

/// A tag keeps a light away.
pub const KEPT_DARK: [u8; 3] = [86, 150, 220];

/// The second colour of uncovered surface's hatch.
pub const HATCH: [u8; 3] = [28, 28, 32];

/// Steps of shading. More make smoother pictures and larger files.
const SHADES: f32 = 10.0;

/// Steps of a ramp.
const STEPS: f64 = 48.0;

/// Evenly spaced to the eye, and readable by the colour-blind: dark blue is 0, yellow is 1.
pub const RAMP: Gradient = VIRIDIS;

/// The ramp's colour at `t`, 0 to 1; NaN counts as 0.
pub fn ramp(t: f64) -> [u8; 3] {
    let t = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
    let step = (t * STEPS).round() / STEPS;
    RAMP.eval_continuous(step).as_array()
}

/// The colour of a tag above 0; grey is left out, and colours repeat.
pub fn of_tag(tag: u32) -> [u8; 3] {
    const GREY: usize = 9;
    const COLOURS: [usize; 8] = [0, 1, 4, 6, 5, 3, 8, 2];
    let colour = COLOURS[tag.saturating_sub(1) as usize % COLOURS.len()];
    TABLEAU10[if colour == GREY { 0 } else { colour }].as_array()
}

/// Half way to grey.
pub fn pale(colour: [u8; 3]) -> [u8; 3] {
    std::array::from_fn(|i| ((u16::from(colour[i]) + 2 * u16::from(PLAIN[i])) / 3) as u8)
}

/// A colour by the light of a lamp at the eye; `facing` is the cosine between sight and surface.
pub fn shade(colour: [u8; 3], facing: f32) -> [u8; 3] {
    let step = (facing.clamp(0.0, 1.0) * SHADES).round() / SHADES;
    let factor = 0.5 + 0.5 * step;
    colour.map(|channel| (f32::from(channel) * factor).round() as u8)
}

/// A linear colour by the light of a lamp at the eye.
pub fn shade_linear(colour: Vec3, facing: f32) -> [u8; 3] {
    encode_srgb((colour * (0.2 + 0.8 * facing.clamp(0.0, 1.0))).min(Vec3::ONE))
}

/// A linear colour as it is.
pub fn encode(colour: Vec3) -> [u8; 3] {
    encode_srgb(colour.clamp(Vec3::ZERO, Vec3::ONE))
}

/// As CSS writes it.
pub fn css([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A scrambled share, 0 to 1, of a number: neighbours differ.
pub fn scramble(number: u32) -> f32 {
    let mixed = (number ^ (number >> 16)).wrapping_mul(0x7feb_352d);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x846c_a68b);
    ((mixed ^ (mixed >> 16)) >> 8) as f32 / (1 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_next_to_each_other_have_different_colours() {
        for tag in 1..40 {
            assert_ne!(of_tag(tag), of_tag(tag + 1));
            assert_ne!(of_tag(tag), PLAIN);
        }
    }

    #[test]
    fn the_ramp_grows_brighter() {
        let brightness = |t: f64| ramp(t).iter().map(|&c| u32::from(c)).sum::<u32>();
        assert!((0..10).all(|i| brightness(f64::from(i) / 10.0) < brightness(f64::from(i + 1) / 10.0)));
        assert_eq!(ramp(-1.0), ramp(0.0));
        assert_eq!(ramp(f64::INFINITY), ramp(1.0));
        assert_eq!(ramp(f64::NAN), ramp(0.0));
    }
}

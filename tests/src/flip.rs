//! FLIP for pictures of low dynamic range: how strongly a viewer who flips between two pictures sees them differ.
//!
//! Source: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator for
//! Alternating Images" (2020); sections and equations below are theirs. Computed in f64; filters are applied as products
//! of a row and a column, which changes nothing but the time.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

/// Pixels per degree of the field of view: 0.7 m from a screen of 3840 pixels on 0.7 m, the paper's own choice.
pub const PIXELS_PER_DEGREE: f64 = 67.0;

/// The difference of each pixel, 0 (not seen) to 1, between two pictures in sRGB bytes, rows of `width` pixels.
///
/// `None` if the sizes differ, or the pixels do not fill rows.
#[must_use]
pub fn flip_map(
    width: usize,
    reference: &[[u8; 3]],
    test: &[[u8; 3]],
    pixels_per_degree: f64,
) -> Option<Vec<f64>> {
    if reference.len() != test.len() || width == 0 || !reference.len().is_multiple_of(width) {
        return None;
    }
    let space = ColourSpace::srgb();
    let opponent = |picture: &[[u8; 3]]| -> Vec<DVec3> {
        picture.iter().map(|&pixel| space.ycxcz_from_linear(decode_srgb(pixel))).collect()
    };
    let pictures = [opponent(reference), opponent(test)].map(|pixels| Picture { width, pixels });
    let [colours_a, colours_b] = pictures.each_ref().map(|p| perceived(p, &space, pixels_per_degree));
    let [features_a, features_b] = pictures.each_ref().map(|p| features(p, pixels_per_degree));
    let pixels = colours_a.iter().zip(&colours_b).zip(features_a.iter().zip(&features_b));
    let farthest = farthest(&space);
    let map = pixels.map(|((&colour_a, &colour_b), (feature_a, feature_b))| {
        let colour = redistribute(hyab(colour_a, colour_b), farthest);
        let edges = (feature_a.edge - feature_b.edge).abs();
        let points = (feature_a.point - feature_b.point).abs();
        let feature = (edges.max(points) / 2f64.sqrt()).sqrt();
        // Rounding alone carries the farthest colours beyond 1.
        colour.powf(1.0 - feature).min(1.0)
    });
    Some(map.collect())
}

/// Rows of colours.
struct Picture {
    width: usize,
    pixels: Vec<DVec3>,
}

fn decode_srgb(pixel: [u8; 3]) -> DVec3 {
    let channel = |byte: u8| {
        let encoded = f64::from(byte) / 255.0;
        if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    };
    DVec3::from(pixel.map(channel))
}

/// sRGB's primaries and white (IEC 61966-2-1) as matrices.
struct ColourSpace {
    /// CIE XYZ over the white's, from linear RGB.
    white_relative_from_rgb: DMat3,
    rgb_from_white_relative: DMat3,
}

impl ColourSpace {
    fn srgb() -> Self {
        let xyz = |x: f64, y: f64| DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
        let primaries = DMat3::from_cols(xyz(0.64, 0.33), xyz(0.30, 0.60), xyz(0.15, 0.06));
        let white = xyz(0.3127, 0.3290);
        let weights = primaries.inverse() * white;
        let forward = DMat3::from_diagonal(1.0 / white) * primaries * DMat3::from_diagonal(weights);
        Self { white_relative_from_rgb: forward, rgb_from_white_relative: forward.inverse() }
    }

    /// The linearised CIELAB in which contrast is filtered (section 4.1).
    fn ycxcz_from_linear(&self, rgb: DVec3) -> DVec3 {
        let DVec3 { x, y, z } = self.white_relative_from_rgb * rgb;
        DVec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
    }

    fn linear_from_ycxcz(&self, colour: DVec3) -> DVec3 {
        let y = (colour.x + 16.0) / 116.0;
        self.rgb_from_white_relative * DVec3::new(y + colour.y / 500.0, y, y - colour.z / 200.0)
    }

    /// CIELAB with Hunt's adjustment: pale and dark colours differ less (equation 5).
    fn hunt_lab_from_linear(&self, rgb: DVec3) -> DVec3 {
        let delta: f64 = 6.0 / 29.0;
        let f = |t: f64| {
            if t > delta.powi(3) { t.cbrt() } else { t / (3.0 * delta * delta) + 4.0 / 29.0 }
        };
        let DVec3 { x, y, z } = (self.white_relative_from_rgb * rgb).map(f);
        let lightness = 116.0 * y - 16.0;
        DVec3::new(lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z))
    }
}

/// What is left of the colours after the eye's contrast sensitivity (section 4.1).
fn perceived(picture: &Picture, space: &ColourSpace, pixels_per_degree: f64) -> Vec<DVec3> {
    // a and b of equation 3, table 1. A term is a * sqrt(pi / b) * exp(-pi^2 x^2 / b), x in degrees.
    const TERMS: [&[(f64, f64)]; 3] = [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];
    let widest = 0.04 / (2.0 * PI * PI);
    let radius = (3.0 * widest.sqrt() * pixels_per_degree).ceil() as i32;
    let filtered: [Vec<f64>; 3] = [0, 1, 2].map(|channel| {
        let plane: Vec<f64> = picture.pixels.iter().map(|pixel| pixel[channel]).collect();
        let mut sum = vec![0.0; plane.len()];
        let mut total = 0.0;
        for &(a, b) in TERMS[channel] {
            let gaussian = |x: i32| (-(PI * f64::from(x) / pixels_per_degree).powi(2) / b).exp();
            let kernel: Vec<f64> = (-radius..=radius).map(gaussian).collect();
            let weight = a * (PI / b).sqrt();
            total += weight * kernel.iter().sum::<f64>().powi(2);
            for (sum, value) in sum.iter_mut().zip(convolve(&plane, picture.width, &kernel, &kernel)) {
                *sum += weight * value;
            }
        }
        sum.iter().map(|value| value / total).collect()
    });
    let pixel = |i: usize| {
        let colour = DVec3::new(filtered[0][i], filtered[1][i], filtered[2][i]);
        space.hunt_lab_from_linear(space.linear_from_ycxcz(colour).clamp(DVec3::ZERO, DVec3::ONE))
    };
    (0..picture.pixels.len()).map(pixel).collect()
}

/// Distance for large colour differences (Abasi et al. 2020).
fn hyab(a: DVec3, b: DVec3) -> f64 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

/// Exponent that compresses large colour differences (section 4.1.3).
const COMPRESSION: f64 = 0.7;

/// The largest distance that two sRGB colours have, compressed: green from blue.
fn farthest(space: &ColourSpace) -> f64 {
    hyab(space.hunt_lab_from_linear(DVec3::Y), space.hunt_lab_from_linear(DVec3::Z)).powf(COMPRESSION)
}

/// Maps a distance to 0..1: the lower 40 % of the compressed range take 95 % of it (section 4.1.3).
fn redistribute(distance: f64, farthest: f64) -> f64 {
    const KNEE: f64 = 0.4;
    const AT_KNEE: f64 = 0.95;
    let share = distance.powf(COMPRESSION) / farthest;
    if share < KNEE {
        share * AT_KNEE / KNEE
    } else {
        AT_KNEE + (share - KNEE) / (1.0 - KNEE) * (1.0 - AT_KNEE)
    }
}

/// How strongly a pixel is an edge or a point, 0 to 1.
struct Feature {
    edge: f64,
    point: f64,
}

/// Edges and points of the unfiltered lightness (section 4.2).
fn features(picture: &Picture, pixels_per_degree: f64) -> Vec<Feature> {
    /// Width of the eye's detector, degrees.
    const DETECTOR: f64 = 0.082;
    let lightness: Vec<f64> = picture.pixels.iter().map(|pixel| (pixel.x + 16.0) / 116.0).collect();
    let deviation = 0.5 * DETECTOR * pixels_per_degree;
    let radius = (3.0 * deviation).ceil() as i32;
    let kernel = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let weight = |x: i32| {
            let x = f64::from(x) / deviation;
            f(x) * (-0.5 * x * x).exp()
        };
        balanced((-radius..=radius).map(weight).collect())
    };
    let smooth = kernel(&|_| 1.0);
    let magnitude = |across: &[f64]| -> Vec<f64> {
        let horizontal = convolve(&lightness, picture.width, across, &smooth);
        let vertical = convolve(&lightness, picture.width, &smooth, across);
        horizontal.iter().zip(&vertical).map(|(h, v)| h.hypot(*v)).collect()
    };
    let (edges, points) = (magnitude(&kernel(&|x| -x)), magnitude(&kernel(&|x| x * x - 1.0)));
    edges.into_iter().zip(points).map(|(edge, point)| Feature { edge, point }).collect()
}

/// Scales the weights so that those above 0 sum to 1 and those below to -1, if there are any.
fn balanced(weights: Vec<f64>) -> Vec<f64> {
    let above: f64 = weights.iter().filter(|w| **w > 0.0).sum();
    let below: f64 = -weights.iter().filter(|w| **w < 0.0).sum::<f64>();
    weights.into_iter().map(|w| if w > 0.0 { w / above } else { w / below.max(f64::MIN_POSITIVE) }).collect()
}

/// Filters rows by `across` and columns by `down`; beyond the border the picture goes on as it ends.
fn convolve(plane: &[f64], width: usize, across: &[f64], down: &[f64]) -> Vec<f64> {
    let height = plane.len() / width;
    let rows = filter(width, height, across, |x, y| plane[y * width + x]);
    // Rows and columns change places.
    let columns = filter(height, width, down, |y, x| rows[y * width + x]);
    (0..plane.len()).map(|i| columns[(i % width) * height + i / width]).collect()
}

/// Correlates each of `count` lines of a length with a kernel.
fn filter(length: usize, count: usize, kernel: &[f64], at: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    let radius = kernel.len() / 2;
    let value = |line: usize, place: usize| {
        let tap = |(k, weight): (usize, &f64)| {
            weight * at((place + k).saturating_sub(radius).min(length - 1), line)
        };
        kernel.iter().enumerate().map(tap).sum::<f64>()
    };
    (0..count)
        .flat_map(|line| (0..length).map(move |place| (line, place)))
        .map(|(l, p)| value(l, p))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 24;

    fn picture() -> Vec<[u8; 3]> {
        (0..WIDTH * 20)
            .map(|i| [(i % WIDTH * 9) as u8, (i / WIDTH * 11) as u8, (i * 7 % 200) as u8])
            .collect()
    }

    fn mean(a: &[[u8; 3]], b: &[[u8; 3]]) -> f64 {
        let map = flip_map(WIDTH, a, b, PIXELS_PER_DEGREE).unwrap();
        assert!(map.iter().all(|value| (0.0..=1.0).contains(value)));
        map.iter().sum::<f64>() / map.len() as f64
    }

    #[test]
    fn nothing_differs_from_itself() {
        assert_eq!(mean(&picture(), &picture()), 0.0);
    }

    #[test]
    fn green_and_blue_differ_most() {
        let uniform = |pixel: [u8; 3]| vec![pixel; WIDTH * 4];
        let farthest = mean(&uniform([0, 255, 0]), &uniform([0, 0, 255]));
        assert!((farthest - 1.0).abs() < 1e-9, "{farthest}");
        let near = mean(&uniform([0, 255, 0]), &uniform([0, 250, 0]));
        assert!(near > 0.0 && near < 0.3, "{near}");
    }

    #[test]
    fn a_shift_and_a_swap_are_seen() {
        let mut shifted = picture();
        shifted.rotate_right(1);
        let swapped: Vec<_> = picture().iter().map(|&[r, g, b]| [b, g, r]).collect();
        assert!(mean(&picture(), &shifted) > 0.01);
        assert!(mean(&picture(), &swapped) > 0.1);
    }

    #[test]
    fn fine_noise_of_colour_weighs_less_the_farther_the_viewer() {
        let noisy_pixel = |(i, [r, g, b]): (usize, [u8; 3])| [r, g, b.saturating_add((i * 37 % 41) as u8)];
        let noisy: Vec<_> = picture().into_iter().enumerate().map(noisy_pixel).collect();
        let at = |ppd| flip_map(WIDTH, &picture(), &noisy, ppd).unwrap().iter().sum::<f64>();
        assert!(at(20.0) > at(120.0), "{} against {}", at(20.0), at(120.0));
    }

    #[test]
    fn pictures_of_different_size_have_no_difference() {
        assert_eq!(flip_map(WIDTH, &picture(), &picture()[WIDTH..], 67.0), None);
        assert_eq!(flip_map(7, &picture(), &picture(), 67.0), None);
        assert_eq!(flip_map(0, &[], &[], 67.0), None);
    }
}

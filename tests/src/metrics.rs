//! How far one buffer of irradiance is from another. Both are linear; only pixels that show a surface count.

use glam::Vec3;
use serde::Serialize;
use vlm_shaders::cpu::resolve::{auto_exposure, encode_srgb, luminance, tone_map};

use crate::flip::{PIXELS_PER_DEGREE, flip_map};

/// The distance of a picture from the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Metrics {
    /// `sqrt(mean((a - b)^2)) / sqrt(mean(b^2))` over pixels and channels; `b` is the truth.
    pub relative_rmse: f64,
    /// `mean((a - b)^2 / (b^2 + e^2))` over pixels and channels, with `e` = 1 % of the truth's mean: dark pixels count
    /// as much as bright ones, black ones do not count without bound.
    pub rel_mse: f64,
    /// `sum(a) / sum(b) - 1`: above 0 is too bright.
    pub signed_energy: f64,
    /// 99th percentile of the luminance's `|a - b|`, over the truth's mean luminance.
    pub p99: f64,
    /// Largest difference of the luminance's `a - b` between two neighbouring pixels, over the truth's mean luminance:
    /// an edge that is in `a` alone, or in `b` alone.
    pub largest_jump: f64,
    /// Mean FLIP of the shown pictures, 0 to 1; only [`compare_shown`] finds it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flip: Option<f64>,
    /// Pixels that count.
    pub pixels: usize,
}

/// Two buffers to compare, rows of `width` pixels; `hit` says which of them count.
#[derive(Clone, Copy, Debug)]
pub struct Comparison<'a> {
    /// Pixels in a row.
    pub width: usize,
    /// The buffer to judge.
    pub image: &'a [Vec3],
    /// The truth.
    pub truth: &'a [Vec3],
    /// One per pixel.
    pub hit: &'a [bool],
}

/// Measures every distance but FLIP, which takes longer than all others together; `None` if the buffers' sizes differ, no pixel counts, or the truth is black.
#[must_use]
pub fn compare(comparison: &Comparison<'_>) -> Option<Metrics> {
    let Comparison { width, image, truth, hit } = *comparison;
    let same_size = image.len() == truth.len() && image.len() == hit.len() && width > 0;
    let counted = || (0..image.len()).filter(|&i| hit[i]);
    if !same_size || counted().next().is_none() {
        return None;
    }
    let pixels = counted().count();
    let channels = || counted().flat_map(|i| image[i].to_array().into_iter().zip(truth[i].to_array()));
    let mean = |f: &dyn Fn(f64, f64) -> f64| {
        channels().map(|(a, b)| f(f64::from(a), f64::from(b))).sum::<f64>() / (3 * pixels) as f64
    };
    let (mean_image, mean_truth) = (mean(&|a, _| a), mean(&|_, b| b));
    let mean_luminance = counted().map(|i| f64::from(luminance(truth[i]))).sum::<f64>() / pixels as f64;
    if mean_truth <= 0.0 || mean_luminance <= 0.0 {
        return None;
    }
    let floor = 0.01 * mean_truth;
    Some(Metrics {
        relative_rmse: (mean(&|a, b| (a - b) * (a - b)) / mean(&|_, b| b * b)).sqrt(),
        rel_mse: mean(&|a, b| (a - b) * (a - b) / (b * b + floor * floor)),
        signed_energy: mean_image / mean_truth - 1.0,
        p99: percentile(counted().map(|i| error(comparison, i).abs()).collect(), 0.99) / mean_luminance,
        largest_jump: largest_jump(comparison) / mean_luminance,
        flip: None,
        pixels,
    })
}

/// As [`compare`], with FLIP (Andersson et al. 2020) at 67 pixels per degree: both buffers are shown as 8-bit sRGB with
/// the exposure that suits the truth, black where nothing counts.
#[must_use]
pub fn compare_shown(comparison: &Comparison<'_>) -> Option<Metrics> {
    let metrics = compare(comparison)?;
    let counted = |buffer: &[Vec3]| -> Vec<Vec3> {
        let pixels = buffer.iter().zip(comparison.hit);
        pixels.map(|(&pixel, &hit)| if hit { pixel } else { Vec3::ZERO }).collect()
    };
    let (image, truth) = (counted(comparison.image), counted(comparison.truth));
    let exposure = auto_exposure(&truth);
    let shown = |buffer: &[Vec3]| -> Vec<[u8; 3]> {
        buffer.iter().map(|&pixel| encode_srgb(tone_map(pixel * exposure))).collect()
    };
    let map = flip_map(comparison.width, &shown(&truth), &shown(&image), PIXELS_PER_DEGREE)?;
    let counted = map.iter().zip(comparison.hit).filter(|(_, hit)| **hit).map(|(value, _)| value);
    Some(Metrics { flip: Some(counted.sum::<f64>() / metrics.pixels as f64), ..metrics })
}

/// RMS of the difference of two frames over the truth's RMS, over pixels that count and channels: what flickers.
/// `None` if sizes differ, no pixel counts, or the truth is black.
#[must_use]
pub fn frame_change(first: &[Vec3], second: &[Vec3], truth: &[Vec3], hit: &[bool]) -> Option<f64> {
    if [first.len(), second.len(), truth.len()] != [hit.len(); 3] {
        return None;
    }
    let squares = |f: &dyn Fn(usize) -> Vec3| -> f64 {
        (0..hit.len()).filter(|&i| hit[i]).map(|i| f(i).as_dvec3().length_squared()).sum()
    };
    let truth = squares(&|i| truth[i]);
    (truth > 0.0).then(|| (squares(&|i| second[i] - first[i]) / truth).sqrt())
}

/// Signed error of a pixel's luminance.
fn error(comparison: &Comparison<'_>, pixel: usize) -> f64 {
    f64::from(luminance(comparison.image[pixel])) - f64::from(luminance(comparison.truth[pixel]))
}

fn percentile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let rank = (share * values.len() as f64).ceil() as usize;
    values.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

fn largest_jump(comparison: &Comparison<'_>) -> f64 {
    let Comparison { width, image, hit, .. } = *comparison;
    let pairs = (0..image.len()).flat_map(|i| {
        let right = ((i + 1) % width != 0).then_some(i + 1);
        let below = Some(i + width).filter(|&j| j < image.len());
        right.into_iter().chain(below).map(move |j| (i, j))
    });
    let both_hit = pairs.filter(|&(i, j)| hit[i] && hit[j]);
    both_hit.map(|(i, j)| (error(comparison, i) - error(comparison, j)).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 16;

    /// A smooth picture with different channels.
    fn picture() -> Vec<Vec3> {
        let pixel = |i: usize| Vec3::new(1.0 + (i % WIDTH) as f32, 2.0 + (i / WIDTH) as f32, 3.0);
        (0..WIDTH * WIDTH).map(pixel).collect()
    }

    fn measure(image: &[Vec3]) -> Metrics {
        let (truth, hit) = (picture(), vec![true; WIDTH * WIDTH]);
        compare(&Comparison { width: WIDTH, image, truth: &truth, hit: &hit }).unwrap()
    }

    #[test]
    fn nothing_differs_from_itself() {
        let same = Metrics { pixels: WIDTH * WIDTH, ..Metrics::default() };
        assert_eq!(measure(&picture()), same);
    }

    #[test]
    fn scaling_shows_in_every_metric() {
        let scaled: Vec<Vec3> = picture().iter().map(|p| *p * 1.05).collect();
        let metrics = measure(&scaled);
        assert!((metrics.relative_rmse - 0.05).abs() < 1e-6);
        assert!((metrics.signed_energy - 0.05).abs() < 1e-6);
        assert!((metrics.rel_mse - 0.0025).abs() < 1e-5);
        assert!(metrics.p99 > 0.05 && metrics.largest_jump > 0.0);
    }

    #[test]
    fn swapped_channels_and_shifted_pixels_show() {
        let swapped: Vec<Vec3> = picture().iter().map(|p| Vec3::new(p.z, p.y, p.x)).collect();
        assert!(measure(&swapped).relative_rmse > 0.1);
        assert!(measure(&swapped).signed_energy.abs() < 1e-6, "energy alone would not see it");
        let mut shifted = picture();
        shifted.rotate_right(1);
        assert!(measure(&shifted).relative_rmse > 0.05);
    }

    #[test]
    fn the_shown_pictures_differ_where_the_buffers_do() {
        let (truth, hit) = (picture(), vec![true; WIDTH * WIDTH]);
        let flip = |image: &[Vec3], hit: &[bool]| {
            let comparison = Comparison { width: WIDTH, image, truth: &truth, hit };
            assert_eq!(compare(&comparison).unwrap().flip, None);
            compare_shown(&comparison).unwrap().flip.unwrap()
        };
        assert_eq!(flip(&truth, &hit), 0.0);
        let scaled = |factor: f32| -> Vec<Vec3> { truth.iter().map(|p| *p * factor).collect() };
        let (little, more) = (flip(&scaled(1.05), &hit), flip(&scaled(1.5), &hit));
        assert!(little > 0.005 && more > 2.0 * little, "{little} {more}");
        let (mut spotted, mut without) = (truth.clone(), hit.clone());
        spotted[100] = Vec3::splat(f32::MAX);
        without[100] = false;
        assert!(flip(&spotted, &hit) > 0.0);
        assert_eq!(flip(&spotted, &without), 0.0);
    }

    #[test]
    fn frames_that_differ_by_a_twentieth_change_by_it() {
        let (truth, mut hit) = (picture(), vec![true; WIDTH * WIDTH]);
        let mut second: Vec<Vec3> = truth.iter().map(|p| *p * 1.05).collect();
        let change = frame_change(&truth, &second, &truth, &hit).unwrap();
        assert!((change - 0.05).abs() < 1e-6);
        assert_eq!(frame_change(&second, &second, &truth, &hit), Some(0.0));
        second[7] = Vec3::splat(1e9);
        hit[7] = false;
        assert!(frame_change(&truth, &second, &truth, &hit).unwrap() < 0.051);
        assert_eq!(frame_change(&truth, &second, &truth, &hit[1..]), None);
        assert_eq!(frame_change(&truth, &second, &vec![Vec3::ZERO; hit.len()], &hit), None);
    }

    #[test]
    fn one_bright_pixel_is_a_jump_and_no_percentile() {
        let mut spotted = picture();
        spotted[100] += Vec3::splat(50.0);
        let metrics = measure(&spotted);
        assert!(metrics.largest_jump > 5.0 && metrics.p99 == 0.0);
    }

    #[test]
    fn pixels_without_surface_do_not_count() {
        let (truth, mut image, mut hit) = (picture(), picture(), vec![true; WIDTH * WIDTH]);
        image[3] = Vec3::splat(1e9);
        hit[3] = false;
        let metrics = compare(&Comparison { width: WIDTH, image: &image, truth: &truth, hit: &hit }).unwrap();
        assert_eq!((metrics.relative_rmse, metrics.largest_jump), (0.0, 0.0));
        let none = vec![false; WIDTH * WIDTH];
        assert_eq!(compare(&Comparison { width: WIDTH, image: &image, truth: &truth, hit: &none }), None);
        assert_eq!(compare(&Comparison { width: WIDTH, image: &image[1..], truth: &truth, hit: &hit }), None);
    }
}

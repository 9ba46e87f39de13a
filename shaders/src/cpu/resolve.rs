//! From light to a picture: exposure, tone map, sRGB.

use glam::Vec3;

/// Luminance of linear sRGB (Rec. 709 primaries).
#[must_use]
pub fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// The exposure that maps the log-average luminance to middle grey, 0.18 (Reinhard et al. 2002, equation 1).
///
/// Black pixels are left out, so that the share of background does not change a picture's brightness; what is darker
/// than 5 % of the mean counts as that, so that deep shadows do not wash out the lit parts. 1 where all is black.
#[must_use]
pub fn auto_exposure(radiance: &[Vec3]) -> f32 {
    let lit = || radiance.iter().map(|&r| f64::from(luminance(r))).filter(|l| *l > 0.0 && l.is_finite());
    let count = lit().count() as f64;
    if count == 0.0 {
        return 1.0;
    }
    let floor = 0.05 * lit().sum::<f64>() / count;
    (0.18 / (lit().map(|l| l.max(floor).ln()).sum::<f64>() / count).exp()) as f32
}

/// Compresses exposed radiance to 0..1: Khronos PBR Neutral tone mapper (2024), which shows base colours unchanged up
/// to 0.76 and desaturates what is brighter.
#[must_use]
pub fn tone_map(color: Vec3) -> Vec3 {
    const START_COMPRESSION: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let color = color.max(Vec3::ZERO);
    let darkest = color.min_element();
    let offset = if darkest < 0.08 { darkest - 6.25 * darkest * darkest } else { 0.04 };
    let color = color - offset;
    let peak = color.max_element();
    if peak < START_COMPRESSION {
        return color;
    }
    let d = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - d * d / (peak + d - START_COMPRESSION);
    let share = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    (color * (new_peak / peak)).lerp(Vec3::splat(new_peak), share)
}

/// Linear 0..1 to sRGB bytes (IEC 61966-2-1).
#[must_use]
pub fn encode_srgb(color: Vec3) -> [u8; 3] {
    color.to_array().map(|linear| {
        let linear = linear.clamp(0.0, 1.0);
        let encoded =
            if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        (encoded * 255.0 + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposure_shows_a_uniform_picture_as_middle_grey() {
        let exposure = auto_exposure(&[Vec3::splat(50.0), Vec3::ZERO, Vec3::splat(50.0)]);
        assert!((exposure * 50.0 - 0.18).abs() < 1e-5);
        assert_eq!(auto_exposure(&[Vec3::ZERO]), 1.0);
    }

    #[test]
    fn deep_shadow_does_not_wash_out_the_rest() {
        let exposure = auto_exposure(&[Vec3::splat(10.0), Vec3::splat(1e-6)]);
        assert!(exposure * 10.0 < 0.18 * 7.0, "{exposure}");
    }

    #[test]
    fn tone_map_is_monotonic_and_stays_below_one() {
        let shown: Vec<f32> = (0..1000).map(|i| tone_map(Vec3::splat(i as f32 * 0.02)).x).collect();
        assert!(shown.is_sorted() && shown[0] == 0.0 && shown[999] < 1.0);
        let red = tone_map(Vec3::new(0.5, 0.1, 0.1));
        assert!((red.x - red.y - 0.4).abs() < 1e-6, "base colours keep their differences");
    }

    #[test]
    fn srgb_bytes() {
        assert_eq!(encode_srgb(Vec3::new(0.0, 1.0, 0.214_041_14)), [0, 255, 128]);
        assert_eq!(encode_srgb(Vec3::new(f32::NAN, -1.0, 9.0)), [0, 0, 255]);
    }
}

//! Pictures as `data:` URIs.

use std::io::Cursor;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ImageError, RgbImage};

/// JPEG's quality. Higher values blur edges less and take more space.
const QUALITY: u8 = 82;

/// PNG keeps flat colours and edges; it may be this many times as large as JPEG before that takes its place.
const PNG_MAY_COST: usize = 2;

/// A picture as a `data:` URI: PNG, or JPEG where that is far smaller.
///
/// # Errors
/// If the encoder fails.
pub fn data_uri(image: &RgbImage) -> Result<String, ImageError> {
    let mut png = Cursor::new(Vec::new());
    image.write_with_encoder(PngEncoder::new_with_quality(
        &mut png,
        CompressionType::Best,
        FilterType::Adaptive,
    ))?;
    let mut jpeg = Cursor::new(Vec::new());
    image.write_with_encoder(JpegEncoder::new_with_quality(&mut jpeg, QUALITY))?;
    let (png, jpeg) = (png.into_inner(), jpeg.into_inner());
    let is_png = png.len() <= PNG_MAY_COST * jpeg.len();
    let (kind, bytes) = if is_png { ("png", png) } else { ("jpeg", jpeg) };
    Ok(format!("data:image/{kind};base64,{}", STANDARD.encode(bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report_html::colour::scramble;
    use image::Rgb;

    #[test]
    fn flat_pictures_are_png_and_noisy_ones_jpeg() {
        let flat = RgbImage::from_pixel(64, 64, Rgb([9, 8, 7]));
        let uri = data_uri(&flat).unwrap();
        let bytes = STANDARD.decode(uri.strip_prefix("data:image/png;base64,").unwrap()).unwrap();
        assert_eq!(image::load_from_memory(&bytes).unwrap().into_rgb8(), flat);
        // Slow change with a little grain, as a texture has.
        let grainy = |x: u32, y: u32, c: u32| (x + y + 30 * c) as f32 + 12.0 * scramble(3 * (64 * y + x) + c);
        let noisy = RgbImage::from_fn(64, 64, |x, y| Rgb([0, 1, 2].map(|c| grainy(x, y, c) as u8)));
        assert!(data_uri(&noisy).unwrap().starts_with("data:image/jpeg;base64,"));
    }
}

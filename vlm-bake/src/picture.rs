//! Renderings as files: PNG to look at, EXR to measure.

use std::f32::consts::PI;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use glam::Vec3;
use image::{ImageFormat, Rgb, Rgb32FImage, RgbImage};
use vlm_format::write_file;
use vlm_shaders::cpu::resolve::{auto_exposure, encode_srgb, tone_map};

use crate::gbuffer::GBuffer;
use crate::render::Rendering;

/// Shown where nothing is hit, sRGB.
const BACKGROUND: [u8; 3] = [24, 26, 30];

/// Why a picture was not written.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The pixels could not be encoded.
    #[error("{path}: the picture could not be encoded: {source}", path = path.display())]
    Encode {
        /// The file that was to be written.
        path: PathBuf,
        /// The encoder's reason.
        source: image::ImageError,
    },
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] vlm_format::Error),
}

/// Radiance that leaves each pixel's surface, nt: `L_e + albedo / pi * (direct + indirect irradiance)`.
#[must_use]
pub fn radiance(rendering: &Rendering) -> Vec<Vec3> {
    let light = rendering.direct.iter().zip(&rendering.indirect);
    let pixels = rendering.gbuffer.points.iter().zip(light);
    let radiance = pixels.map(|(point, (&direct, &indirect))| {
        point.as_ref().map_or(Vec3::ZERO, |p| p.emission + p.albedo / PI * (direct + indirect))
    });
    radiance.collect()
}

/// Writes the shown picture, tone mapped, and returns the exposure: what radiance in nt was multiplied by. Without a
/// given one it is chosen so that the mean brightness (geometric) shows as middle grey.
///
/// # Errors
/// If the file cannot be encoded or written; then no partial file is left.
pub fn write_png(rendering: &Rendering, path: &Path, exposure: Option<f32>) -> Result<f32, PictureError> {
    let radiance = radiance(rendering);
    let exposure = exposure.unwrap_or_else(|| auto_exposure(&radiance));
    let GBuffer { width, height, points } = &rendering.gbuffer;
    let image = RgbImage::from_fn(*width, *height, |x, y| {
        let pixel = y as usize * *width as usize + x as usize;
        let shown = radiance.get(pixel).filter(|_| matches!(points.get(pixel), Some(Some(_))));
        Rgb(shown.map_or(BACKGROUND, |&radiance| encode_srgb(tone_map(radiance * exposure))))
    });
    let mut file = Cursor::new(Vec::new());
    let encoded = image.write_to(&mut file, ImageFormat::Png);
    encoded.map_err(|source| PictureError::Encode { path: path.to_owned(), source })?;
    write_file(path, file.get_ref())?;
    Ok(exposure)
}

/// Writes the indirect irradiance in lx as RGB float32; 0 where nothing is hit.
///
/// # Errors
/// If the file cannot be encoded or written; then no partial file is left.
pub fn write_irradiance(rendering: &Rendering, path: &Path) -> Result<(), PictureError> {
    let GBuffer { width, height, .. } = rendering.gbuffer;
    let image = Rgb32FImage::from_fn(width, height, |x, y| {
        let pixel = y as usize * width as usize + x as usize;
        Rgb(rendering.indirect.get(pixel).copied().unwrap_or_default().to_array())
    });
    let mut file = Cursor::new(Vec::new());
    let encoded = image.write_to(&mut file, ImageFormat::OpenExr);
    encoded.map_err(|source| PictureError::Encode { path: path.to_owned(), source })?;
    Ok(write_file(path, file.get_ref())?)
}

/// Reads what [`write_irradiance`] wrote: width, height, and RGB rows from the top.
///
/// # Errors
/// If the file cannot be read or is not an image.
pub fn read_irradiance(path: &Path) -> Result<(u32, u32, Vec<Vec3>), image::ImageError> {
    let image = image::open(path)?.into_rgb32f();
    let pixels = image.pixels().map(|&Rgb(rgb)| Vec3::from(rgb)).collect();
    Ok((image.width(), image.height(), pixels))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shade::SurfacePoint;

    /// Two pixels: a grey surface, and nothing.
    fn rendering() -> Rendering {
        let point = SurfacePoint {
            triangle: 0,
            position: Vec3::ZERO,
            normal: Vec3::Z,
            geometric_normal: Vec3::Z,
            albedo: Vec3::splat(0.5),
            emission: Vec3::ZERO,
        };
        Rendering {
            gbuffer: GBuffer { width: 2, height: 1, points: vec![Some(point), None] },
            direct: vec![Vec3::splat(PI), Vec3::ZERO],
            indirect: vec![Vec3::new(PI, 0.1, 1e6), Vec3::ZERO],
            ..Rendering::default()
        }
    }

    #[test]
    fn irradiance_survives_the_file_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("e.exr");
        write_irradiance(&rendering(), &path).unwrap();
        assert_eq!(read_irradiance(&path).unwrap(), (2, 1, rendering().indirect));
    }

    #[test]
    fn pictures_show_reflected_light_and_the_background() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.png");
        assert!((radiance(&rendering())[0].x - 1.0).abs() < 1e-6, "0.5 / pi * (pi + pi)");
        let exposure = write_png(&rendering(), &path, Some(0.5)).unwrap();
        let image = image::open(&path).unwrap().into_rgb8();
        assert_eq!((exposure, image.dimensions()), (0.5, (2, 1)));
        assert_eq!(image.get_pixel(1, 0).0, BACKGROUND);
        assert!(image.get_pixel(0, 0).0[2] > 200, "the bright channel");
    }

    #[test]
    fn a_missing_folder_is_named_and_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("none").join("p.png");
        let message = write_png(&rendering(), &path, None).unwrap_err().to_string();
        assert!(message.contains("none") && message.contains("folder"), "{message}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}

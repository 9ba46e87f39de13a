//! Irradiance as EXR files, without a whole rendering around it.

use std::path::Path;

use glam::Vec3;
use vlm_bake::gbuffer::GBuffer;
use vlm_bake::picture::{PictureError, write_irradiance};
use vlm_bake::render::Rendering;

/// Writes `pixels` (rows from the top) as [`vlm_bake::picture::read_irradiance`] reads them.
///
/// # Errors
/// If the file cannot be encoded or written; then no partial file is left.
pub fn write(path: &Path, (width, height): (u32, u32), pixels: &[Vec3]) -> Result<(), PictureError> {
    let gbuffer = GBuffer { width, height, points: Vec::new() };
    let rendering = Rendering { gbuffer, indirect: pixels.to_vec(), ..Rendering::default() };
    write_irradiance(&rendering, path)
}

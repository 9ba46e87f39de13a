//! Decodes images into textures, in parallel.

use super::LoadOptions;
use super::material::TextureRequest;
use super::texture::Texture;
use image::{ImageReader, Limits, RgbaImage};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::sync::atomic::{AtomicUsize, Ordering};
use vlm_format::GltfFile;

/// Widest and highest image that is decoded, texels.
const MAX_SIDE: u32 = 1 << 15;

/// Most memory that one image may take, bytes: that of a side of 16384.
const MAX_BYTES: u64 = 1 << 30;

/// Decodes what was asked for, each image once. An image that cannot be read becomes white and a note.
pub(super) fn textures(
    file: &GltfFile,
    requests: &[TextureRequest],
    options: &LoadOptions,
    notes: &mut Vec<String>,
) -> Vec<Texture> {
    let mut requests_of_image: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (number, request) in requests.iter().enumerate() {
        requests_of_image.entry(request.image).or_default().push(number);
    }
    let images: Vec<(usize, Vec<usize>)> = requests_of_image.into_iter().collect();
    let done = AtomicUsize::new(0);
    let decoded: Vec<_> = images
        .par_iter()
        .map(|(image, numbers)| {
            let textures = decode(file, *image).map(|pixels| build(&pixels, requests, numbers, options));
            options.report_texture(done.fetch_add(1, Ordering::Relaxed) + 1, images.len());
            textures
        })
        .collect();

    let mut textures = vec![None; requests.len()];
    for ((image, numbers), result) in images.iter().zip(decoded) {
        match result {
            Ok(built) => numbers.iter().zip(built).for_each(|(&number, texture)| textures[number] = texture),
            Err(reason) => notes.push(format!("/images/{image}: read as white: {reason}")),
        }
    }
    textures.into_iter().map(|texture| texture.unwrap_or_else(Texture::white)).collect()
}

/// What is wrong, without the name of the file, which all notes are about.
fn cause(error: &vlm_format::Error) -> String {
    match error {
        vlm_format::Error::Invalid { issues, .. } => issues
            .first()
            .map_or_else(String::new, |issue| format!("{}; {}", issue.message, issue.code.remedy())),
        other => other.to_string(),
    }
}

fn decode(file: &GltfFile, image: usize) -> Result<RgbaImage, String> {
    let bytes = file.image_bytes(image).map_err(|error| cause(&error))?;
    let mut reader = ImageReader::new(Cursor::new(bytes.as_ref()))
        .with_guessed_format()
        .map_err(|error| error.to_string())?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    Ok(reader.decode().map_err(|error| error.to_string())?.into_rgba8())
}

/// One texture for each of the requests with these numbers.
fn build(
    pixels: &RgbaImage,
    requests: &[TextureRequest],
    numbers: &[usize],
    options: &LoadOptions,
) -> Vec<Option<Texture>> {
    let texels: Vec<[u8; 4]> = pixels.pixels().map(|pixel| pixel.0).collect();
    let size = [pixels.width(), pixels.height()];
    let build_one = |request: &TextureRequest| {
        let texture = Texture::from_srgb8(size, texels.clone(), request.sampling, request.mask)?;
        Some(texture.at_most(options.max_texture_side))
    };
    numbers.iter().map(|&number| requests.get(number).and_then(build_one)).collect()
}

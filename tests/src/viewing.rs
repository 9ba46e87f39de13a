//! What tests of the viewer start from: baked files, arguments, and the picture that `vlm render` makes.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Parser as _;
use vlm_bake::bake::bake;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::render::{Method, RenderOptions, Rendering, render};
use vlm_bake::scene::{LoadOptions, load};
use vlm_format::{GltfFile, Target, read_vlm, write_atomic, write_vlm};
use vlm_runtime::view::Arguments;

/// Bakes `source` into a .glb in `folder`.
///
/// # Errors
/// If it cannot be read, baked or written.
pub fn baked(source: &Path, preset: Preset, folder: &Path) -> Result<PathBuf, Box<dyn Error>> {
    let file = GltfFile::open(source)?;
    let scene = load(&file, &LoadOptions::default())?;
    let options = BakeOptions::preset(preset, scene.triangles.len());
    let asset = bake(&scene, &options, &Silent)?.asset;
    let path = folder.join("baked.vlm.glb");
    write_atomic(&write_vlm(&file, &asset, &Target::from_path(&path)?)?, folder)?;
    Ok(path)
}

/// `vlm-view FILE --headless` and flags.
///
/// # Errors
/// If the flags do not parse.
pub fn arguments(file: &Path, flags: &[&str]) -> Result<Arguments, clap::Error> {
    let file = file.to_string_lossy();
    Arguments::try_parse_from(["vlm-view", &file, "--headless"].iter().chain(flags))
}

/// `vlm render FILE`, by the camera of that name or number.
///
/// # Errors
/// If the file cannot be read or rendered.
pub fn rendered(
    file: &Path,
    camera: Option<&str>,
    [width, height]: [u32; 2],
    method: Method,
) -> Result<Rendering, Box<dyn Error>> {
    let file = GltfFile::open(file)?;
    let mut scene = load(&file, &LoadOptions::default())?;
    scene.add_defaults_for_view();
    let camera = scene.camera(camera)?;
    let options = RenderOptions { width, height, method, ..RenderOptions::default() };
    Ok(render(&scene, read_vlm(&file)?.as_ref(), &camera, &options, &Silent)?)
}

//! open: a file as everything that the viewer puts on the device; baked first where it has no lights.

use std::io::{Read, stdin};
use std::path::{Path, PathBuf};

use vlm_bake::bake::bake;
use vlm_bake::bvh::{Bvh, FlatBvh};
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Progress;
use vlm_bake::render::{triangle_tags, world_lights};
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_format::{Error, GltfFile, read_vlm};

use super::error::ViewError;
use crate::load::VlmAsset;

/// A file, ready to be shown.
pub struct Opened {
    /// The file's name, for messages.
    pub name: String,
    /// The visible scene, with a camera and a light where the file has none.
    pub scene: Scene,
    /// The virtual lights; `None` where they were not asked for.
    pub asset: Option<VlmAsset>,
    /// The lights were made just now.
    pub is_baked: bool,
    /// Tag of each of the scene's triangles, 0 for none.
    pub triangle_tags: Vec<u32>,
    /// The opaque triangles, for shadow rays on the device.
    pub blockers: FlatBvh,
    /// What was added or left out, for the user to read.
    pub notes: Vec<String>,
    /// The file and those that it refers to.
    pub files: Vec<PathBuf>,
}

/// What is asked of a file.
#[derive(Clone, Copy, Debug)]
pub struct OpenOptions {
    /// For files without lights.
    pub preset: Preset,
    /// Without lights it is a picture by direct light alone.
    pub needs_lights: bool,
}

impl Default for OpenOptions {
    fn default() -> Self {
        Self { preset: Preset::default(), needs_lights: true }
    }
}

impl Opened {
    /// Reads a file, or standard input for `-`.
    ///
    /// # Errors
    /// Where the file cannot be read or holds no scene, where its lights do not fit it, or it has none and none can be made.
    pub fn open(path: &Path, options: OpenOptions, progress: &dyn Progress) -> Result<Self, ViewError> {
        progress.begin("read", 1);
        let file = read(path)?;
        let name = file.name().to_owned();
        let mut scene = load(&file, &LoadOptions::default())?;
        let (asset, is_baked) = if options.needs_lights {
            let (asset, is_baked) = lights(&file, &scene, options.preset, progress)?;
            (Some(asset), is_baked)
        } else {
            (None, false)
        };
        let mut notes = scene.notes.clone();
        notes.extend(scene.add_defaults_for_view());
        let triangle_tags = asset.as_ref().map_or_else(Vec::new, |asset| triangle_tags(&scene, asset.data()));
        let mut files = vec![path.to_owned()];
        files.extend(file.external_files());
        Ok(Self { name, blockers: blockers(&scene), scene, asset, is_baked, triangle_tags, notes, files })
    }
}

fn read(path: &Path) -> Result<GltfFile, Error> {
    if path != Path::new("-") {
        return GltfFile::open(path);
    }
    let mut bytes = Vec::new();
    let read = stdin().lock().read_to_end(&mut bytes);
    read.map_err(|source| Error::Io { path: PathBuf::from("standard input"), action: "read", source })?;
    GltfFile::from_slice(&bytes, "standard input", None)
}

/// The file's own lights, else new ones; true for the latter.
fn lights(
    file: &GltfFile,
    scene: &Scene,
    preset: Preset,
    progress: &dyn Progress,
) -> Result<(VlmAsset, bool), ViewError> {
    let name = || file.name().to_owned();
    let (asset, is_baked) = if let Some(asset) = read_vlm(file)? {
        (asset, false)
    } else {
        let options = BakeOptions::preset(preset, scene.triangles.len());
        let baked = bake(scene, &options, progress);
        (baked.map_err(|source| ViewError::Bake { file: name(), source })?.asset, true)
    };
    // As `vlm render` refuses lights of nodes without geometry.
    world_lights(scene, &asset).map_err(|source| ViewError::Render { file: name(), source })?;
    Ok((VlmAsset::new(asset, file.world_from_nodes()), is_baked))
}

fn blockers(scene: &Scene) -> FlatBvh {
    let is_opaque = |triangle: &usize| scene.material_of(*triangle).is_none_or(|material| material.reflects);
    let opaque = (0..scene.triangles.len()).filter(is_opaque);
    let triangles: Vec<[u32; 3]> = opaque.filter_map(|t| scene.triangles.get(t).copied()).collect();
    Bvh::new(&scene.positions, &triangles).flat()
}

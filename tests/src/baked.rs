//! Scenes that are baked on the spot.

use std::path::Path;

use vlm_bake::bake::{BakeError, bake};
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_format::GltfFile;
use vlm_runtime::VlmAsset;

/// A scene with its lights.
pub struct Baked {
    /// The file's name, without folder and suffix.
    pub name: String,
    /// What is drawn.
    pub scene: Scene,
    /// What lights it indirectly.
    pub asset: VlmAsset,
}

/// Why there is none.
#[derive(Debug, thiserror::Error)]
pub enum BakedError {
    /// The file is not glTF.
    #[error(transparent)]
    Open(#[from] vlm_format::Error),
    /// It cannot be read as a scene.
    #[error(transparent)]
    Scene(#[from] vlm_bake::scene::Error),
    /// It cannot be baked.
    #[error(transparent)]
    Bake(#[from] BakeError),
}

impl Baked {
    /// Reads and bakes a glTF file.
    ///
    /// # Errors
    /// [`BakedError`].
    pub fn open(path: &Path, preset: Preset) -> Result<Self, BakedError> {
        Self::with_lights(path, preset, 0)
    }

    /// [`Baked::open`] with so many lights; 0 for the preset's own.
    ///
    /// # Errors
    /// [`BakedError`].
    pub fn with_lights(path: &Path, preset: Preset, lights: u32) -> Result<Self, BakedError> {
        let file = GltfFile::open(path)?;
        let scene = load(&file, &LoadOptions::default())?;
        let options = BakeOptions::preset(preset, scene.triangles.len());
        let lights = if lights == 0 { options.lights } else { lights };
        let options = BakeOptions { lights, ..options };
        let asset = bake(&scene, &options, &Silent)?.asset;
        let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        Ok(Self { name, scene, asset: VlmAsset::new(asset, file.world_from_nodes()) })
    }
}

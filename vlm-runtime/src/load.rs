//! load: a baked glTF file, checked, with its lights in world space.

use std::path::Path;

use glam::DMat4;
use vlm_format::{GltfFile, Grid, read_vlm};
use vlm_shaders::cpu::upload::LightSet;

use crate::error::Error;

/// The virtual lights of a glTF file.
#[derive(Clone, Debug)]
pub struct VlmAsset {
    pub(crate) asset: vlm_format::VlmAsset,
    /// At rest, by node.
    pub(crate) world_from_node: Vec<DMat4>,
    /// At rest.
    pub(crate) lights: LightSet,
}

impl VlmAsset {
    /// Reads a .glb or .gltf file with all that lies beside it.
    ///
    /// # Errors
    /// [`Error::Format`] for files that cannot be read or relied on, [`Error::Stale`] where the file no longer fits its lights,
    /// [`Error::NoLights`] where it has none.
    pub fn open(path: &Path) -> Result<Self, Error> {
        Self::from_file(&GltfFile::open(path)?)
    }

    /// Reads the bytes of a .glb or .gltf file; `name` is for messages. `folder` is where files beside it lie; without one, all data must be
    /// inside.
    ///
    /// # Errors
    /// As [`VlmAsset::open`].
    pub fn from_slice(bytes: &[u8], name: &str, folder: Option<&Path>) -> Result<Self, Error> {
        Self::from_file(&GltfFile::from_slice(bytes, name, folder)?)
    }

    /// Reads a file that is open already, as a game's own loader may have it.
    ///
    /// # Errors
    /// [`Error::Stale`], [`Error::NoLights`], or [`Error::Format`] where the extension's data breaks its rules.
    pub fn from_file(file: &GltfFile) -> Result<Self, Error> {
        let asset = read_vlm(file)?.ok_or_else(|| Error::NoLights { file: file.name().to_owned() })?;
        Ok(Self::new(asset, file.world_from_nodes()))
    }

    /// Lights that lie in memory, with the global transform of every node at rest.
    #[must_use]
    pub fn new(asset: vlm_format::VlmAsset, world_from_node: Vec<DMat4>) -> Self {
        let lights = world_lights(&asset, |node| world_from_node.get(node as usize).copied());
        Self { asset, world_from_node, lights }
    }

    /// What the file holds: for the tags of its surface ([`vlm_format::VlmAsset::tag_of`]) and the like.
    #[must_use]
    pub fn data(&self) -> &vlm_format::VlmAsset {
        &self.asset
    }

    /// The lights in world space, all nodes at rest.
    #[must_use]
    pub fn lights(&self) -> &LightSet {
        &self.lights
    }

    /// The grid, where there is one and lights enough that it pays.
    pub(crate) fn grid(&self, fewest_lights: u32) -> Option<&Grid> {
        self.asset.grid.as_ref().filter(|_| self.lights.len() >= fewest_lights as usize)
    }
}

/// The lights in world space by the transforms of their nodes; those of unknown nodes stay where they are.
pub(crate) fn world_lights(
    asset: &vlm_format::VlmAsset,
    world_from_node: impl Fn(u32) -> Option<DMat4>,
) -> LightSet {
    LightSet::new(asset, |node| world_from_node(node).unwrap_or(DMat4::IDENTITY))
}

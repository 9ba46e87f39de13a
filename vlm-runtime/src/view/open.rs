//! open: a file as everything that the viewer puts on the device; baked first where it has no lights.

use std::collections::BTreeMap;
use std::io::{Read, stdin};
use std::path::{Path, PathBuf};

use glam::Vec3;
use vlm_bake::bake::rebake;
use vlm_bake::bvh::{Bvh, FlatBvh};
use vlm_bake::memory::Memory;
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
    /// The lights by what a user would call them, each light in one group.
    pub groups: Vec<LightGroup>,
    /// Tag of each of the scene's triangles, 0 for none.
    pub triangle_tags: Vec<u32>,
    /// The opaque triangles, for shadow rays on the device.
    pub blockers: FlatBvh,
    /// What was added or left out, for the user to read.
    pub notes: Vec<String>,
    /// The file and those that it refers to.
    pub files: Vec<PathBuf>,
}

/// Lights of one node that stand for surface of one material: a wall, say.
#[derive(Clone, Debug, PartialEq)]
pub struct LightGroup {
    /// Unique within the file, and the same when it is opened again.
    pub id: String,
    /// For the user to read.
    pub name: String,
    /// Numbers of the lights, ascending.
    pub lights: Vec<u32>,
    /// Their mean albedo, linear; white for lights that only emit.
    pub albedo: Vec3,
    /// These are all lights of their node.
    pub is_whole: bool,
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
        Self::open_again(path, options, &mut Memory::default(), progress)
    }

    /// Opens as [`Opened::open`] does; where the file is baked, that goes by what `memory` holds of its last bake.
    ///
    /// # Errors
    /// As [`Opened::open`].
    pub fn open_again(
        path: &Path,
        options: OpenOptions,
        memory: &mut Memory,
        progress: &dyn Progress,
    ) -> Result<Self, ViewError> {
        progress.begin("read", 1);
        let file = read(path)?;
        let name = file.name().to_owned();
        let mut scene = load(&file, &LoadOptions::default())?;
        let (asset, is_baked) = if options.needs_lights {
            let (asset, is_baked) = lights(&file, &scene, options.preset, memory, progress)?;
            (Some(asset), is_baked)
        } else {
            (None, false)
        };
        let mut notes = scene.notes.clone();
        notes.extend(scene.add_defaults_for_view());
        let triangle_tags = asset.as_ref().map_or_else(Vec::new, |asset| triangle_tags(&scene, asset.data()));
        let mut files = vec![path.to_owned()];
        files.extend(file.external_files());
        let (bvh, opaque) = opaque_triangles(&scene);
        let groups = asset.as_ref().map_or_else(Vec::new, |asset| groups(&scene, asset, (&bvh, &opaque)));
        let blockers = bvh.flat();
        Ok(Self { name, scene, asset, is_baked, groups, triangle_tags, blockers, notes, files })
    }

    /// Images that could not be read and show as white: which, and why; empty if there are none.
    #[must_use]
    pub fn unreadable_images(&self) -> String {
        let of_images = self.scene.notes.iter().filter(|note| note.starts_with("/images/"));
        of_images.map(String::as_str).collect::<Vec<_>>().join("; ")
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
    memory: &mut Memory,
    progress: &dyn Progress,
) -> Result<(VlmAsset, bool), ViewError> {
    let name = || file.name().to_owned();
    let (asset, is_baked) = if let Some(asset) = read_vlm(file)? {
        (asset, false)
    } else {
        let options = BakeOptions::preset(preset, scene.triangles.len());
        let baked = rebake(scene, &options, memory, progress);
        (baked.map_err(|source| ViewError::Bake { file: name(), source })?.asset, true)
    };
    // As `vlm render` refuses lights of nodes without geometry.
    world_lights(scene, &asset).map_err(|source| ViewError::Render { file: name(), source })?;
    Ok((VlmAsset::new(asset, file.world_from_nodes()), is_baked))
}

/// The tree over the triangles that block light, and their numbers.
fn opaque_triangles(scene: &Scene) -> (Bvh, Vec<u32>) {
    let is_opaque =
        |triangle: &u32| scene.material_of(*triangle as usize).is_none_or(|material| material.reflects);
    let opaque: Vec<u32> = (0..scene.triangles.len() as u32).filter(is_opaque).collect();
    let triangles: Vec<[u32; 3]> =
        opaque.iter().filter_map(|t| scene.triangles.get(*t as usize).copied()).collect();
    (Bvh::new(&scene.positions, &triangles), opaque)
}

fn groups(scene: &Scene, asset: &VlmAsset, surface: (&Bvh, &[u32])) -> Vec<LightGroup> {
    let mut groups = Vec::new();
    for vlm in &asset.data().vlms {
        let object = scene.objects.iter().find(|object| object.node == vlm.node);
        let node = object.map_or(&vlm.id, |object| &object.path);
        let mut of_node: BTreeMap<&str, Vec<u32>> = BTreeMap::new();
        for light in vlm.lights[0]..vlm.lights[0].saturating_add(vlm.lights[1]) {
            let material = if vlm.authored { "authored" } else { material_of(scene, asset, light, surface) };
            of_node.entry(material).or_default().push(light);
        }
        let is_whole = of_node.len() == 1;
        groups.extend(of_node.into_iter().map(|(material, lights)| LightGroup {
            id: format!("{} {material}", vlm.id),
            name: format!("{node}: {material}"),
            albedo: mean_albedo(asset, &lights),
            lights,
            is_whole,
        }));
    }
    groups
}

fn mean_albedo(asset: &VlmAsset, lights: &[u32]) -> Vec3 {
    let albedos = lights.iter().filter_map(|light| asset.data().albedo.get(*light as usize));
    let sum: Vec3 = albedos.sum();
    if sum == Vec3::ZERO { Vec3::ONE } else { sum / lights.len() as f32 }
}

/// The material of the surface on which a light's first sample lies.
fn material_of<'a>(scene: &'a Scene, asset: &VlmAsset, light: u32, (bvh, opaque): (&Bvh, &[u32])) -> &'a str {
    let sample = asset.lights().samples_of(light as usize).first();
    let nearest = sample.and_then(|sample| bvh.closest(sample.position, f32::INFINITY, |_| true));
    let triangle = nearest.and_then(|nearest| opaque.get(nearest.triangle as usize));
    let material = triangle.and_then(|triangle| scene.material_of(*triangle as usize));
    material.map_or("no surface", |material| material.name.as_str())
}

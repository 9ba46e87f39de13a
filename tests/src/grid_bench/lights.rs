//! Lights to fill grids with.

use glam::{DVec3, Vec3};
use vlm_bake::bake::bake;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::render::world_lights;
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_format::GltfFile;
use vlm_shaders::cpu::form_factor::LightGeometry;

use super::GridBenchError;
use crate::pareto::scene;
use crate::room;

/// Name of the room made in memory.
pub const ROOM: &str = "room";

/// Lights in the forms that the two builds take.
pub struct Lights {
    /// Corners in world space, metres.
    pub corners: Vec<[DVec3; 3]>,
    /// The same.
    pub geometry: Vec<LightGeometry>,
}

impl Lights {
    fn new(corners: impl Iterator<Item = [Vec3; 3]>) -> Self {
        let corners: Vec<_> = corners.map(|corners| corners.map(|v| v.as_dvec3())).collect();
        Self { geometry: corners.iter().map(|&corners| LightGeometry::new(corners)).collect(), corners }
    }
}

/// The scene of a name; `surface` triangles for the room.
pub fn load_scene(name: &str, surface: u64) -> Result<Scene, GridBenchError> {
    let file = if name == ROOM {
        GltfFile::from_slice(&room::glb(surface), "room.glb", None)?
    } else {
        GltfFile::open(&scene::file(name).ok_or_else(|| GridBenchError::UnknownScene(name.to_owned()))?)?
    };
    Ok(load(&file, &LoadOptions::default())?)
}

/// About `count` lights of a scene. For the room, the triangles of a room of about that many: lights of about one size all
/// over the surface, which fall in radius with the square root of their number, as baked ones do. Else those of a bake with
/// that budget.
pub fn lights(name: &str, scene: &Scene, count: u32) -> Result<Lights, GridBenchError> {
    if name == ROOM {
        return Ok(Lights::new(room::corners(&room::parts(u64::from(count)))));
    }
    let options = BakeOptions { lights: count, ..BakeOptions::preset(Preset::Game, scene.triangles.len()) };
    let baked = bake(scene, &options, &Silent)
        .map_err(|error| GridBenchError::Bake { scene: name.to_owned(), error })?;
    let lights = world_lights(scene, &baked.asset)
        .map_err(|error| GridBenchError::Lights { scene: name.to_owned(), error })?;
    Ok(Lights::new(lights.geometry.iter().map(|light| light.corners())))
}

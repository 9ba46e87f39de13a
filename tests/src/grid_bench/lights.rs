//! Lights to fill grids with.

use glam::Vec3;
use vlm_bake::bake::bake;
use vlm_bake::grid::GridOptions;
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
pub fn lights(name: &str, scene: &Scene, count: u32) -> Result<Vec<LightGeometry>, GridBenchError> {
    if name == ROOM {
        let parts = room::parts(u64::from(count));
        return Ok(room::corners(&parts)
            .map(|corners| LightGeometry::new(corners.map(|v: Vec3| v.as_dvec3())))
            .collect());
    }
    let preset = BakeOptions::preset(Preset::Game, scene.triangles.len());
    let grid = GridOptions { probes: 0, ..preset.grid };
    let options = BakeOptions { lights: count, grid, ..preset };
    let baked = bake(scene, &options, &Silent)
        .map_err(|error| GridBenchError::Bake { scene: name.to_owned(), error })?;
    let lights = world_lights(scene, &baked.asset)
        .map_err(|error| GridBenchError::Lights { scene: name.to_owned(), error })?;
    Ok(lights.geometry)
}

//! Rooms parted by walls, for tests of what light passes: scenes, places in them, and their light by the grid, by every light, and in truth.

use glam::{Mat3, Vec2, Vec3};
use rayon::prelude::*;
use vlm_bake::bake::{BakeError, bake};
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::reference::irradiance_at;
use vlm_bake::render::{LitScene, RenderError};
use vlm_bake::scene::Scene;
use vlm_bake::shade::{SurfacePoint, TraceScene};
use vlm_format::VlmAsset;
use vlm_shaders::cpu::gather::{Receiver, gather};
use vlm_shaders::cpu::gather_static::Frame;

use crate::random::fibonacci_direction;
use crate::scenes::{Mesh, add, matte, point_light, quad};

/// The albedo of everything that this module builds.
pub const ALBEDO: Vec3 = Vec3::splat(0.7);

/// Bakes a scene by the preset `game` with so many lights.
///
/// # Errors
/// As [`bake`] has them.
pub fn baked(scene: &Scene, lights: u32) -> Result<VlmAsset, BakeError> {
    let preset = BakeOptions::preset(Preset::Game, scene.triangles.len());
    let options = BakeOptions { lights, ..preset };
    Ok(bake(scene, &options, &Silent)?.asset)
}

/// Adds the six sides of a room, seen from inside.
pub fn add_room(scene: &mut Scene, low: Vec3, high: Vec3, material: &vlm_bake::scene::Material) {
    let [x, y, z] = (high - low).to_array();
    let [x, y, z] = [Vec3::X * x, Vec3::Y * y, Vec3::Z * z];
    for (corner, u, v) in
        [(low, z, x), (low + y, x, z), (low, x, y), (low + z, y, x), (low, y, z), (low + x, z, y)]
    {
        add(scene, &quad(corner, u, v, 1), material.clone());
    }
}

/// The six sides of a box, seen from outside.
#[must_use]
pub fn slab(low: Vec3, high: Vec3) -> Mesh {
    let [x, y, z] = (high - low).to_array();
    let [x, y, z] = [Vec3::X * x, Vec3::Y * y, Vec3::Z * z];
    let mut all = Mesh::default();
    for (corner, u, v) in
        [(low, x, z), (low + y, z, x), (low, y, x), (low + z, x, y), (low, z, y), (low + x, y, z)]
    {
        all.append(quad(corner, u, v, 1));
    }
    all
}

/// A mesh turned about the vertical through `hinge`, counter-clockwise seen from above.
#[must_use]
pub fn turned(mut mesh: Mesh, hinge: Vec3, degrees: f32) -> Mesh {
    let rotation = Mat3::from_rotation_y(degrees.to_radians());
    mesh.positions.iter_mut().for_each(|p| *p = hinge + rotation * (*p - hinge));
    mesh.normals.iter_mut().for_each(|n| *n = rotation * *n);
    mesh
}

/// Two rooms of 4 x 3 x 4 m over one floor and under one ceiling, with a wall between them at x = 0, and a light in the left one.
#[must_use]
pub fn two_rooms(thickness: f32) -> Scene {
    let mut scene = Scene::default();
    add_room(&mut scene, Vec3::new(-4.0, 0.0, -2.0), Vec3::new(4.0, 3.0, 2.0), &matte(ALBEDO));
    let (y, z) = (3.0 * Vec3::Y, 4.0 * Vec3::Z);
    add(&mut scene, &quad(Vec3::new(-thickness / 2.0, 0.0, -2.0), z, y, 1), matte(ALBEDO));
    add(&mut scene, &quad(Vec3::new(thickness / 2.0, 0.0, -2.0), y, z, 1), matte(ALBEDO));
    scene.lights.push(point_light(Vec3::new(-2.0, 1.5, 0.0), 100.0));
    scene
}

/// A receiver in free space.
#[must_use]
pub fn receiver(position: Vec3, normal: Vec3) -> Receiver {
    Receiver { position, normal, geometric_normal: normal, tag: 0 }
}

/// `count` times `count` places of a floor at y = 0; corners are (x, z).
#[must_use]
pub fn across(low: Vec2, high: Vec2, count: u32) -> Vec<Receiver> {
    let side = |i: u32| (f64::from(i) + 0.5) as f32 / count as f32;
    let places = (0..count).flat_map(|i| (0..count).map(move |j| Vec2::new(side(i), side(j))));
    let places = places.map(|at| low + at * (high - low));
    places.map(|at| receiver(Vec3::new(at.x, 0.0, at.y), Vec3::Y)).collect()
}

/// Indirect irradiance of receivers, lx, by several methods.
#[derive(Clone, Debug, Default)]
pub struct Irradiance {
    /// By the static grid, as surface that stands still.
    pub grid: Vec<Vec3>,
    /// By the static grid, as something that moves.
    pub free: Vec<Vec3>,
    /// By every light, without occlusion.
    pub brute: Vec<Vec3>,
}

/// What receivers get; nothing by the grid where the asset has none.
///
/// # Errors
/// If the asset is not the scene's.
pub fn irradiance(
    scene: &Scene,
    asset: &VlmAsset,
    receivers: &[Receiver],
) -> Result<Irradiance, RenderError> {
    let trace = TraceScene::new(scene);
    let lit = LitScene::new(&trace, asset)?;
    let all = 0..lit.lights.len() as u32;
    let brute = |r: &Receiver| gather(&lit.lights, &lit.radiosity, all.clone(), r).irradiance;
    let brute = receivers.par_iter().map(brute).collect();
    let Some(grid) = asset.grid.as_ref() else { return Ok(Irradiance { brute, ..Irradiance::default() }) };
    let arrived = lit.arrived(&trace, grid);
    let frame = Frame { grid, lights: &lit.lights, arrived: &arrived };
    Ok(Irradiance {
        grid: receivers.par_iter().map(|r| frame.gather(r).irradiance).collect(),
        free: receivers.par_iter().map(|r| frame.gather_free(r).irradiance).collect(),
        brute,
    })
}

/// Path-traced indirect irradiance of receivers, lx. All use the same random numbers, so that neighbours differ by little noise.
#[must_use]
pub fn truth(scene: &Scene, receivers: &[Receiver], samples: u32) -> Vec<Vec3> {
    let trace = TraceScene::new(scene);
    let at = |r: &Receiver| {
        let Receiver { position, normal, geometric_normal, .. } = *r;
        let (albedo, emission) = (Vec3::ZERO, Vec3::ZERO);
        let point = SurfacePoint { triangle: 0, position, normal, geometric_normal, albedo, emission };
        irradiance_at(&trace, &point, samples, 1)
    };
    receivers.par_iter().map(at).collect()
}

/// True for places of free space: most of what they see is fronts, and nothing is closer than `room` metres.
#[must_use]
pub fn is_free(trace: &TraceScene, place: Vec3, room: f32) -> bool {
    let hits = (0..128).filter_map(|i| trace.path_hit(place, fibonacci_direction(i, 128)));
    let (fronts, all) = hits.fold((0, 0), |(f, all), hit| (f + u32::from(trace.is_lit_side(&hit)), all + 1));
    2 * fronts >= all && trace.bvh.closest(place, room, |_| true).is_none()
}

/// Mean over points and channels.
#[must_use]
pub fn mean(values: &[Vec3]) -> f32 {
    values.iter().map(|v| v.element_sum() / 3.0).sum::<f32>() / values.len().max(1) as f32
}

/// Root of the mean squared error over that of the mean squared truth.
#[must_use]
pub fn relative_rmse(found: &[Vec3], truth: &[Vec3]) -> f32 {
    let error: f32 = found.iter().zip(truth).map(|(a, b)| a.distance_squared(*b)).sum();
    (error / truth.iter().map(|b| b.length_squared()).sum::<f32>()).sqrt()
}

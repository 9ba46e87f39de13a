//! Every method proves on scenes with a known answer that it computes light, before it may appear in a comparison.
//!
//! The proof runs the whole method, from the bake on, at the setting that leaves nothing out. A method whose mean
//! irradiance misses a known answer by more than its tolerance, in any channel, is refused.

use glam::Vec3;
use vlm_bake::scene::{Camera, Material, Scene};
use vlm_bake::shade::TraceScene;

use crate::method::{Method, MethodError, Stage, View};
use crate::methods::Entry;
use crate::scenes::{Mesh, add, camera_facing, glowing, inward_sphere, matte, point_light, quad};

/// Pixels along each side of the proof's pictures.
const SIZE: u32 = 16;

/// A colour with three different channels, so that a swap shows.
const COLOUR: Vec3 = Vec3::new(1.0, 0.6, 0.3);

/// A scene whose mean indirect irradiance in the picture is known.
pub struct Known {
    /// What it shows.
    pub name: &'static str,
    /// The scene.
    pub scene: Scene,
    /// The picture.
    pub camera: Camera,
    /// Mean irradiance over the picture's pixels, lx.
    pub irradiance: Vec3,
}

/// Why a method is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// It gave an error.
    #[error("{method}: {scene}: {error}")]
    Failed {
        /// The method's name.
        method: &'static str,
        /// The scene's name.
        scene: &'static str,
        /// What went wrong.
        error: MethodError,
    },
    /// It gave another answer.
    #[error("{method}: {scene}: mean irradiance is {found} lx but should be {known} lx within {tolerance}")]
    Wrong {
        /// The method's name.
        method: &'static str,
        /// The scene's name.
        scene: &'static str,
        /// The picture's mean, lx.
        found: Vec3,
        /// The known answer, lx.
        known: Vec3,
        /// Allowed relative error.
        tolerance: f64,
    },
}

/// Checks a method of the table over all scenes.
///
/// # Errors
/// The first scene whose answer it misses.
pub fn prove(entry: &Entry) -> Result<(), Refusal> {
    prove_method(&*(entry.proof)(), entry.tolerance)
}

/// Checks one method at one setting.
///
/// # Errors
/// The first scene whose answer it misses.
pub fn prove_method(method: &dyn Method, tolerance: f64) -> Result<(), Refusal> {
    for known in known_scenes() {
        let failed = |error| Refusal::Failed { method: method.name(), scene: known.name, error };
        let found = mean_irradiance(method, &known).map_err(failed)?;
        check(method, &known, found, tolerance)?;
    }
    Ok(())
}

/// Judges what a method gave in one scene.
///
/// # Errors
/// If it is not the known answer within `tolerance`, relative, in every channel.
pub fn check(method: &dyn Method, known: &Known, found: Vec3, tolerance: f64) -> Result<(), Refusal> {
    let answer = if method.gives_indirect_light() { known.irradiance } else { Vec3::ZERO };
    // NaN fails this comparison.
    if (found - answer).abs().cmple(answer * tolerance as f32).all() {
        return Ok(());
    }
    let (method, scene) = (method.name(), known.name);
    Err(Refusal::Wrong { method, scene, found, known: answer, tolerance })
}

/// The mean over the picture of what a method gives, lx.
///
/// # Errors
/// If the method gives none.
pub fn mean_irradiance(method: &dyn Method, known: &Known) -> Result<Vec3, MethodError> {
    let trace = TraceScene::new(&known.scene);
    let stage = Stage::new(&trace);
    let view = View::new(&trace, &known.camera, (SIZE, SIZE));
    let picture = method.prepare(&stage)?.render(&view, 0)?;
    Ok(picture.indirect.iter().sum::<Vec3>() / picture.indirect.len().max(1) as f32)
}

/// The scenes; the last two are dark.
#[must_use]
pub fn known_scenes() -> [Known; 5] {
    [parallel_squares(), perpendicular_squares(), white_sphere(0.8), behind_the_emitter(), white_sphere(0.0)]
}

/// A black unit square seen from above and an emitter of radiosity [`COLOUR`].
fn lit_floor(name: &'static str, emitter: &Mesh, eye: f32, form_factor: f32) -> Known {
    let mut scene = Scene::default();
    add(&mut scene, &quad(Vec3::ZERO, Vec3::X, -Vec3::Z, 1), matte(Vec3::ZERO));
    let emission = glowing().emission * COLOUR;
    add(&mut scene, emitter, Material { emission, ..glowing() });
    let camera = camera_facing(Vec3::new(0.5, 0.0, -0.5), Vec3::Y, 0.5, eye);
    Known { name, scene, camera, irradiance: COLOUR * form_factor }
}

/// Opposed unit squares at distance 1 (Howell's catalogue, configuration C-11).
fn parallel_squares() -> Known {
    let emitter = quad(Vec3::new(0.0, 1.0, -1.0), Vec3::X, Vec3::Z, 1);
    lit_floor("parallel squares", &emitter, 5.0, 0.199_825)
}

/// Unit squares at a right angle with a common edge (Howell's catalogue, configuration C-14).
fn perpendicular_squares() -> Known {
    let emitter = quad(Vec3::new(0.0, 0.0, -1.0), Vec3::X, Vec3::Y, 1);
    lit_floor("perpendicular squares", &emitter, 5.0, 0.200_044)
}

/// The floor sees the back of the emitter.
fn behind_the_emitter() -> Known {
    let emitter = quad(Vec3::new(0.0, 1.0, 0.0), Vec3::X, -Vec3::Z, 1);
    lit_floor("behind the emitter", &emitter, 0.5, 0.0)
}

/// A closed sphere of radius 2 with a point light of 10 cd at its centre: every point receives `I / R^2`, so every
/// point sees the radiosity `albedo I / R^2` in every direction. Facets lie up to 0.4 % of the radius inside.
fn white_sphere(albedo: f32) -> Known {
    let mut scene = Scene::default();
    add(&mut scene, &inward_sphere(Vec3::ZERO, 2.0, 4), matte(albedo * COLOUR));
    scene.lights.push(point_light(Vec3::ZERO, 10.0));
    let camera = camera_facing(Vec3::new(0.0, 0.0, -2.0), Vec3::Z, 1.2, 2.5);
    let name = if albedo > 0.0 { "closed sphere" } else { "black sphere" };
    Known { name, scene, camera, irradiance: COLOUR * (albedo * 10.0 / 4.0) }
}

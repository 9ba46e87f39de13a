//! The border between two strongly different colours of one primitive stays where it is, within the decimation's error, and no light
//! mixes the two.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DVec3, Vec3};
use vlm_bake::bake::{Bake, bake};
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::scene::Scene;
use vlm_bake::surface::spread_over;
use vlm_tests::hard_meshes::checker::world_lights;
use vlm_tests::scenes::{Mesh, add, matte, quad};

const RED: Vec3 = Vec3::new(0.6, 0.05, 0.05);
const WHITE: Vec3 = Vec3::new(0.7, 0.7, 0.7);

/// The simplifier's error is a root mean square. A chord's distance from its arc, `s (1 - t^2)`, has one of `s sqrt(8/15)`.
const SAGITTA_OVER_RMS: f64 = 1.369_306_393_762_915;

/// Where the border lies at height `y`.
fn border(y: f32) -> f32 {
    0.2 * (3.0 * y).sin()
}

/// A square of 2 m, red on the left of a wavy line and white on the right: columns of vertices lean towards the line.
fn two_colours() -> Scene {
    let mut scene = Scene::default();
    let halves = [-1.0, 0.0].map(|left| quad(Vec3::new(left, -1.0, 0.0), Vec3::X, 2.0 * Vec3::Y, 40));
    let [mut mesh, right] = halves;
    let (first, corners) = (mesh.positions.len() as u32, right.positions.len());
    mesh.positions.extend(&right.positions);
    mesh.normals.extend(&right.normals);
    mesh.triangles.extend(right.triangles.iter().map(|t| t.map(|v| v + first)));
    for p in &mut mesh.positions {
        p.x += border(p.y) * (1.0 - p.x.abs());
    }
    add(&mut scene, &Mesh { ..mesh }, matte(Vec3::ONE));
    scene.vertex_colors = [vec![RED; first as usize], vec![WHITE; corners]].concat();
    scene
}

fn baked(scene: &Scene, lights: u32) -> Bake {
    let options = BakeOptions { lights, ..BakeOptions::preset(Preset::Game, scene.triangles.len()) };
    bake(scene, &options, &Silent).unwrap()
}

/// How far a point lies on the wrong side of the border for its colour, metres; negative on the right one.
fn astray(p: DVec3, red: bool) -> f64 {
    let beyond = p.x - f64::from(border(p.y as f32));
    let slope = 0.6 * (3.0 * p.y).cos();
    (if red { beyond } else { -beyond }) / slope.hypot(1.0)
}

/// The farthest that lights shifted by so much lie on the wrong side.
fn farthest(scene: &Scene, made: &Bake, shift: f64) -> f64 {
    let lights = world_lights(scene, &made.asset);
    let of_light = |(light, albedo): (&vlm_tests::hard_meshes::checker::Light, &Vec3)| {
        let red = albedo.y < 0.3;
        spread_over(light.corners, 50)
            .map(|p| astray(p + DVec3::X * shift, red))
            .fold(f64::NEG_INFINITY, f64::max)
    };
    lights.iter().zip(&made.asset.albedo).map(of_light).fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn a_wavy_border_stays_within_the_decimation_error() {
    let scene = two_colours();
    for lights in [50, 400, 3000] {
        let made = baked(&scene, lights);
        let pure = |a: &Vec3| a.distance(RED).min(a.distance(WHITE)) < 1e-3;
        assert!(made.asset.albedo.iter().all(pure), "{lights}: a light mixes the colours");
        let most = SAGITTA_OVER_RMS * made.report.decimation.error_m + made.report.clearance.required_m;
        let found = farthest(&scene, &made, 0.0);
        println!("{lights}: {found} m of {most} m");
        assert!(
            found <= most,
            "{lights}: {found} m over the border, decimation and clearance allow {most} m"
        );
        assert!(farthest(&scene, &made, 0.05 + most) > most, "the negative control");
    }
}

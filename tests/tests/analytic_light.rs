//! Scenes with a known answer, for every method that must give it.

use glam::Vec3;
use vlm_bake::progress::Silent;
use vlm_bake::render::{Method, RenderOptions, render};
use vlm_bake::scene::{Camera, Scene};
use vlm_format::VlmAsset;
use vlm_tests::metrics::{Comparison, compare};
use vlm_tests::scenes::{add, camera_facing, exact_lights, glowing, inward_sphere, matte, point_light, quad};
use vlm_tests::thesis::{self, ThesisOptions};

/// Pixels along each side of the pictures.
const SIZE: u32 = 32;

/// Directions per pixel of the reference: of these squares, one in five meets the other.
const SAMPLES: u32 = 2048;

/// Mean over pixels of the red channel's indirect irradiance.
fn mean(indirect: &[Vec3]) -> f64 {
    indirect.iter().map(|e| f64::from(e.x)).sum::<f64>() / indirect.len() as f64
}

fn indirect(scene: &Scene, asset: &VlmAsset, camera: &Camera, method: Method) -> Vec<Vec3> {
    let options = RenderOptions { width: SIZE, height: SIZE, method, samples: SAMPLES };
    render(scene, Some(asset), camera, &options, &Silent).unwrap().indirect
}

/// The picture by the reference, by every light, and by the thesis' method with a range that leaves nothing out.
fn every_method(scene: &Scene, camera: &Camera) -> Vec<(&'static str, Vec<Vec3>)> {
    let asset = exact_lights(scene);
    let unlimited = ThesisOptions { range: 1e4, list: asset.triangles.len() as u32, grid: 1 };
    let (by_thesis, grid) = thesis::render(scene, &asset, camera, (SIZE, SIZE), &unlimited, &Silent).unwrap();
    assert_eq!(grid.overflow.dropped, 0);
    vec![
        ("reference", indirect(scene, &asset, camera, Method::Reference)),
        ("brute", indirect(scene, &asset, camera, Method::Brute)),
        ("vlm", indirect(scene, &asset, camera, Method::Vlm)),
        ("thesis", by_thesis.indirect),
    ]
}

/// Within 1 %, and a picture 5 % brighter is not.
fn assert_mean(scene: &Scene, camera: &Camera, expected: f64) {
    for (method, indirect) in every_method(scene, camera) {
        let found = mean(&indirect);
        println!("{method}: {found:.6}, expected {expected:.6}");
        assert!((found / expected - 1.0).abs() < 0.01, "{method}: {found}, expected {expected}");
        let brighter: Vec<Vec3> = indirect.iter().map(|e| *e * 1.05).collect();
        assert!((mean(&brighter) / expected - 1.0).abs() > 0.01, "the check can fail");
    }
}

/// The floor's unit square, black, seen from above, with `emitter` of radiosity 1.
fn lit_floor(emitter: &vlm_tests::scenes::Mesh) -> (Scene, Camera) {
    let mut scene = Scene::default();
    add(&mut scene, &quad(Vec3::ZERO, Vec3::X, -Vec3::Z, 1), matte(Vec3::ZERO));
    let floor_faces = Vec3::X.cross(-Vec3::Z);
    assert_eq!(floor_faces, Vec3::Y);
    add(&mut scene, emitter, glowing());
    (scene, camera_facing(Vec3::new(0.5, 0.0, -0.5), Vec3::Y, 0.5, 5.0))
}

#[test]
fn parallel_unit_squares() {
    // Opposed equal squares of side a at distance c, X = a / c = 1 (Howell, configuration C-11):
    // F = 2 / (pi X^2) [ ln((1 + X^2) / sqrt(1 + 2 X^2)) + 2 X sqrt(1 + X^2) atan(X / sqrt(1 + X^2)) - 2 X atan X ].
    let (sqrt2, pi) = (2.0_f64.sqrt(), std::f64::consts::PI);
    let bracket = (2.0 / 3.0_f64.sqrt()).ln() + 2.0 * sqrt2 * (1.0 / sqrt2).atan() - 2.0 * 1.0_f64.atan();
    let expected = 2.0 / pi * bracket;
    assert!((expected - 0.199_825).abs() < 1e-6);
    let (scene, camera) = lit_floor(&quad(Vec3::new(0.0, 1.0, -1.0), Vec3::X, Vec3::Z, 1));
    assert_mean(&scene, &camera, expected);
}

#[test]
fn perpendicular_unit_squares_that_share_an_edge() {
    // Equal squares at a right angle with a common edge (Howell, configuration C-14, H = W = 1):
    // F = 1/pi [ 2 atan 1 - sqrt 2 atan(1/sqrt 2) + 1/4 ln(3/4 ...) ] with the logarithm's argument at H = W = 1:
    // (2 * 2 / 3) * (3 / (2 * 2)) * (3 / (2 * 2)) = 3/4.
    let (sqrt2, pi) = (2.0_f64.sqrt(), std::f64::consts::PI);
    let expected = (2.0 * 1.0_f64.atan() - sqrt2 * (1.0 / sqrt2).atan() + 0.25 * 0.75_f64.ln()) / pi;
    assert!((expected - 0.200_044).abs() < 1e-6);
    let (scene, camera) = lit_floor(&quad(Vec3::new(0.0, 0.0, -1.0), Vec3::X, Vec3::Y, 1));
    assert_mean(&scene, &camera, expected);
}

#[test]
fn behind_the_emitter_it_is_dark() {
    let (scene, camera) = lit_floor(&quad(Vec3::new(0.0, 1.0, 0.0), Vec3::X, -Vec3::Z, 1));
    let from_below_the_emitter = camera_facing(Vec3::new(0.5, 0.0, -0.5), Vec3::Y, 0.5, 0.5);
    assert_eq!(camera.projection, from_below_the_emitter.projection);
    for (method, indirect) in every_method(&scene, &from_below_the_emitter) {
        assert_eq!(mean(&indirect), 0.0, "{method}");
    }
}

/// A closed sphere of radius 2 with a point light of 10 cd at its centre, seen from inside.
fn lit_sphere(albedo: f32) -> (Scene, Camera) {
    let mut scene = Scene::default();
    add(&mut scene, &inward_sphere(Vec3::ZERO, 2.0, 4), matte(Vec3::splat(albedo)));
    scene.lights.push(point_light(Vec3::ZERO, 10.0));
    (scene, camera_facing(Vec3::new(0.0, 0.0, -2.0), Vec3::Z, 1.2, 2.5))
}

#[test]
fn closed_white_sphere() {
    // Every point receives I / R^2 directly, so every point sees the radiosity rho I / R^2 in every direction.
    // Facets lie up to 0.4 % of the radius inside the sphere, so that E is up to 0.8 % higher.
    let (scene, camera) = lit_sphere(0.8);
    let centroid = |t: &[u32; 3]| t.iter().map(|&i| scene.positions[i as usize]).sum::<Vec3>() / 3.0;
    let nearest = scene.triangles.iter().map(|t| centroid(t).length()).fold(f32::INFINITY, f32::min);
    assert!(nearest > 2.0 * (1.0 - 0.004), "{nearest}");
    assert_mean(&scene, &camera, 0.8 * 10.0 / 4.0);
}

#[test]
fn all_black() {
    let (scene, camera) = lit_sphere(0.0);
    for (method, indirect) in every_method(&scene, &camera) {
        assert_eq!(mean(&indirect), 0.0, "{method}");
    }
}

#[test]
fn without_occlusion_every_method_agrees_at_every_pixel() {
    let mut scene = Scene::default();
    add(&mut scene, &quad(Vec3::ZERO, Vec3::X, -Vec3::Z, 24), matte(Vec3::new(0.9, 0.5, 0.2)));
    add(&mut scene, &quad(Vec3::new(0.0, 1.0, -1.0), Vec3::X, Vec3::Z, 24), matte(Vec3::new(0.3, 0.6, 0.9)));
    scene.lights.push(point_light(Vec3::new(0.3, 0.6, -0.4), 1.0));
    let camera = camera_facing(Vec3::new(0.5, 0.0, -0.5), Vec3::Y, 0.5, 5.0);
    let pictures = every_method(&scene, &camera);
    let truth = &pictures[0].1;
    let hit = vec![true; truth.len()];
    let measure =
        |image: &[Vec3]| compare(&Comparison { width: SIZE as usize, image, truth, hit: &hit }).unwrap();
    for (method, image) in &pictures[1..] {
        let metrics = measure(image);
        println!("{method}: {metrics:?}");
        assert!(metrics.relative_rmse < 0.01, "{method}: {metrics:?}");
        let brighter: Vec<Vec3> = image.iter().map(|e| *e * 1.05).collect();
        assert!(measure(&brighter).relative_rmse > 0.01, "the check can fail");
        let swapped: Vec<Vec3> = image.iter().map(|e| Vec3::new(e.z, e.y, e.x)).collect();
        assert!(measure(&swapped).relative_rmse > 0.01, "the check can fail");
    }
}

#[test]
fn a_light_skips_receivers_of_its_tag_only() {
    let (scene, camera) = lit_floor(&quad(Vec3::new(0.0, 1.0, -1.0), Vec3::X, Vec3::Z, 1));
    let mut asset = exact_lights(&scene);
    let untagged = mean(&indirect(&scene, &asset, &camera, Method::Brute));
    asset.tags = vec![7; asset.triangles.len()];
    asset.primitive_tags = vec![(0, 0, 7)];
    assert_eq!(mean(&indirect(&scene, &asset, &camera, Method::Brute)), 0.0);
    asset.primitive_tags = vec![(0, 0, 8)];
    assert_eq!(mean(&indirect(&scene, &asset, &camera, Method::Brute)), untagged);
    assert!(untagged > 0.1);
}

//! The rivals come closer to the truth as their knobs rise, as far as their occlusion lets them; so the truth is
//! confirmed by two ways of computing light that share nothing with it but rays.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use vlm_bake::options::Preset;
use vlm_bake::scene::{LoadOptions, load};
use vlm_bake::shade::TraceScene;
use vlm_format::GltfFile;
use vlm_tests::method::{Method, Stage, View};
use vlm_tests::methods::brute::Brute;
use vlm_tests::methods::ddgi::Ddgi;
use vlm_tests::methods::instant_radiosity::InstantRadiosity;
use vlm_tests::methods::vlm::Vlm;
use vlm_tests::metrics::{Comparison, Metrics, compare};
use vlm_tests::pareto::scene;
use vlm_tests::truth::{Truth, Truths};

/// Pixels along each side.
const SIZE: u32 = 32;

fn measure(method: &dyn Method, stage: &Stage<'_>, view: &View<'_>, truth: &Truth) -> Metrics {
    let picture = method.prepare(stage).unwrap().render(view, 0).unwrap();
    let (image, truth, hit) = (&picture.indirect, &truth.irradiance, &view.hit());
    let metrics = compare(&Comparison { width: SIZE as usize, image, truth, hit }).unwrap();
    println!("{} {}: {metrics:?}", method.name(), method.knob());
    metrics
}

#[test]
fn rivals_converge_in_the_cornell_box_and_lights_without_occlusion_do_not() {
    let bytes = std::fs::read(scene::file("cornell").unwrap()).unwrap();
    let file = GltfFile::from_slice(&bytes, "cornell", None).unwrap();
    let scene = load(&file, &LoadOptions::default()).unwrap();
    let trace = TraceScene::new(&scene);
    let stage = Stage::new(&trace);
    let view = View::new(&trace, &scene.cameras[0], (SIZE, SIZE));
    let cache = tempfile::tempdir().unwrap();
    let truth = Truths::new(cache.path(), &bytes).unwrap().truth(&view, 2048).unwrap();
    assert!(truth.noise < 0.015, "{}", truth.noise);
    let errors = |methods: &[&dyn Method]| -> Vec<f64> {
        methods.iter().map(|m| measure(*m, &stage, &view, &truth).relative_rmse).collect()
    };

    let point_lights =
        [(64, 0.1), (1024, 0.03), (16384, 0.01)].map(|(lights, clamp)| InstantRadiosity { lights, clamp });
    let by_lights = errors(&point_lights.each_ref().map(|m| m as &dyn Method));
    assert!(by_lights[1] < 0.5 * by_lights[0] && by_lights[2] < 0.6 * by_lights[1], "{by_lights:?}");
    assert!(by_lights[2] < 0.06, "{by_lights:?}");

    let probes = [(6.0, 64), (12.0, 256), (24.0, 256)].map(|(cells, rays)| Ddgi { cells, rays });
    let by_probes = errors(&probes.each_ref().map(|m| m as &dyn Method));
    assert!(by_probes[1] < by_probes[0] && by_probes[2] < by_probes[1], "{by_probes:?}");
    assert!(by_probes[2] < 0.09, "{by_probes:?}");

    let by_grid = errors(&[&Vlm { preset: Preset::Game, lights: 460, probes: 1.0 }]);
    assert!(by_grid[0] < 0.09, "{by_grid:?}");

    let unoccluded = [460, 1840].map(|lights| Brute { lights });
    let by_area_lights = errors(&unoccluded.each_ref().map(|m| m as &dyn Method));
    assert!(
        by_area_lights.iter().all(|error| *error > 0.14),
        "the bounds above can fail: {by_area_lights:?}"
    );
}

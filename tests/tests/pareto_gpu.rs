//! The methods of the comparison on the graphics card: they compute light, and the thesis' is that of the processor.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;

use glam::Vec3;
use vlm_bake::options::Preset;
use vlm_bake::scene::{LoadOptions, load};
use vlm_bake::shade::TraceScene;
use vlm_format::GltfFile;
use vlm_tests::method::{Backend, Method, Stage, View};
use vlm_tests::methods::area_lights::AreaLights;
use vlm_tests::methods::gpu::thesis::{GpuLists, on_gpu};
use vlm_tests::methods::thesis::{self, Thesis};
use vlm_tests::methods::{Entry, all};
use vlm_tests::proof::prove;
use vlm_tests::rooms::{mean, relative_rmse};
use vlm_tests::thesis::{ThesisGrid, ThesisOptions};

const OPTIONS: ThesisOptions = ThesisOptions { range: 4.5, list: 64, grid: 16 };
const NULL: u32 = u32::MAX;

/// Calls `test` with Cornell's box.
fn in_cornell(test: impl FnOnce(&Stage<'_>)) {
    let file = GltfFile::open(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/cornell.glb")).unwrap();
    let scene = load(&file, &LoadOptions::default()).unwrap();
    let trace = TraceScene::new(&scene);
    test(&Stage::new(&trace));
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn all_methods_prove_that_they_compute_light() {
    for entry in all(Backend::Gpu) {
        prove(entry).unwrap();
    }
    let wrong = Entry { proof: || on_gpu(short()), ..thesis::ENTRY };
    assert!(prove(&wrong).is_err(), "the negative control: lists that lose light");
}

/// Lights that reach next to nothing.
fn short() -> Thesis {
    Thesis { lights: 400, options: ThesisOptions { range: 0.5, ..OPTIONS } }
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn the_thesis_lists_are_those_of_the_processor() {
    in_cornell(|stage| {
        let lights = AreaLights::new(stage, stage.baked(&stage.without_grid(Preset::Game, 460)).unwrap());
        let lights = lights.unwrap();
        let (low, high) = stage.bounds();
        let expected = ThesisGrid::build(&lights.world.geometry, low, high, &OPTIONS);
        let found = GpuLists::new(&lights, (low, high), &OPTIONS).unwrap().read().unwrap();
        let until_end = |ids: &[u32]| ids.iter().copied().take_while(|&id| id != NULL).collect::<Vec<_>>();
        let lists = found.chunks_exact(OPTIONS.list as usize).map(until_end);
        let same =
            lists.enumerate().filter(|(cell, ids)| ids.iter().copied().eq(expected.list_of(*cell as u32)));
        let same = same.count() as f64 / expected.cells() as f64;
        println!("{:.2} % of the lists are equal", 100.0 * same);
        assert!(same > 0.99 && expected.entries() > 10_000, "{same}");
        let other =
            ThesisGrid::build(&lights.world.geometry, low, high, &ThesisOptions { range: 4.0, ..OPTIONS });
        let differs = (0..other.cells() as u32).any(|cell| !other.list_of(cell).eq(expected.list_of(cell)));
        assert!(differs, "the negative control");
    });
}

#[test]
#[cfg_attr(not(has_vulkan), ignore = "no Vulkan driver")]
fn the_thesis_picture_is_that_of_the_processor() {
    in_cornell(|stage| {
        let camera = &stage.trace.scene.cameras_or_default()[0];
        let view = View::new(stage.trace, camera, (48, 48));
        let picture = |method: &dyn Method| method.prepare(stage).unwrap().render(&view, 0).unwrap();
        let thesis = || Thesis { lights: 460, options: OPTIONS };
        let expected = picture(&thesis());
        let found = picture(&*on_gpu(thesis()));
        let error = relative_rmse(&found.indirect, &expected.indirect);
        println!("relative RMSE {error}, {} pairs, {} on the processor", found.pairs, expected.pairs);
        assert!(error < 0.01 && mean(&expected.indirect) > 0.0, "{error}");
        assert!((found.pairs as f64 / expected.pairs as f64 - 1.0).abs() < 1e-3);
        let dark = vec![Vec3::ZERO; expected.indirect.len()];
        assert!(relative_rmse(&dark, &expected.indirect) > 0.9, "the negative control");
    });
}

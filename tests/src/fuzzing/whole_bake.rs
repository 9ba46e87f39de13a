//! Target: what opens as a scene bakes or is refused, and what was baked is written, read again and valid.

use vlm_bake::bake::{Bake, BakeError, bake};
use vlm_bake::grid::GridOptions;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::scene::{LoadOptions, Scene, load};
use vlm_format::{Container, GltfFile, Target, read_vlm, validate, write_vlm};

use super::Reached;

/// Scenes with more triangles are not baked: each takes longer, and none finds more.
const MOST_TRIANGLES: usize = 300;

/// Likewise of vertices, instances counted.
const MOST_VERTICES: usize = 3_000;

/// Likewise of authored triangles.
const MOST_AUTHORED: usize = 100;

/// Bakes a file as roughly as can be, writes the result and reads it.
///
/// # Panics
/// Where the library panics, or where what it baked is not valid or not what it reads.
pub fn whole_bake(bytes: &[u8]) -> Reached {
    let Ok(file) = GltfFile::from_slice(bytes, "fuzzed", None) else { return Reached::Refused };
    let options = LoadOptions { max_vertices: MOST_VERTICES, max_texture_side: 64, ..LoadOptions::default() };
    let Some(scene) = load(&file, &options).ok().filter(is_small) else { return Reached::Opened };
    match bake(&scene, &rough(&scene), &Silent) {
        Ok(baked) => assert_whole(&file, &baked),
        Err(BakeError::NothingReflects | BakeError::NothingLeft { .. }) => return Reached::Opened,
        Err(error) => panic!("nobody cancelled: {error}"),
    }
    Reached::Done
}

fn is_small(scene: &Scene) -> bool {
    let authored: usize = scene.authored.iter().map(|mesh| mesh.triangles.len()).sum();
    scene.triangles.len() <= MOST_TRIANGLES && authored <= MOST_AUTHORED && scene.volumes.len() <= 2
}

/// A bake of a few hundredths of a second.
fn rough(scene: &Scene) -> BakeOptions {
    let draft = BakeOptions::preset(Preset::Draft, scene.triangles.len());
    BakeOptions {
        lights: 50,
        least_points: 1_000,
        grid: GridOptions { probes: 30, rays: 32, near: 4, least_places: 300, ..draft.grid },
        ..draft
    }
}

fn assert_whole(file: &GltfFile, baked: &Bake) {
    let issues = validate(&baked.asset);
    assert!(issues.is_empty(), "{}", issues[0]);
    let report = serde_json::to_value(&baked.report).unwrap_or_default();
    let numbers: Vec<String> = super::json::places(&report);
    for pointer in numbers {
        assert!(
            report.pointer(&pointer) != Some(&serde_json::Value::Null),
            "{pointer} of the report is no number"
        );
    }
    let target = Target { container: Container::Glb, file_name: String::from("out.glb") };
    let outputs = write_vlm(file, &baked.asset, &target).unwrap_or_else(|error| panic!("{error}"));
    let written = GltfFile::from_slice(&outputs[0].bytes, "written", None);
    let written = written.unwrap_or_else(|error| panic!("what was written does not open: {error}"));
    let read = read_vlm(&written).unwrap_or_else(|error| panic!("{error}"));
    assert!(read.as_ref() == Some(&baked.asset), "what is read differs from what was written");
}

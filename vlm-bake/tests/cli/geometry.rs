//! `vlm check --geometry SOURCE FILE`: does the Virtual Light Mesh still lie behind the surface of its source?

use std::path::Path;
use std::process::Output;

use vlm_format::{GltfFile, Target, VlmAsset, read_vlm, write_vlm};

use crate::support::{Folders, repository, run, text};

/// Bakes Cornell; returns the paths of source and bake.
fn baked(folders: &Folders) -> (String, String) {
    let (source, file) = (repository("assets/cornell.glb"), folders.output("baked.glb"));
    let baked = run(["bake", &source, "-o", &file, "--lights", "300"]);
    assert!(baked.status.success(), "{}", text(&baked.stderr));
    (source, file)
}

/// A copy of the bake with one light moved along its normal by so many metres, and the digests made anew.
fn with_light_moved(folders: &Folders, baked: &str, light: u32, by: f32) -> String {
    let file = GltfFile::open(Path::new(baked)).unwrap();
    let mut asset = read_vlm(&file).unwrap().unwrap();
    let corners = asset.triangles[light as usize].map(|v| asset.positions[v as usize]);
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
    // It gets vertices of its own, at the end of its VLM's, so that its neighbours stay.
    let owner = owner_of(&asset, light);
    let end = asset.vlms[owner].vertices[0] + asset.vlms[owner].vertices[1];
    asset.triangles.iter_mut().flatten().filter(|v| **v >= end).for_each(|v| *v += 3);
    asset.vlms[owner].vertices[1] += 3;
    asset.vlms[owner + 1..].iter_mut().for_each(|vlm| vlm.vertices[0] += 3);
    asset.positions.splice(end as usize..end as usize, corners.map(|p| p + by * normal));
    asset.triangles[light as usize] = [end, end + 1, end + 2];
    let path = folders.output("moved.glb");
    let written = write_vlm(&file, &asset, &Target::from_path(Path::new(&path)).unwrap()).unwrap();
    std::fs::write(&path, &written[0].bytes).unwrap();
    path
}

/// The number of the VLM that holds a light.
fn owner_of(asset: &VlmAsset, light: u32) -> usize {
    asset.vlms.iter().position(|vlm| (vlm.lights[0]..vlm.lights[0] + vlm.lights[1]).contains(&light)).unwrap()
}

fn check(source: &str, file: &str) -> Output {
    run(["check", "--geometry", source, file])
}

#[test]
fn a_fresh_bake_passes() {
    let folders = Folders::new();
    let (source, file) = baked(&folders);
    let checked = check(&source, &file);
    assert_eq!(checked.status.code(), Some(0), "{}", text(&checked.stderr));
}

#[test]
fn a_moved_light_is_named_with_its_object_and_its_distance() {
    let folders = Folders::new();
    let (source, file) = baked(&folders);
    let moved = with_light_moved(&folders, &file, 7, 0.05);
    // Valid by its digests: only the geometry tells.
    assert_eq!(run(["check", &moved]).status.code(), Some(0));
    let checked = check(&source, &moved);
    assert_eq!(checked.status.code(), Some(1));
    let said = format!("{}{}", text(&checked.stdout), text(&checked.stderr));
    let asset = read_vlm(&GltfFile::open(Path::new(&moved)).unwrap()).unwrap().unwrap();
    let object = asset.vlms[owner_of(&asset, 7)].id.split('#').next().unwrap().to_owned();
    assert!(said.contains("light 7"), "{said}");
    assert!(said.contains(&object), "{object}: {said}");
    assert!(millimetres(&said).iter().any(|&mm| (0.01..=60.0).contains(&mm)), "{said}");
}

/// The numbers that stand before `mm`.
fn millimetres(said: &str) -> Vec<f64> {
    let before = said.split("mm").map(|part| part.trim_end().rsplit([' ', '(']).next().unwrap_or_default());
    before.filter_map(|word| word.parse().ok()).collect()
}

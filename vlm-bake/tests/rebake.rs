//! A bake that remembers the last one makes the bytes that a fresh bake makes, and does again only what changed.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DMat4, DVec3, Vec3};
use vlm_bake::bake::{bake, rebake};
use vlm_bake::memory::Memory;
use vlm_bake::options::{BakeOptions, Preset};
use vlm_bake::progress::Silent;
use vlm_bake::report::Report;
use vlm_bake::scene::{AuthoredMesh, LoadOptions, Scene, load};
use vlm_format::GltfFile;

fn cornell() -> Scene {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/cornell.glb");
    load(&GltfFile::open(path.as_ref()).unwrap(), &LoadOptions::default()).unwrap()
}

fn small() -> BakeOptions {
    let mut options = BakeOptions { lights: 100, ..BakeOptions::preset(Preset::Draft, 0) };
    (options.grid.probes, options.grid.rays, options.grid.near) = (150, 64, 4);
    options
}

/// An edit, and the stages that need not run after it.
type Edit = (&'static str, fn(&mut Scene, &mut BakeOptions), &'static [&'static str]);

const ALL: &[&str] = &["decimate", "mend", "grid"];
const LIGHTS: &[&str] = &["decimate", "mend"];
const NONE: &[&str] = &[];

fn moved(scene: &mut Scene, by: Vec3) {
    let [first, count] = scene.primitives[0].triangles;
    let triangles = &scene.triangles[first as usize..(first + count) as usize];
    let vertices: std::collections::BTreeSet<u32> = triangles.iter().flatten().copied().collect();
    vertices.into_iter().for_each(|v| scene.positions[v as usize] += by);
}

const EDITS: &[Edit] = &[
    ("nothing", |_, _| {}, ALL),
    ("a colour", |scene, _| scene.materials[0].base_color = Vec3::new(0.2, 0.9, 0.4), ALL),
    ("a painted colour", |scene, _| scene.vertex_colors.iter_mut().for_each(|c| *c *= 0.5), ALL),
    ("a tint", |scene, _| scene.objects[0].steering.tint = Vec3::new(3.0, 0.0, 1.0), ALL),
    ("a camera", |scene, _| scene.cameras.clear(), ALL),
    ("samples", |_, options| options.samples += 2, NONE),
    ("a lamp", |scene, _| scene.lights[0].position.x += 0.1, LIGHTS),
    ("probes", |_, options| options.grid.probes += 50, LIGHTS),
    ("cells", |_, options| options.grid.cell_size = Some(0.3), LIGHTS),
    ("an artist's tag", |scene, _| scene.objects[0].steering.tag = Some(7), LIGHTS),
    ("a volume", |scene, _| scene.volumes.push([DVec3::splat(0.2), DVec3::splat(0.8)]), LIGHTS),
    (
        "normals",
        |scene, _| {
            scene.vertex_normals.iter_mut().for_each(|n| *n = (*n + 0.1 * Vec3::X).normalize_or_zero());
        },
        LIGHTS,
    ),
    ("a place", |scene, _| moved(scene, Vec3::new(0.0, 0.01, 0.0)), NONE),
    (
        "a node's space",
        |scene, _| scene.objects[0].world_from_node *= DMat4::from_scale(DVec3::splat(1.1)),
        NONE,
    ),
    ("a density", |scene, _| scene.objects[1].steering.density = 5.0, NONE),
    ("an exclusion", |scene, _| scene.objects[0].steering.exclude = true, NONE),
    ("two sides", |scene, _| scene.materials[0].two_sided ^= true, NONE),
    ("glass", |scene, _| scene.materials[0].reflects = false, NONE),
    ("black", |scene, _| scene.materials[0].base_color = Vec3::ZERO, NONE),
    ("a lamp's panel", |scene, _| scene.materials[0].emission = Vec3::ONE, &["decimate", "mend", "grid"]),
    ("an authored light", |scene, _| scene.authored.push(panel()), NONE),
    ("lights", |_, options| options.lights += 20, NONE),
];

fn panel() -> AuthoredMesh {
    AuthoredMesh {
        positions: vec![Vec3::new(0.3, 0.5, 0.3), Vec3::new(0.6, 0.5, 0.3), Vec3::new(0.3, 0.5, 0.6)],
        triangles: vec![[0, 1, 2]],
        albedo: Some(vec![Vec3::splat(0.5)]),
        emission: vec![Vec3::ONE],
        ..AuthoredMesh::default()
    }
}

/// One test for all, since a bake takes long.
#[test]
fn only_what_changed_is_made_again_and_to_the_same_bytes() {
    let mut memory = Memory::default();
    let before = rebake(&cornell(), &small(), &mut memory, &Silent).unwrap();
    assert_eq!(before.report.reused, NONE);
    for (name, edit, unchanged) in EDITS {
        let (mut scene, mut options) = (cornell(), small());
        rebake(&scene, &options, &mut memory, &Silent).unwrap();
        edit(&mut scene, &mut options);
        let again = rebake(&scene, &options, &mut memory, &Silent).unwrap();
        let fresh = bake(&scene, &options, &Silent).unwrap();

        assert!(again.asset == fresh.asset, "{name}: the asset differs from that of a fresh bake");
        assert_eq!(timeless(&again.report), timeless(&fresh.report), "{name}");
        assert_eq!(again.report.reused, *unchanged, "{name}");
        for stage in *unchanged {
            assert!(!again.report.seconds.contains_key(stage), "{name}: {stage} ran all the same");
        }
        let shows = !["nothing", "a camera"].contains(name);
        assert_eq!(again.asset != before.asset, shows, "{name}: does the edit show?");
    }
}

fn timeless(report: &Report) -> Report {
    Report { seconds: Default::default(), reused: Vec::new(), ..report.clone() }
}

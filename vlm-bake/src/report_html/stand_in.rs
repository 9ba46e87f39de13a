//! Checks an asset by today's stages, in the shape of the verification that the page is written against.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use vlm_format::VlmAsset;
use vlm_shaders::cpu::form_factor::{LightGeometry, form_factor};

use super::facts::regions_of_lights;
use super::lights::WorldLights;
use super::tagged::SurfaceTags;
use crate::bvh::Bvh;
use crate::clearance::{required_clearance, self_lighting};
use crate::decimate::{Face, LightMesh};
use crate::patches::{Patches, patches};
use crate::scene::Scene;
use crate::surface::{Standing, SurfacePoint, spread_points, stand_ins};

/// The least number of surface points.
const LEAST_POINTS: usize = 200_000;

/// Points at which light is summed.
const SELF_LIGHT_POINTS: usize = 1000;

/// A face stands for surface at most this share of the scene's extent away.
const REACH_SHARE: f64 = 0.02;

/// What the check of an asset found.
pub struct Verification {
    /// Area-uniform over the visible surface.
    pub points: Vec<SurfacePoint>,
    /// The light that stands for each point.
    pub light_of_point: Vec<Option<u32>>,
    /// One per failing light, tagged or not.
    pub findings: Vec<Finding>,
    /// Required clearance, metres.
    pub required_m: f64,
    /// The light that surface receives from its own region.
    pub self_light: SelfLight,
    /// The visible surface; [`SurfacePoint::triangle`] indexes its triangles.
    pub patches: Patches,
}

/// The irradiance that surface receives from lights of its own region where every light has unit radiosity, over the scene's mean;
/// tags are honoured.
#[derive(Clone, Copy, Debug, Default)]
pub struct SelfLight {
    /// What all but a thousandth of the points stay below.
    pub p999: f64,
    /// Greatest.
    pub max: f64,
}

/// What is wrong with a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FindingKind {
    /// It lights the surface that it stands for.
    LightsItself,
    /// It comes out on another side.
    PokesOut,
    /// Nothing lies behind its surface.
    TooThin,
}

/// A failing light.
pub struct Finding {
    /// The light.
    pub light: u32,
    /// What is wrong.
    pub kind: FindingKind,
    /// Surface points that it lights.
    pub points: u32,
    /// By how much it would have to move, metres.
    pub depth_m: f64,
    /// Where it is worst, world space.
    pub place: DVec3,
    /// Unit normal of the surface there.
    pub normal: DVec3,
    /// Node path.
    pub object: String,
    /// A tag keeps its light away.
    pub tagged: bool,
}

/// Checks what the file will hold.
pub fn verify_asset(scene: &Scene, asset: &VlmAsset) -> Verification {
    let surfaces = scene.triangle_surfaces();
    let patches = patches(scene, &surfaces, asset.settings.lights);
    let bounds = scene.bounds().unwrap_or_default();
    let required_m = required_clearance(bounds);
    let lights = WorldLights::new(scene, asset);
    let points = spread_points(&patches, LEAST_POINTS.max(20 * asset.triangles.len()));
    let (mesh, numbers) = light_mesh(scene, asset, &lights, &patches);
    let reach = REACH_SHARE * (bounds[1] - bounds[0]).max_element();
    let faces = stand_ins(&points, &patches, &mesh, reach);
    let light_of_point: Vec<Option<u32>> =
        faces.iter().map(|face| face.map(|f| numbers[f as usize])).collect();
    let tags = SurfaceTags::new(scene, asset);
    let standing = Standing::new(&light_of_point, asset.triangles.len());
    let judge = |light: usize| {
        let tag = asset.tags.get(light).copied().unwrap_or(0);
        finding(scene, &lights, &patches, &points, &standing, required_m, light, |source| {
            tag != 0 && tags.of(source) == tag
        })
    };
    let findings = (0..asset.triangles.len()).into_par_iter().filter_map(judge).collect();
    let self_light = self_light(&lights, asset, &patches, &points, &light_of_point, &tags);
    Verification { points, light_of_point, findings, required_m, self_light, patches }
}

fn self_light(
    lights: &WorldLights,
    asset: &VlmAsset,
    patches: &Patches,
    points: &[SurfacePoint],
    light_of_point: &[Option<u32>],
    tags: &SurfaceTags,
) -> SelfLight {
    let geometry: Vec<LightGeometry> = lights.corners.iter().map(|c| LightGeometry::new(*c)).collect();
    let regions = regions_of_lights(patches, points, light_of_point, geometry.len());
    let every = points.len().div_ceil(SELF_LIGHT_POINTS).max(1);
    let received: Vec<[f64; 2]> = points
        .par_iter()
        .step_by(every)
        .map(|p| {
            let region = Some(patches.triangle_region[p.triangle as usize]);
            let tag = tags.of(patches.triangle_source[p.triangle as usize]);
            let (x, n) = (p.position.as_vec3(), p.normal.as_vec3());
            geometry.iter().enumerate().fold([0.0, 0.0], |[own, all], (l, light)| {
                let ignored = tag != 0 && asset.tags.get(l) == Some(&tag);
                let f = if ignored { 0.0 } else { f64::from(form_factor(light, x, n)) };
                [own + if regions[l] == region { f } else { 0.0 }, all + f]
            })
        })
        .collect();
    let mean = received.iter().map(|r| r[1]).sum::<f64>() / received.len().max(1) as f64;
    let mut own: Vec<f64> = received.iter().map(|r| r[0] / mean.max(f64::MIN_POSITIVE)).collect();
    own.sort_unstable_by(f64::total_cmp);
    let at = |i: usize| own.get(i).copied().unwrap_or(0.0);
    SelfLight { p999: at(own.len() * 999 / 1000), max: at(own.len().saturating_sub(1)) }
}

#[expect(clippy::too_many_arguments, reason = "a stand-in")]
fn finding(
    scene: &Scene,
    lights: &WorldLights,
    patches: &Patches,
    points: &[SurfacePoint],
    standing: &Standing,
    required_m: f64,
    light: usize,
    ignores: impl Fn(u32) -> bool,
) -> Option<Finding> {
    let mut found: Option<Finding> = None;
    for &p in standing.of(light) {
        let point = &points[p as usize];
        let depth_m = self_lighting(&lights.corners[light], lights.normals[light], point, required_m);
        if depth_m <= 1e-3 * required_m {
            continue;
        }
        let region = patches.region(point.triangle as usize);
        let kind = if region.two_sided { FindingKind::TooThin } else { FindingKind::LightsItself };
        let tagged = ignores(patches.triangle_source[point.triangle as usize]);
        let finding = found.get_or_insert_with(|| Finding {
            light: light as u32,
            kind,
            points: 0,
            depth_m: 0.0,
            place: point.position,
            normal: point.normal,
            object: scene.objects[scene.primitives[region.primitive as usize].object as usize].path.clone(),
            tagged: true,
        });
        finding.points += 1;
        finding.tagged &= tagged;
        if depth_m > finding.depth_m {
            (finding.depth_m, finding.place, finding.normal) = (depth_m, point.position, point.normal);
        }
    }
    found
}

/// The lights as faces of regions, and the light of each face: a light's region is that of its first sample.
fn light_mesh(
    scene: &Scene,
    asset: &VlmAsset,
    lights: &WorldLights,
    patches: &Patches,
) -> (LightMesh, Vec<u32>) {
    let positions: Vec<Vec3> = patches.positions.iter().map(|p| p.as_vec3()).collect();
    let bvh = Bvh::new(&positions, &patches.triangles);
    let (mut mesh, mut numbers) = (LightMesh::default(), Vec::new());
    for (l, corners) in lights.corners.iter().enumerate() {
        let world = lights.objects[l].map(|o| scene.objects[o as usize].world_from_node).unwrap_or_default();
        let first = asset.sample_starts[l] as usize..asset.sample_starts[l + 1] as usize;
        let sample = asset.samples.get(first).and_then(<[_]>::first);
        let centre = corners.iter().sum::<DVec3>() / 3.0;
        let place = sample.map_or(centre, |s| world.transform_point3(s.position.as_dvec3()));
        let cosine = |t: u32| crate::topology::cross_of(patches.corners(t as usize)).dot(lights.normals[l]);
        let own = |t: u32| lights.objects[l] == Some(object_of(scene, patches, t));
        let alike = |t: u32| own(t) && (cosine(t) > 0.0 || patches.region(t as usize).two_sided);
        let Some(near) = bvh.closest(place.as_vec3(), f32::INFINITY, alike) else { continue };
        let start = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.faces.push(Face {
            vertices: [start, start + 1, start + 2],
            region: patches.triangle_region[near.triangle as usize],
            back: cosine(near.triangle) < 0.0,
        });
        numbers.push(l as u32);
    }
    (mesh, numbers)
}

fn object_of(scene: &Scene, patches: &Patches, triangle: u32) -> u32 {
    scene.primitives[patches.region(triangle as usize).primitive as usize].object
}

//! Stage 7: proves that no light lights the surface for which it stands, and that none comes out on another side of its object.
//! `docs/behind-the-geometry.md` has the definition in words.
//!
//! [`mod@judge`] says what is wrong with a light; the baker uses it to mend and tag. [`verify_asset`] checks a finished asset
//! against a scene, from nothing but what the file holds.

pub mod judge;
mod self_light;

use glam::{DMat4, DVec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use schemars::JsonSchema;
use serde::Serialize;
use vlm_format::VlmAsset;
use vlm_shaders::cpu::upload::world_corners;

use crate::bvh::Bvh;
use crate::correspondence::{Correspondence, Light, points_of_lights};
use crate::ground::Ground;
use crate::patches::{Patches, patches};
use crate::render::triangle_tags;
use crate::scene::Scene;
use crate::slivers::MAX_ASPECT;
use crate::surface::SurfacePoint;
use crate::topology::{aspect_ratio, cross_of};

use judge::{Evidence, Violation, judge};
pub use self_light::{SelfLight, self_light};

/// A light belongs to surface that looks its way by this cosine.
const LEAST_COSINE: f64 = 0.5;

/// A sample's normal equals its surface's to this cosine: single precision, turned into the node's space and back.
const SAME_COSINE: f64 = 1.0 - 1e-6;

/// The result of the check of an asset.
#[derive(Clone, Debug, Default)]
pub struct Verification {
    /// Area-uniform points of the visible surface (at least 200,000, at least 20 per light), its vertices and edge midpoints, and the
    /// lights' own samples. Those last three have no area.
    pub points: Vec<SurfacePoint>,
    /// The light that stands for each point.
    pub light_of_point: Vec<Option<u32>>,
    /// One for each light that fails, tagged or not, ascending by light.
    pub findings: Vec<Finding>,
    /// The clearance asked for, metres.
    pub required_m: f64,
    /// The visible surface; [`SurfacePoint::triangle`] counts its triangles.
    pub patches: Patches,
    /// The light that the surface gets from its own lights.
    pub self_light: SelfLight,
    /// The asset's lights, world space.
    pub lights: Vec<Light>,
}

/// What a light does wrong.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FindingKind {
    /// It lights points of the surface for which it stands, or comes nearer to that than the clearance.
    #[default]
    LightsItself,
    /// It comes out of its object: on another side, or in front of its own.
    PokesOut,
    /// It is longer than 100 times its height: single precision cannot hold its form factor.
    TooThin,
}

/// A light that fails.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Finding {
    /// Number of the light in the asset.
    pub light: u32,
    /// What it does wrong; the first of two.
    pub kind: FindingKind,
    /// Number of surface points that it lights.
    pub points: u32,
    /// By how much it would have to move, metres.
    pub depth_m: f64,
    /// Where it is worst, world space.
    pub place: DVec3,
    /// The light's normal.
    pub normal: DVec3,
    /// Node path of its object.
    pub object: String,
    /// The triangles of the patches that it must not light, ascending.
    pub triangles: Vec<u32>,
    /// Tags keep it away from all that it would light wrongly, so nothing is seen of it.
    pub tagged: bool,
}

/// The result of the check, as the report shows it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct ClearanceReport {
    /// Surface points checked.
    pub samples: u64,
    /// Surface points lit by their own light, and lights that come out or are too thin, where no tag keeps that light away.
    pub violations: u64,
    /// The greatest distance by which a violating light would have to move, metres.
    pub worst_m: f64,
    /// The clearance asked for, metres.
    pub required_m: f64,
    /// Light that the surface gets from its own lights.
    pub self_light: SelfLight,
}

impl Verification {
    /// Looks anew at what the tags of the same asset keep dark.
    pub fn honour_tags(&mut self, scene: &Scene, asset: &VlmAsset, patches: &Patches) {
        let tags = ReceiverTags::new(scene, asset, patches);
        for finding in &mut self.findings {
            finding.tagged = finding.kind != FindingKind::TooThin
                && finding.triangles.iter().all(|&triangle| tags.ignores(triangle, finding.light));
        }
        let ignores = |point: &SurfacePoint, light: u32| tags.ignores(point.triangle, light);
        self.self_light = self_light(&self.lights, &self.points, &self.light_of_point, ignores);
    }

    /// The lights that fail and that no tag mends.
    pub fn untagged(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| !finding.tagged)
    }

    /// The check in figures.
    #[must_use]
    pub fn report(&self) -> ClearanceReport {
        let count = |f: &Finding| u64::from(f.points) + u64::from(f.kind != FindingKind::LightsItself);
        ClearanceReport {
            samples: self.points.len() as u64,
            violations: self.untagged().map(count).sum(),
            worst_m: self.untagged().map(|f| f.depth_m).fold(0.0, f64::max),
            required_m: self.required_m,
            self_light: self.self_light,
        }
    }
}

/// Checks an asset against the scene that it lights.
///
/// The surface is grouped into regions as the bake did, by the budget in [`vlm_format::Settings::lights`]; a light's region is that of
/// the surface on which its first sample lies.
#[must_use]
pub fn verify_asset(scene: &Scene, asset: &VlmAsset) -> Verification {
    let patches = patches(scene, &scene.triangle_surfaces(), asset.settings.lights);
    let ground = Ground::new(scene, &patches);
    let mut verification = check(scene, asset, &ground, ground.points(asset.settings.lights as usize));
    verification.patches = patches;
    verification
}

/// The same on a surface that is prepared already, at the [`Ground::points`] of the asset's budget; [`Verification::patches`] stays empty.
#[must_use]
pub fn check(
    scene: &Scene,
    asset: &VlmAsset,
    ground: &Ground,
    mut points: Vec<SurfacePoint>,
) -> Verification {
    let placed = placed_lights(scene, asset, ground);
    let lights: Vec<Light> = placed.iter().map(|p| p.light).collect();
    let derived = |l: usize| !placed[l].authored && placed[l].stands;
    let mut light_of_point = Correspondence::new(ground, &lights, derived).of(&points);
    for (l, light) in placed.iter().enumerate() {
        light_of_point.extend(light.samples.iter().map(|_| Some(l as u32)));
        points.extend(&light.samples);
    }
    let standing = points_of_lights(&light_of_point, lights.len());
    let evidence = Evidence { ground, points: &points, standing: &standing };
    let find = |l: usize| finding(scene, l, &placed[l], &evidence);
    let findings = (0..lights.len()).into_par_iter().filter_map(find).collect();
    let required_m = ground.clearance;
    let mut verification =
        Verification { points, light_of_point, findings, required_m, lights, ..Verification::default() };
    verification.honour_tags(scene, asset, ground.patches);
    verification
}

/// What is wrong with a light of an asset, if anything; whether a tag mends it is not known yet.
fn finding(scene: &Scene, number: usize, placed: &Placed, evidence: &Evidence) -> Option<Finding> {
    let light = &placed.light;
    let bare = Finding {
        light: number as u32,
        normal: light.normal(),
        object: placed.object.map_or_else(String::new, |object| scene.objects[object].path.clone()),
        ..Finding::default()
    };
    if aspect_ratio(light.corners) > MAX_ASPECT * (1.0 + ASPECT_ROUNDING) {
        let place = light.corners.iter().sum::<DVec3>() / 3.0;
        return Some(Finding { kind: FindingKind::TooThin, place, ..bare });
    }
    let violation = judge(number, light, evidence)?;
    // An artist may place a light in the open; it must only not light what it stands for.
    if (placed.authored || !placed.stands) && violation.points == 0 {
        return None;
    }
    let Violation { points, depth, place, triangles, .. } = violation;
    let kind = if points > 0 { FindingKind::LightsItself } else { FindingKind::PokesOut };
    Some(Finding { kind, points, depth_m: depth, place, triangles, ..bare })
}

/// Corners in single precision and a transform may stretch a light by this share.
const ASPECT_ROUNDING: f64 = 1e-3;

/// The tags of the patches' triangles and of the lights.
struct ReceiverTags<'a> {
    triangles: Vec<u32>,
    lights: &'a [u32],
}

impl<'a> ReceiverTags<'a> {
    fn new(scene: &Scene, asset: &'a VlmAsset, patches: &Patches) -> Self {
        let of_scene = triangle_tags(scene, asset);
        let triangles = patches.triangle_source.iter().map(|&t| of_scene[t as usize]).collect();
        Self { triangles, lights: &asset.tags }
    }

    fn ignores(&self, triangle: u32, light: u32) -> bool {
        let tag = self.lights.get(light as usize).copied().unwrap_or(0);
        tag != 0 && tag == self.triangles[triangle as usize]
    }
}

/// A light of an asset in world space.
struct Placed {
    light: Light,
    object: Option<usize>,
    authored: bool,
    /// Its region is known.
    stands: bool,
    /// Its samples on the surface.
    samples: Vec<SurfacePoint>,
}

fn placed_lights(scene: &Scene, asset: &VlmAsset, ground: &Ground) -> Vec<Placed> {
    let object_of_node: FxHashMap<u32, usize> =
        scene.objects.iter().enumerate().map(|(o, object)| (object.node, o)).collect();
    let surface = SurfaceSearch::new(ground);
    let mut placed = Vec::with_capacity(asset.triangles.len());
    for vlm in &asset.vlms {
        // Lights of a node without geometry are placed as the file has them, so that the numbers of the others stay.
        let object = object_of_node.get(&vlm.node).copied();
        let world = object.map_or(DMat4::IDENTITY, |object| scene.objects[object].world_from_node);
        let numbers = vlm.lights[0] as usize..(vlm.lights[0] + vlm.lights[1]) as usize;
        let place = |l: usize| place(asset, l, object, world, vlm.authored, &surface);
        placed.par_extend(numbers.into_par_iter().map(place));
    }
    placed
}

fn place(
    asset: &VlmAsset,
    l: usize,
    object: Option<usize>,
    world: DMat4,
    authored: bool,
    surface: &SurfaceSearch,
) -> Placed {
    let corners = world_corners(asset, l, world);
    let normal = cross_of(corners).normalize_or_zero();
    let of_light = asset.sample_starts[l] as usize..asset.sample_starts[l + 1] as usize;
    let world_from_normal = glam::DMat3::from_mat4(world).inverse().transpose();
    let samples: Vec<SurfacePoint> = asset.samples[of_light]
        .iter()
        .filter_map(|s| {
            let normal = (world_from_normal * s.normal.as_dvec3()).normalize_or_zero();
            surface.at(world.transform_point3(s.position.as_dvec3()), normal, object?)
        })
        .collect();
    let centre = corners.iter().sum::<DVec3>() / 3.0;
    let own = samples.first().copied().or_else(|| surface.at(centre, normal, object?));
    let region = own.map_or(0, |p| surface.patches.triangle_region[p.triangle as usize]);
    let light = Light { corners, region, back: own.is_some_and(|p| p.back) };
    Placed { light, object, authored, stands: own.is_some(), samples }
}

/// Finds the surface on which a sample lies.
struct SurfaceSearch<'a> {
    patches: &'a Patches,
    objects: &'a [u32],
    bvh: Bvh,
    origin: DVec3,
    normals: Vec<DVec3>,
    /// A sample lies on its surface to this distance, metres.
    tolerance: f32,
}

impl<'a> SurfaceSearch<'a> {
    fn new(ground: &'a Ground<'a>) -> Self {
        let patches = ground.patches;
        let origin = patches.positions.first().copied().unwrap_or_default();
        let local: Vec<glam::Vec3> = patches.positions.iter().map(|p| (*p - origin).as_vec3()).collect();
        let normal = |t: usize| cross_of(patches.corners(t)).normalize_or_zero();
        Self {
            patches,
            objects: &ground.objects,
            bvh: Bvh::new(&local, &patches.triangles),
            origin,
            normals: (0..patches.triangles.len()).map(normal).collect(),
            tolerance: ground.clearance as f32,
        }
    }

    /// The point of an object's surface nearest to `p` that looks along `normal`, on whichever side reflects. Where several surfaces
    /// meet or coincide, the one with exactly this normal.
    fn at(&self, p: DVec3, normal: DVec3, object: usize) -> Option<SurfacePoint> {
        let cosine = |t: u32| self.normals[t as usize].dot(normal);
        let alike = |t: u32, least: f64| {
            let two_sided = self.patches.region(t as usize).two_sided;
            let own = self.objects[self.patches.triangle_region[t as usize] as usize] as usize == object;
            own && (if two_sided { cosine(t).abs() } else { cosine(t) }) > least
        };
        let local = (p - self.origin).as_vec3();
        let exact = self.bvh.closest(local, self.tolerance, |t| alike(t, SAME_COSINE));
        let near = exact.or_else(|| self.bvh.closest(local, f32::INFINITY, |t| alike(t, LEAST_COSINE)))?;
        let back = cosine(near.triangle) < 0.0;
        let own = self.normals[near.triangle as usize];
        let position = near.point.as_dvec3() + self.origin;
        let corners = self.patches.corners(near.triangle as usize);
        Some(SurfacePoint {
            position,
            inner: position,
            normal: if back { -own } else { own },
            triangle: near.triangle,
            barycentric: crate::topology::barycentric(corners, position).as_vec3(),
            area: 0.0,
            back,
        })
    }
}

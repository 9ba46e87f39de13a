//! What the pictures show: the facts of each visible point.

use glam::{DVec3, Vec3A};
use rayon::prelude::*;
use vlm_format::VlmAsset;

use super::correspondence::{Place, Places};
use super::lights::WorldLights;
use crate::bvh::nearest::closest_point;
use crate::camera::CameraRays;
use crate::gbuffer::GBuffer;
use crate::ground::Ground;
use crate::patches::Patches;
use crate::render::triangle_tags;
use crate::scene::{Camera, Scene};
use crate::shade::{SurfacePoint, TraceScene};
use crate::surface::SurfacePoint as PatchPoint;
use crate::verify::{FindingKind, Verification};

/// A pixel's point is known in single precision; it counts as lit by its light only below this share of the clearance.
const ROUNDING: f64 = 0.98;

/// All that the page is made from, prepared for queries.
pub struct Evidence<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its tree.
    pub trace: TraceScene<'a>,
    /// The lights.
    pub asset: &'a VlmAsset,
    /// The lights in world space.
    pub lights: &'a WorldLights,
    /// The check.
    pub verification: &'a Verification,
    /// The visible surface; the check's points count its triangles.
    pub patches: &'a Patches,
    /// Which light stands where.
    pub places: Places<'a>,
    /// The tag of each triangle of the scene, 0 for none.
    pub surface_tags: Vec<u32>,
    /// The region for which each light stands: that of the first of its points; `None` for a light without points.
    pub region_of_light: Vec<Option<u32>>,
    /// Per light: whether it comes out somewhere, and then whether a tag keeps it away.
    pub pokes_out: Vec<Option<bool>>,
}

/// A visible point and what stands for it.
#[derive(Clone, Copy)]
pub struct Fact {
    /// The point.
    pub point: SurfacePoint,
    /// Cosine between the sight and the surface, for shading.
    pub facing: f32,
    /// What stands for it.
    pub place: Place,
    /// The tag of the surface, 0 for none.
    pub surface_tag: u32,
    /// About its light; zero where there is none.
    pub light: LightFact,
}

/// How a light lies behind a point for which it stands.
#[derive(Clone, Copy, Default)]
pub struct LightFact {
    /// How far the light would have to move until it lit the point, metres; negative if it does.
    pub clearance_m: f64,
    /// From the point to the nearest place of the light, metres.
    pub distance_m: f64,
    /// The light's tag.
    pub tag: u32,
}

impl Fact {
    /// The light comes too near, tagged or not.
    pub fn fails(&self, required_m: f64) -> bool {
        matches!(self.place, Place::Light(_)) && self.light.clearance_m < ROUNDING * required_m
    }

    /// The surface ignores its own light.
    pub fn is_kept_dark(&self) -> bool {
        self.light.tag != 0 && self.light.tag == self.surface_tag
    }
}

/// One fact per pixel, row 0 at the top; `None` where nothing is seen.
pub struct View {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` facts.
    pub facts: Vec<Option<Fact>>,
}

impl<'a> Evidence<'a> {
    /// Prepares the queries.
    pub fn new(
        scene: &'a Scene,
        asset: &'a VlmAsset,
        lights: &'a WorldLights,
        ground: &Ground<'a>,
        verification: &'a Verification,
    ) -> Self {
        let Verification { points, light_of_point, findings, .. } = verification;
        let patches = ground.patches;
        let mut pokes_out = vec![None; asset.triangles.len()];
        for finding in findings.iter().filter(|f| f.kind == FindingKind::PokesOut) {
            pokes_out[finding.light as usize] = Some(finding.tagged);
        }
        Self {
            scene,
            trace: TraceScene::new(scene),
            asset,
            lights,
            verification,
            patches,
            places: Places::new(scene, ground, verification, lights),
            surface_tags: triangle_tags(scene, asset),
            region_of_light: regions_of_lights(patches, points, light_of_point, asset.triangles.len()),
            pokes_out,
        }
    }

    /// The facts of every pixel of a camera.
    pub fn view(&self, camera: &Camera, width: u32, height: u32) -> View {
        let rays = CameraRays::new(camera, width, height);
        let gbuffer = GBuffer::trace(&self.trace, camera, width, height);
        let fact = |(i, point): (usize, &Option<SurfacePoint>)| {
            let ray = rays.through(i as u32 % width, i as u32 / width);
            point.map(|point| self.fact(point, -ray.direction.dot(point.geometric_normal)))
        };
        View { width, height, facts: gbuffer.points.par_iter().enumerate().map(fact).collect() }
    }

    /// The scene's primitive for which a light stands: that of its region, else of the surface nearest to it.
    pub fn primitive_of_light(&self, light: usize) -> Option<u32> {
        if let Some(region) = self.region_of_light.get(light).copied().flatten() {
            return Some(self.patches.regions[region as usize].primitive);
        }
        let centre = self.lights.corners.get(light)?.iter().sum::<DVec3>() / 3.0;
        let near = self.trace.bvh.closest(centre.as_vec3(), f32::INFINITY, |_| true)?;
        self.scene.triangle_primitive.get(near.triangle as usize).copied()
    }

    /// True if a light stands for a surface of which both sides reflect.
    pub fn is_sheet(&self, light: u32) -> bool {
        let region = self.region_of_light.get(light as usize).copied().flatten();
        region.is_some_and(|region| self.patches.regions[region as usize].two_sided)
    }

    /// The name of a primitive's material; empty if there is none.
    pub fn material_name(&self, primitive: u32) -> &str {
        let primitive = self.scene.primitives.get(primitive as usize);
        let material = primitive.and_then(|p| self.scene.materials.get(p.material as usize));
        material.map_or("", |m| &m.name)
    }

    fn fact(&self, point: SurfacePoint, facing: f32) -> Fact {
        let place = self.places.light_at(&point);
        let light = match place {
            Place::Light(light) => {
                self.light_fact(light as usize, point.position.as_dvec3(), point.geometric_normal.as_dvec3())
            }
            _ => LightFact::default(),
        };
        Fact {
            point,
            facing,
            place,
            surface_tag: self.surface_tags.get(point.triangle as usize).copied().unwrap_or(0),
            light,
        }
    }

    /// How a light lies behind a point.
    pub fn light_fact(&self, light: usize, position: DVec3, normal: DVec3) -> LightFact {
        let corners = self.lights.corners[light];
        let rise = corners.iter().map(|v| (*v - position).dot(normal)).fold(f64::NEG_INFINITY, f64::max);
        let before = (position - corners[0]).dot(self.lights.normals[light]);
        let local = corners.map(|p| Vec3A::from((p - position).as_vec3()));
        LightFact {
            clearance_m: -rise.min(before),
            distance_m: f64::from(closest_point(&local, Vec3A::ZERO).length()),
            tag: self.asset.tags.get(light).copied().unwrap_or(0),
        }
    }
}

/// The region of the first point of each light.
pub fn regions_of_lights(
    patches: &Patches,
    points: &[PatchPoint],
    light_of_point: &[Option<u32>],
    lights: usize,
) -> Vec<Option<u32>> {
    let mut regions = vec![None; lights];
    for (point, light) in points.iter().zip(light_of_point) {
        if let Some(light) = light {
            let region = patches.triangle_region[point.triangle as usize];
            regions[*light as usize].get_or_insert(region);
        }
    }
    regions
}

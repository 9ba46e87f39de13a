//! Light meshes that artists made: they add to the derived lights, take some away, or both.
//!
//! An authored mesh goes into the asset as it was modelled. Its lights get their samples from the visible surface
//! in front of them, and go through the same check as derived ones; those that light the surface behind which they stand are
//! tagged, not moved.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::bvh::Bvh;
use crate::clearance::self_lighting;
use crate::options::BakeOptions;
use crate::samples::{BakedLight, WorldSample};
use crate::scene::{AuthoredMesh, AuthoredMode, Scene, Volume};
use crate::surface::{SurfacePoint, spread_over};
use crate::tag::{Accusation, TagReason};
use crate::topology::{area, barycentric, cross_of};

/// An authored light stands for surface within this share of the scene's extent. Higher values let a mesh float farther
/// behind (or in front of) its surface; lower values keep it from finding the far side of a thick wall.
const REACH_SHARE: f32 = 0.05;

/// It stands only for surface that faces its way by this cosine.
const LEAST_COSINE: f32 = 0.3;

fn adds(mesh: &AuthoredMesh) -> bool {
    matches!(mesh.mode, AuthoredMode::Add | AuthoredMode::Both)
}

fn subtracts(mesh: &AuthoredMesh) -> bool {
    matches!(mesh.mode, AuthoredMode::Subtract | AuthoredMode::Both)
}

/// The number of lights that artists made.
#[must_use]
pub fn count(scene: &Scene) -> usize {
    scene.authored.iter().filter(|m| adds(m)).map(|m| m.triangles.len()).sum()
}

/// Takes away the derived lights that authored meshes replace or subtract, and adds those that artists made.
pub fn merge(scene: &Scene, lights: &mut Vec<BakedLight>, options: &BakeOptions, clearance: f64) {
    for mesh in scene.authored.iter().filter(|m| subtracts(m)) {
        subtract(mesh, lights);
    }
    let adding: Vec<&AuthoredMesh> = scene.authored.iter().filter(|m| adds(m)).collect();
    if adding.is_empty() {
        return;
    }
    let visible = VisibleSurface::new(scene);
    for mesh in adding {
        lights.extend(AuthoredLights { scene, mesh, visible: &visible, options, clearance }.lights());
    }
}

/// Removes the derived lights whose centres lie inside an authored mesh.
fn subtract(mesh: &AuthoredMesh, lights: &mut Vec<BakedLight>) {
    let volume = Volume::of(mesh);
    lights.retain(|light| {
        let centre = (light.corners.iter().sum::<DVec3>() / 3.0).as_vec3();
        light.authored || !volume.contains(centre)
    });
}

/// The visible surface as authored lights search it.
struct VisibleSurface {
    bvh: Bvh,
    normals: Vec<Vec3>,
    extent: f32,
}

impl VisibleSurface {
    fn new(scene: &Scene) -> Self {
        let corners = |t: &[u32; 3]| t.map(|v| scene.positions[v as usize].as_dvec3());
        Self {
            bvh: Bvh::new(&scene.positions, &scene.triangles),
            normals: scene
                .triangles
                .iter()
                .map(|t| cross_of(corners(t)).normalize_or_zero().as_vec3())
                .collect(),
            extent: scene.bounds().map_or(0.0, |[low, high]| (high - low).max_element() as f32),
        }
    }

    /// The nearest visible surface that faces the same way: triangle and point.
    fn nearest(&self, p: DVec3, normal: Vec3) -> Option<(u32, Vec3)> {
        let alike = |t: u32| self.normals[t as usize].dot(normal) > LEAST_COSINE;
        self.bvh.closest(p.as_vec3(), REACH_SHARE * self.extent, alike).map(|n| (n.triangle, n.point))
    }
}

/// The lights of one authored mesh in the making.
struct AuthoredLights<'a> {
    scene: &'a Scene,
    mesh: &'a AuthoredMesh,
    visible: &'a VisibleSurface,
    options: &'a BakeOptions,
    clearance: f64,
}

impl AuthoredLights<'_> {
    /// Every light.
    fn lights(&self) -> Vec<BakedLight> {
        (0..self.mesh.triangles.len()).into_par_iter().filter_map(|t| self.light(t)).collect()
    }

    fn light(&self, triangle: usize) -> Option<BakedLight> {
        let corners = self.mesh.triangles[triangle].map(|v| self.mesh.positions[v as usize].as_dvec3());
        let normal = cross_of(corners).try_normalize()?;
        let steering = &self.scene.objects[self.mesh.object as usize].steering;
        let own = self.surface_behind(corners, normal);
        let lit = own
            .iter()
            .filter(|(p, _)| self_lighting(&corners, normal, p.position, p.normal, self.clearance) > 0.0);
        let mut triangles: Vec<u32> = lit.map(|(point, _)| point.triangle).collect();
        triangles.sort_unstable();
        triangles.dedup();
        let strength = steering.strength();
        let painted = self.mesh.albedo.as_ref().map(|albedo| albedo[triangle]);
        let mean = || own.iter().map(|(_, albedo)| *albedo).sum::<Vec3>() / own.len().max(1) as f32;
        let accused = Accusation { triangles, reason: TagReason::Uncleared };
        Some(BakedLight {
            corners,
            object: self.mesh.object,
            albedo: painted.unwrap_or_else(mean),
            emission: self.mesh.emission[triangle] * strength,
            accused: Some(accused).filter(|accused| !accused.triangles.is_empty()),
            authored: true,
            samples: self.samples(&own, painted, strength),
            ..BakedLight::default()
        })
    }

    /// Points of the visible surface for which the light stands, with their albedo.
    fn surface_behind(&self, corners: [DVec3; 3], normal: DVec3) -> Vec<(SurfacePoint, Vec3)> {
        let area = area(corners) / f64::from(self.options.tests_per_light.max(1));
        spread_over(corners, self.options.tests_per_light)
            .filter_map(|p| self.visible.nearest(p, normal.as_vec3()))
            .map(|(triangle, position)| {
                let surface_corners = self.scene.triangles[triangle as usize]
                    .map(|v| self.scene.positions[v as usize].as_dvec3());
                let barycentric = barycentric(surface_corners, position.as_dvec3()).as_vec3();
                let surface = self.scene.albedo_at(triangle as usize, barycentric, area as f32);
                let point = SurfacePoint {
                    position: position.as_dvec3(),
                    inner: position.as_dvec3(),
                    normal: self.visible.normals[triangle as usize].as_dvec3(),
                    triangle,
                    barycentric,
                    area,
                    back: false,
                };
                (point, surface.reflectance())
            })
            .collect()
    }

    /// Every n-th of the points, equal shares. The mesh's own colour, where it has a material, replaces the surface's.
    fn samples(
        &self,
        own: &[(SurfacePoint, Vec3)],
        painted: Option<Vec3>,
        strength: Vec3,
    ) -> Vec<WorldSample> {
        let stride = own.len().div_ceil(self.options.samples.max(1) as usize).max(1);
        let chosen = own.iter().step_by(stride);
        let share = 1.0 / chosen.len().max(1) as f32;
        chosen
            .map(|(point, albedo)| WorldSample {
                position: point.position,
                normal: point.normal,
                reflectance: painted.unwrap_or(*albedo) * strength * share,
                share,
            })
            .collect()
    }
}

//! A scene ready for rays: what they meet, what colour it has there, and the direct light on it.

use glam::Vec3;
use vlm_shaders::cpu::gather::Receiver;
use vlm_shaders::cpu::punctual;

use crate::bvh::{Bvh, Hit};
use crate::emitters::Emitters;
use crate::scene::{self, PunctualKind, Scene};

/// What rays must know of a scene, indexed by triangle, with the tree over its triangles.
pub struct TraceScene<'a> {
    /// The scene itself.
    pub scene: &'a Scene,
    /// The tree over [`Scene::triangles`].
    pub bvh: Bvh,
    /// The emissive triangles.
    pub emitters: Emitters,
    /// The punctual lights; the default light in a scene where nothing shines.
    pub lights: Vec<punctual::PunctualLight>,
    sides: Vec<Sides>,
    /// True for triangles whose alpha mask is honoured. Empty when none is.
    masked: Vec<bool>,
}

/// Coverage of an alpha mask from which rays are blocked.
const SOLID: f32 = 0.5;

/// How a triangle meets rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sides {
    /// Rays pass: alpha blending and transmission. Light transport here knows only opaque surfaces.
    None,
    /// The counter-clockwise side reflects; the other is black.
    Front,
    /// Both sides reflect.
    Both,
}

/// A point of a visible surface, on the side from which it was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Index into [`Scene::triangles`].
    pub triangle: u32,
    /// Metres, world space.
    pub position: Vec3,
    /// Unit shading normal on the seen side.
    pub normal: Vec3,
    /// Unit normal of the triangle on the seen side.
    pub geometric_normal: Vec3,
    /// Linear albedo, 0 to 1.
    pub albedo: Vec3,
    /// Emitted radiance, nt.
    pub emission: Vec3,
}

impl SurfacePoint {
    /// The point as phase 2 sees it, on surface of this tag.
    #[must_use]
    pub fn receiver(&self, tag: u32) -> Receiver {
        let &Self { position, normal, geometric_normal, .. } = self;
        Receiver { position, normal, geometric_normal, tag }
    }
}

impl<'a> TraceScene<'a> {
    /// Builds the tree; about a second per million triangles.
    #[must_use]
    pub fn new(scene: &'a Scene) -> Self {
        let sides = scene.triangle_primitive.iter().map(|&primitive| sides_of(scene, primitive)).collect();
        let lights = scene.lights_or_default().iter().map(punctual_light).collect();
        let bvh = Bvh::new(&scene.positions, &scene.triangles);
        Self { scene, bvh, emitters: Emitters::new(scene), lights, sides, masked: Vec::new() }
    }

    /// The same, with holes where alphaMode MASK cuts them; [`TraceScene::new`] takes masked surfaces as solid. Every
    /// hit on them then costs a texture look-up.
    #[must_use]
    pub fn with_alpha_masks(self) -> Self {
        let is_masked = |triangle| self.scene.material_of(triangle).is_some_and(|m| m.alpha_cutoff.is_some());
        let masked = (0..self.scene.triangles.len()).map(is_masked).collect();
        Self { masked, ..self }
    }

    /// The first surface that a camera ray shows: it passes through backs of single-sided surfaces (culling).
    #[must_use]
    pub fn camera_hit(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let shows = |hit: &Hit| self.is_lit_side(hit) && self.is_opaque(hit);
        self.bvh.hit_where(origin, direction, f32::INFINITY, shows)
    }

    /// The first surface that a light path meets, whichever side it shows.
    #[must_use]
    pub fn path_hit(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        self.path_hit_within(origin, direction, f32::INFINITY)
    }

    /// True if the side on which `hit` lies reflects and emits.
    #[must_use]
    pub fn is_lit_side(&self, hit: &Hit) -> bool {
        match self.sides(hit.triangle) {
            Sides::None => false,
            Sides::Front => hit.front,
            Sides::Both => true,
        }
    }

    /// The surface at a hit, on the side that the ray meets. `footprint` is the area over which textures are averaged,
    /// square metres.
    #[must_use]
    pub fn surface(&self, hit: &Hit, footprint: f32) -> Option<SurfacePoint> {
        let scene = self.scene;
        let corners = *scene.triangles.get(hit.triangle as usize)?;
        let weights = hit.barycentric.to_array();
        let interpolate = |values: &[Vec3]| -> Vec3 {
            let terms = corners.iter().zip(weights);
            terms.map(|(&i, w)| values.get(i as usize).copied().unwrap_or_default() * w).sum()
        };
        let [p0, p1, p2] = corners.map(|i| scene.positions.get(i as usize).copied().unwrap_or_default());
        let side = if hit.front { 1.0 } else { -1.0 };
        let geometric_normal = (p1 - p0).cross(p2 - p0).try_normalize()? * side;
        let normal =
            interpolate(&scene.vertex_normals).try_normalize().map_or(geometric_normal, |n| n * side);
        let scene::Surface { albedo, emission, .. } =
            scene.albedo_at(hit.triangle as usize, hit.barycentric, footprint);
        let position = interpolate(&scene.positions);
        Some(SurfacePoint { triangle: hit.triangle, position, normal, geometric_normal, albedo, emission })
    }

    /// Irradiance by the punctual lights with hard shadows, lx. Every opaque surface casts shadows, whichever side it
    /// shows, and no light comes from behind the geometric normal.
    #[must_use]
    pub fn direct_irradiance(&self, position: Vec3, normal: Vec3, geometric_normal: Vec3) -> Vec3 {
        self.irradiance_by(&self.lights, position, normal, geometric_normal)
    }

    /// The punctual lights of the scene, in world space.
    #[must_use]
    pub fn lights(&self) -> &[punctual::PunctualLight] {
        &self.lights
    }

    /// [`TraceScene::direct_irradiance`] by other lights.
    #[must_use]
    pub fn irradiance_by(
        &self,
        lights: &[punctual::PunctualLight],
        position: Vec3,
        normal: Vec3,
        geometric_normal: Vec3,
    ) -> Vec3 {
        let origin = self.bvh.leave(position, geometric_normal);
        let arriving = |light: &punctual::PunctualLight| {
            let incident = light.incident(position)?;
            let cosine = normal.dot(incident.direction);
            if cosine <= 0.0 || geometric_normal.dot(incident.direction) <= 0.0 {
                return None;
            }
            let visible = if light.directional {
                !self.is_occluded(origin, incident.direction, f32::INFINITY)
            } else {
                !self.is_occluded(origin, light.position - origin, 1.0)
            };
            visible.then_some(incident.facing_irradiance * cosine)
        };
        lights.iter().filter_map(arriving).sum()
    }

    /// Radiosity of a surface point by direct light alone, lx: `albedo * E`.
    #[must_use]
    pub fn reflected(&self, point: &SurfacePoint) -> Vec3 {
        if point.albedo == Vec3::ZERO {
            return Vec3::ZERO;
        }
        point.albedo * self.direct_irradiance(point.position, point.normal, point.geometric_normal)
    }

    /// The first surface that a light path meets nearer than `most` (in multiples of `direction`).
    #[must_use]
    pub fn path_hit_within(&self, origin: Vec3, direction: Vec3, most: f32) -> Option<Hit> {
        self.bvh.hit_where(origin, direction, most, |hit| self.is_opaque(hit))
    }

    /// Whether the front and the back of a triangle reflect and emit.
    #[must_use]
    pub fn lit_sides(&self, triangle: u32) -> [bool; 2] {
        match self.sides(triangle) {
            Sides::None => [false, false],
            Sides::Front => [true, false],
            Sides::Both => [true, true],
        }
    }

    /// True if an opaque surface, whichever side it shows, lies on the ray nearer than `max_distance` (in multiples of
    /// `direction`).
    #[must_use]
    pub fn is_occluded(&self, origin: Vec3, direction: Vec3, max_distance: f32) -> bool {
        self.bvh.occluded_where(origin, direction, max_distance, |hit| self.is_opaque(hit))
    }

    fn is_opaque(&self, hit: &Hit) -> bool {
        self.sides(hit.triangle) != Sides::None && !self.is_hole(hit)
    }

    fn is_hole(&self, hit: &Hit) -> bool {
        let triangle = hit.triangle as usize;
        let masked = self.masked.get(triangle).copied().unwrap_or(false);
        masked && self.scene.albedo_at(triangle, hit.barycentric, 0.0).coverage < SOLID
    }

    fn sides(&self, triangle: u32) -> Sides {
        self.sides.get(triangle as usize).copied().unwrap_or(Sides::Front)
    }
}

fn sides_of(scene: &Scene, primitive: u32) -> Sides {
    let material = scene.primitives.get(primitive as usize).map(|p| p.material as usize);
    match material.and_then(|m| scene.materials.get(m)) {
        Some(material) if !material.reflects => Sides::None,
        Some(material) if material.two_sided => Sides::Both,
        _ => Sides::Front,
    }
}

/// A light of the scene as rays and devices evaluate it.
#[must_use]
pub fn punctual_light(light: &scene::PunctualLight) -> punctual::PunctualLight {
    let point = punctual::PunctualLight {
        direction: light.direction,
        range: light.range,
        ..punctual::PunctualLight::point(light.position, light.intensity)
    };
    match light.kind {
        PunctualKind::Point => point,
        PunctualKind::Directional => punctual::PunctualLight { directional: true, ..point },
        PunctualKind::Spot { cos_inner, cos_outer } => point.with_cone(cos_inner, cos_outer),
    }
}

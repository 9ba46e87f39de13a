//! Where virtual point lights come from.

use std::f32::consts::{PI, TAU};

use glam::Vec3;
use vlm_bake::shade::TraceScene;
use vlm_shaders::cpu::punctual::PunctualLight;
use vlm_shaders::cpu::resolve::luminance;

use crate::random::{cone_direction, disk_point, plastic_point, unit};

/// A diffuse point light on a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointLight {
    /// Metres.
    pub position: Vec3,
    /// Unit geometric normal: it shines around it, with the cosine.
    pub normal: Vec3,
    /// Total flux, lm.
    pub flux: Vec3,
}

/// The lights of a frame.
pub struct Shot {
    /// Those paths that met a surface which reflects.
    pub lights: Vec<PointLight>,
    /// Rays traced.
    pub rays: u64,
}

/// What emits light, drawn in proportion to its power.
pub struct Sources {
    /// Each with the probability of itself and all before it.
    sources: Vec<(Source, f32)>,
    centre: Vec3,
    /// Of the ball around the scene, metres.
    radius: f32,
}

#[derive(Clone, Copy)]
enum Source {
    /// Index into [`TraceScene::lights`].
    Punctual(usize),
    Emitters,
}

impl Sources {
    /// Weighs everything that emits.
    #[must_use]
    pub fn new(scene: &TraceScene<'_>) -> Self {
        let [low, high] = scene.scene.bounds().unwrap_or_default().map(|p| p.as_vec3());
        let (centre, radius) = ((low + high) / 2.0, 0.5 * low.distance(high));
        let punctual = scene.lights.iter().enumerate();
        let mut powers: Vec<(Source, f32)> = punctual
            .map(|(i, light)| {
                (Source::Punctual(i), luminance(light.intensity) * solid_angle_or_area(light, radius))
            })
            .collect();
        powers.push((Source::Emitters, emitted_flux(scene)));
        let total: f32 = powers.iter().map(|(_, power)| power).sum();
        let mut cumulative = 0.0;
        let sources = powers.into_iter().filter(|(_, power)| *power > 0.0).map(|(source, power)| {
            cumulative += power / total;
            (source, cumulative)
        });
        Self { sources: sources.collect(), centre, radius }
    }

    /// Draws `count` paths; each frame draws others.
    #[must_use]
    pub fn shoot(&self, scene: &TraceScene<'_>, count: u32, frame: u32) -> Shot {
        let shift = [0, 1, 2].map(|k| unit(u64::from(frame), k));
        let mut shot = Shot { lights: Vec::with_capacity(count as usize), rays: 0 };
        for i in 0..count {
            let choice = (i as f32 + shift[0]) / count as f32;
            let Some((source, probability)) = self.choose(choice) else { break };
            let random = plastic_point(i, (shift[1], shift[2]));
            let drawn = match source {
                Source::Punctual(light) => {
                    shot.rays += 1;
                    self.by_path(scene, &scene.lights[light], random)
                }
                Source::Emitters => by_emitter(scene, random),
            };
            let share = 1.0 / (probability * count as f32);
            let lit = drawn.map(|light| PointLight { flux: light.flux * share, ..light });
            shot.lights.extend(lit.filter(|light| light.flux != Vec3::ZERO));
        }
        shot
    }

    /// A source and its probability.
    fn choose(&self, u: f32) -> Option<(Source, f32)> {
        let index = self.sources.partition_point(|(_, cumulative)| *cumulative <= u);
        let index = index.min(self.sources.len().checked_sub(1)?);
        let (source, cumulative) = self.sources[index];
        let before = index.checked_sub(1).map_or(0.0, |i| self.sources[i].1);
        Some((source, cumulative - before))
    }

    /// The light that one path of a punctual light leaves. The path stands for the surface area `d^2 / (p cos)` around
    /// its hit (`p` its density per solid angle; for parallel light, `1 / (p cos)` with `p` per area across it), which
    /// reflects `albedo * E` per area; `E` has the shading normal's cosine, as the truth has.
    fn by_path(
        &self,
        scene: &TraceScene<'_>,
        light: &PunctualLight,
        random: (f32, f32),
    ) -> Option<PointLight> {
        let axis = light.direction;
        let (tangent, bitangent) = axis.any_orthonormal_pair();
        let turn = |local: Vec3| tangent * local.x + bitangent * local.y + axis * local.z;
        let (origin, direction) = if light.directional {
            (self.centre + turn(disk_point(random) - Vec3::Z) * self.radius, axis)
        } else {
            (light.position, turn(cone_direction(cos_outer(light), random)))
        };
        let hit = scene.path_hit(origin, direction).filter(|hit| scene.is_lit_side(hit))?;
        let y = scene.surface(&hit, 0.0)?;
        let incident = light.incident(y.position)?;
        let (cosine, geometric) =
            (y.normal.dot(incident.direction), y.geometric_normal.dot(incident.direction));
        if cosine <= 0.0 || geometric <= 0.0 {
            return None;
        }
        let spread = if light.directional { 1.0 } else { incident.distance * incident.distance };
        let area = solid_angle_or_area(light, self.radius) * spread / geometric;
        let flux = y.albedo * incident.facing_irradiance * (cosine * area);
        Some(PointLight { position: y.position, normal: y.geometric_normal, flux })
    }
}

/// A point of an emitter stands for the area `1 / density`.
fn by_emitter(scene: &TraceScene<'_>, random: (f32, f32)) -> Option<PointLight> {
    let point = scene.emitters.draw(random)?;
    let corners = scene.scene.corners(point.triangle as usize)?;
    let weights = barycentric(corners, point.position);
    let emission = scene.scene.albedo_at(point.triangle as usize, weights, 0.0).emission;
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).try_normalize()?;
    let flux = PI * emission / scene.emitters.density(point.triangle);
    Some(PointLight { position: point.position, normal, flux })
}

/// Luminous flux of all emitters, lm.
fn emitted_flux(scene: &TraceScene<'_>) -> f32 {
    if scene.emitters.is_empty() {
        return 0.0;
    }
    let scene = scene.scene;
    let flux = |triangle: usize| {
        let [a, b, c] = scene.corners(triangle).unwrap_or_default();
        PI * luminance(scene.mean_surface(triangle).emission) * 0.5 * (b - a).cross(c - a).length()
    };
    let emits = |t: &usize| scene.material_of(*t).is_some_and(|m| m.emission != Vec3::ZERO);
    (0..scene.triangles.len()).filter(emits).map(flux).sum()
}

/// What the paths of a light cover: a solid angle, or the disk across a directional light that covers the scene.
fn solid_angle_or_area(light: &PunctualLight, radius: f32) -> f32 {
    if light.directional { PI * radius * radius } else { TAU * (1.0 - cos_outer(light)) }
}

/// Cosine beyond which the light's cone is dark: its falloff `cosine * scale + offset` is 0 there.
fn cos_outer(light: &PunctualLight) -> f32 {
    if light.cone_scale > 0.0 { (-light.cone_offset / light.cone_scale).max(-1.0) } else { -1.0 }
}

fn barycentric([a, b, c]: [Vec3; 3], p: Vec3) -> Vec3 {
    let normal = (b - a).cross(c - a);
    let weight = |p: Vec3, q: Vec3, r: Vec3| (q - p).cross(r - p).dot(normal) / normal.length_squared();
    let (u, v) = (weight(p, b, c), weight(p, c, a));
    Vec3::new(u, v, 1.0 - u - v)
}

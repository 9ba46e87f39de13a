//! Albedo, coverage and emission: at a point, and in the mean over a triangle.

use super::texture::Texture;
use super::{Material, Scene};
use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

/// What a surface does with light at a point, or in the mean over an area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surface {
    /// Linear albedo of what is there; 0 for materials that do not reflect (BLEND, transmission).
    pub albedo: Vec3,
    /// Share of the area that alphaMode MASK leaves there, 0 to 1; at a point the interpolated coverage.
    pub coverage: f32,
    /// Emitted radiance in cd/m^2 (nt) of what is there.
    pub emission: Vec3,
    /// Its albedo were the material's base colour factor white: what is painted, whatever the paint is multiplied by.
    pub painted: Vec3,
}

/// A triangle is cut into at most this many parts along each edge for its mean, and each part looked up once. Fewer
/// parts need coarser mip levels, which mix in what lies beside the triangle in the image; more cost time. Weighed by
/// area, Sponza's triangles err by 6 % (4 parts), 3.5 % (6), 3.3 % (8), and groups of them by far less.
const MAX_PARTS: u32 = 6;

impl Scene {
    /// The surface at the point of a triangle that has these weights of the corners (their sum is 1).
    ///
    /// `footprint` is the area in m^2 that the answer should be the mean of; 0 reads the finest texels.
    #[must_use]
    pub fn albedo_at(&self, triangle: usize, barycentric: Vec3, footprint: f32) -> Surface {
        let Some(patch) = self.patch(triangle) else { return Surface::default() };
        let look_up = |texture: Option<&Texture>, uvs: [Vec2; 3]| {
            let Some(texture) = texture else { return Vec4::ONE };
            let level = match footprint {
                area if area > 0.0 => {
                    texture.level_of(texel_area(texture, uvs) * area / patch.world_area(self))
                }
                _ => 0.0,
            };
            texture.sample(weigh(uvs, barycentric), level)
        };
        let base = look_up(patch.base_color_texture, patch.uvs);
        let emissive = look_up(patch.emissive_texture, patch.emissive_uvs);
        let color = base.truncate() * weigh(patch.colors, barycentric);
        patch.surface(color, patch.coverage_of(base), emissive.truncate())
    }

    /// The mean over a triangle: albedo weighed by coverage, coverage and emission weighed by area.
    #[must_use]
    pub fn mean_surface(&self, triangle: usize) -> Surface {
        let Some(patch) = self.patch(triangle) else { return Surface::default() };
        let (color, coverage) = patch.mean_base_color();
        patch.surface(color, coverage, patch.mean_emissive())
    }

    /// [`Scene::mean_surface`] of every triangle.
    #[must_use]
    pub fn triangle_surfaces(&self) -> Vec<Surface> {
        (0..self.triangles.len()).into_par_iter().map(|triangle| self.mean_surface(triangle)).collect()
    }

    /// The material of a triangle.
    #[must_use]
    pub fn material_of(&self, triangle: usize) -> Option<&Material> {
        let primitive = self.primitives.get(*self.triangle_primitive.get(triangle)? as usize)?;
        self.materials.get(primitive.material as usize)
    }

    /// World-space corners of a triangle, metres.
    #[must_use]
    pub fn corners(&self, triangle: usize) -> Option<[Vec3; 3]> {
        gather(&self.positions, *self.triangles.get(triangle)?)
    }

    fn patch(&self, triangle: usize) -> Option<Patch<'_>> {
        let material = self.material_of(triangle)?;
        let vertices = *self.triangles.get(triangle)?;
        let texture = |index: Option<u32>| self.textures.get(index? as usize);
        Some(Patch {
            triangle,
            material,
            base_color_texture: texture(material.base_color_texture),
            emissive_texture: texture(material.emissive_texture),
            uvs: gather(&self.vertex_uvs, vertices)?,
            emissive_uvs: gather(&self.vertex_emissive_uvs, vertices)?,
            colors: gather(&self.vertex_colors, vertices)?,
        })
    }
}

impl Surface {
    /// Albedo times coverage: reflected flux over the flux that falls on the whole area.
    #[must_use]
    pub fn reflectance(&self) -> Vec3 {
        self.albedo * self.coverage
    }
}

/// A triangle with all that colours it.
struct Patch<'a> {
    triangle: usize,
    material: &'a Material,
    base_color_texture: Option<&'a Texture>,
    emissive_texture: Option<&'a Texture>,
    uvs: [Vec2; 3],
    emissive_uvs: [Vec2; 3],
    colors: [Vec3; 3],
}

impl Patch<'_> {
    /// Mean of texture times vertex colour over what the mask leaves (over everything, if it leaves nothing), and the
    /// share that it leaves.
    fn mean_base_color(&self) -> (Vec3, f32) {
        let Some(texture) = self.base_color_texture else {
            return (self.colors.iter().sum::<Vec3>() / 3.0, self.coverage_of(Vec4::ONE));
        };
        let (mut plain, mut weighed, mut coverage, mut count) = (Vec3::ZERO, Vec3::ZERO, 0.0, 0.0);
        for_each_part(texture, self.uvs, |barycentric, texel| {
            let color = texel.truncate() * weigh(self.colors, barycentric);
            let covered = self.coverage_of(texel);
            plain += color;
            weighed += color * covered;
            coverage += covered;
            count += 1.0;
        });
        if coverage > 0.0 { (weighed / coverage, coverage / count) } else { (plain / count, 0.0) }
    }

    fn mean_emissive(&self) -> Vec3 {
        let Some(texture) = self.emissive_texture else { return Vec3::ONE };
        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
        for_each_part(texture, self.emissive_uvs, |_, texel| {
            sum += texel.truncate();
            count += 1.0;
        });
        sum / count
    }

    /// A masked texture's alpha is coverage; without a texture the factor alone decides; others cover everything.
    fn coverage_of(&self, texel: Vec4) -> f32 {
        match (self.material.alpha_cutoff, self.base_color_texture) {
            (Some(_), Some(texture)) if texture.is_masked() => texel.w,
            (Some(cutoff), _) if self.material.alpha_factor < cutoff => 0.0,
            _ => 1.0,
        }
    }

    fn surface(&self, color: Vec3, coverage: f32, emissive: Vec3) -> Surface {
        let painted = if self.material.reflects { color } else { Vec3::ZERO };
        Surface {
            albedo: self.material.base_color * painted,
            coverage,
            emission: self.material.emission * emissive,
            painted,
        }
    }

    fn world_area(&self, scene: &Scene) -> f32 {
        let area = scene.corners(self.triangle).map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length());
        area.unwrap_or(0.0).max(f32::MIN_POSITIVE)
    }
}

/// Cuts a triangle into equal parts no longer than two texels (but no more than [`MAX_PARTS`] along an edge), and looks
/// each up at its centroid, in the level whose texels are as large as a part.
fn for_each_part(texture: &Texture, uvs: [Vec2; 3], mut visit: impl FnMut(Vec3, Vec4)) {
    let size = Vec2::from_array(texture.size().map(|side| side as f32));
    let [a, b, c] = uvs.map(|uv| uv * size);
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let parts = ((0.5 * longest).ceil() as u32).clamp(1, MAX_PARTS);
    // The finer of the two nearest levels, so that less from beside the triangle comes in.
    let level = texture.level_of(texel_area(texture, uvs) / (parts * parts) as f32).floor();
    for i in 0..parts {
        for j in 0..parts - i {
            let mut at = |third: f32| {
                let (u, v) = ((i as f32 + third) / parts as f32, (j as f32 + third) / parts as f32);
                let barycentric = Vec3::new(1.0 - u - v, u, v);
                visit(barycentric, texture.sample(weigh(uvs, barycentric), level));
            };
            at(1.0 / 3.0);
            // The part that stands on its tip, between this one and the next of the row.
            if i + j + 1 < parts {
                at(2.0 / 3.0);
            }
        }
    }
}

/// Area of a triangle in texels of level 0.
fn texel_area(texture: &Texture, [a, b, c]: [Vec2; 3]) -> f32 {
    let [width, height] = texture.size();
    0.5 * (b - a).perp_dot(c - a).abs() * width as f32 * height as f32
}

#[inline]
fn weigh<T: Copy + std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>>(
    [a, b, c]: [T; 3],
    weights: Vec3,
) -> T {
    a * weights.x + b * weights.y + c * weights.z
}

fn gather<T: Copy>(values: &[T], vertices: [u32; 3]) -> Option<[T; 3]> {
    let at = |i: u32| values.get(i as usize).copied();
    Some([at(vertices[0])?, at(vertices[1])?, at(vertices[2])?])
}

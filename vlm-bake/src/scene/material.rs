//! glTF materials, reduced to what diffuse light needs, and the textures that they need decoded.

use super::Material;
use super::texture::{Mask, Sampling, Wrap};
use glam::{Affine2, Mat2, Vec2, Vec3};
use gltf::material::AlphaMode;
use gltf::texture::{Info, MagFilter, WrappingMode};
use serde_json::Value;

/// The most that a surface may emit, nt: six hundred times what the sun does, and far from what single precision can hold.
const MOST_RADIANCE: f32 = 1e12;

/// The materials of a file with what must be read elsewhere for them.
#[derive(Default)]
pub(super) struct MaterialTable {
    /// The file's materials in its order, then glTF's default material.
    pub materials: Vec<Material>,
    /// For each material.
    pub uvs: Vec<UvSources>,
    /// What [`Material`]'s texture numbers stand for.
    pub requests: Vec<TextureRequest>,
}

/// Where a material's texture coordinates come from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct UvSources {
    pub base_color: Option<UvSource>,
    pub emissive: Option<UvSource>,
}

/// `TEXCOORD_<set>` with KHR_texture_transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UvSource {
    pub set: u32,
    pub texture_from_vertex: Affine2,
}

/// An image to decode, in the one way that a material reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TextureRequest {
    pub image: usize,
    pub sampling: Sampling,
    pub mask: Option<Mask>,
}

/// Reads all materials. Textures are asked for only where a `used` material's colour depends on them.
pub(super) fn read(
    document: &gltf::Document,
    json: &Value,
    used: &[bool],
    notes: &mut Vec<String>,
) -> MaterialTable {
    let mut table = MaterialTable::default();
    for (index, source) in document.materials().enumerate() {
        let used = used.get(index).copied().unwrap_or(false);
        table.push(&source, format!("material {index}"), json, used, notes);
    }
    table.materials.push(default_material());
    table.uvs.push(UvSources::default());
    table
}

fn default_material() -> Material {
    Material {
        name: String::from("default material"),
        base_color: Vec3::ONE,
        base_color_texture: None,
        emission: Vec3::ZERO,
        emissive_texture: None,
        two_sided: false,
        alpha_cutoff: None,
        alpha_factor: 1.0,
        reflects: true,
    }
}

impl MaterialTable {
    fn push(
        &mut self,
        source: &gltf::Material,
        unnamed: String,
        json: &Value,
        used: bool,
        notes: &mut Vec<String>,
    ) {
        let ([r, g, b, alpha_factor], base_info) = base_color(source);
        let emission = Vec3::from_array(source.emissive_factor()) * source.emissive_strength().unwrap_or(1.0);
        let emission = emission.clamp(Vec3::ZERO, Vec3::splat(MOST_RADIANCE));
        let emissive_info = source.emissive_texture().filter(|_| emission != Vec3::ZERO);
        let alpha_cutoff =
            (source.alpha_mode() == AlphaMode::Mask).then(|| source.alpha_cutoff().unwrap_or(0.5));
        let reflects = source.alpha_mode() != AlphaMode::Blend && !transmits(source);

        let mask = alpha_cutoff.map(|cutoff| Mask { factor: alpha_factor, cutoff });
        let mut request = |info: &Option<Info>, wanted: bool, mask| {
            info.as_ref().filter(|_| used && wanted).and_then(|info| self.request(info, mask, json, notes))
        };
        let base_color_texture = request(&base_info, reflects, mask);
        let emissive_texture = request(&emissive_info, true, None);
        self.uvs.push(UvSources {
            base_color: base_info.as_ref().map(uv_source),
            emissive: emissive_info.as_ref().map(uv_source),
        });
        self.materials.push(Material {
            name: source.name().map_or(unnamed, str::to_owned),
            // No surface sends back more than it gets, whatever a file says.
            base_color: Vec3::new(r, g, b).clamp(Vec3::ZERO, Vec3::ONE),
            base_color_texture,
            emission,
            emissive_texture,
            two_sided: source.double_sided(),
            alpha_cutoff,
            alpha_factor,
            reflects,
        });
    }

    /// The number of a texture to decode; equal requests share one. `None`, with a note, without a readable image.
    fn request(
        &mut self,
        info: &Info,
        mask: Option<Mask>,
        json: &Value,
        notes: &mut Vec<String>,
    ) -> Option<u32> {
        let texture = info.texture();
        let Some(image) = image_of(json, texture.index()) else {
            let note = format!("/textures/{}: no PNG, JPEG or WebP image; read as white", texture.index());
            if !notes.contains(&note) {
                notes.push(note);
            }
            return None;
        };
        let request = TextureRequest { image, sampling: sampling(&texture), mask };
        let known = self.requests.iter().position(|other| *other == request);
        let number = known.unwrap_or_else(|| {
            self.requests.push(request);
            self.requests.len() - 1
        });
        u32::try_from(number).ok()
    }
}

/// Base colour, or the diffuse colour of the older specular-glossiness model.
fn base_color<'a>(source: &gltf::Material<'a>) -> ([f32; 4], Option<Info<'a>>) {
    if let Some(older) = source.pbr_specular_glossiness() {
        return (older.diffuse_factor(), older.diffuse_texture());
    }
    let pbr = source.pbr_metallic_roughness();
    (pbr.base_color_factor(), pbr.base_color_texture())
}

fn transmits(source: &gltf::Material) -> bool {
    source.transmission().is_some_and(|transmission| transmission.transmission_factor() > 0.0)
}

/// The image of a texture: its WebP version first, as EXT_texture_webp asks of readers that know it.
fn image_of(json: &Value, texture: usize) -> Option<usize> {
    let texture = json.get("textures")?.get(texture)?;
    let webp = texture.pointer("/extensions/EXT_texture_webp/source");
    webp.or(texture.get("source")).and_then(Value::as_u64).and_then(|image| usize::try_from(image).ok())
}

fn sampling(texture: &gltf::Texture) -> Sampling {
    let wrap = |mode| match mode {
        WrappingMode::Repeat => Wrap::Repeat,
        WrappingMode::MirroredRepeat => Wrap::Mirror,
        WrappingMode::ClampToEdge => Wrap::Clamp,
    };
    let sampler = texture.sampler();
    Sampling {
        wrap: [wrap(sampler.wrap_s()), wrap(sampler.wrap_t())],
        nearest: sampler.mag_filter() == Some(MagFilter::Nearest),
    }
}

fn uv_source(info: &Info) -> UvSource {
    let Some(transform) = info.texture_transform() else {
        return UvSource { set: info.tex_coord(), texture_from_vertex: Affine2::IDENTITY };
    };
    UvSource {
        set: transform.tex_coord().unwrap_or(info.tex_coord()),
        texture_from_vertex: texture_from_vertex(transform.offset(), transform.rotation(), transform.scale()),
    }
}

/// KHR_texture_transform: scale, rotate, offset.
///
/// The extension's text shows the rotation matrix transposed; its example (a quarter turn that shows the lower left
/// quadrant) and the readers in use agree on `(u cos + v sin, v cos - u sin)`: counter-clockwise with v pointing down.
fn texture_from_vertex(offset: [f32; 2], rotation: f32, scale: [f32; 2]) -> Affine2 {
    let (sin, cos) = rotation.sin_cos();
    let rotate = Mat2::from_cols_array(&[cos, -sin, sin, cos]);
    Affine2::from_mat2_translation(
        rotate * Mat2::from_diagonal(Vec2::from_array(scale)),
        Vec2::from_array(offset),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec2;
    use std::f32::consts::FRAC_PI_2;

    #[test]
    fn a_quarter_turn_shows_the_lower_left_quadrant() {
        // The example of the extension's text.
        let transform = texture_from_vertex([0.0, 1.0], FRAC_PI_2, [0.5, 0.5]);
        for (vertex, expected) in [
            (vec2(0.0, 0.0), vec2(0.0, 1.0)),
            (vec2(1.0, 0.0), vec2(0.0, 0.5)),
            (vec2(0.0, 1.0), vec2(0.5, 1.0)),
            (vec2(1.0, 1.0), vec2(0.5, 0.5)),
        ] {
            assert!(transform.transform_point2(vertex).abs_diff_eq(expected, 1e-6), "{vertex}");
        }
    }
}

use super::*;
use crate::scene::Surface;
use glam::{Vec2, Vec3, vec3};

const UVS: [[f32; 2]; 3] = [[0.1, 0.2], [0.9, 0.3], [0.4, 0.8]];

/// Repeatable noise; its lower half is darker, so that a mean over the wrong place shows.
fn noise(x: u32, y: u32) -> [u8; 4] {
    let hash = (x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35) >> 24;
    let level = if y < 32 { hash } else { hash / 4 };
    [level as u8, 255 - level as u8, (x * 4) as u8, 255]
}

/// The mean of [`Scene::albedo_at`] over many points, without mip levels.
fn brute_force(scene: &Scene) -> Surface {
    const STEPS: u32 = 300;
    let (mut albedo, mut coverage, mut count) = (Vec3::ZERO, 0.0, 0.0);
    for i in 0..STEPS {
        for j in 0..STEPS - i {
            let (u, v) = ((i as f32 + 0.33) / STEPS as f32, (j as f32 + 0.33) / STEPS as f32);
            let surface = scene.albedo_at(0, vec3(1.0 - u - v, u, v), 0.0);
            albedo += surface.reflectance();
            coverage += surface.coverage;
            count += 1.0;
        }
    }
    Surface { albedo: albedo / coverage, coverage: coverage / count, ..Surface::default() }
}

#[test]
fn the_mean_is_that_of_many_points() {
    let mut builder = Builder::new(&CORNERS);
    builder.texture(64, noise, &UVS)["pbrMetallicRoughness"]["baseColorFactor"] =
        json!([0.5, 1.0, 0.25, 1.0]);
    let colors = builder.floats(&[[1.0, 0.0, 1.0], [0.5, 1.0, 1.0], [1.0, 1.0, 0.0]]);
    builder.primitive()["attributes"]["COLOR_0"] = colors;
    let scene = builder.load().unwrap();
    let (mean, expected) = (scene.mean_surface(0), brute_force(&scene));
    assert!(
        (mean.albedo / expected.albedo - 1.0).abs().max_element() < 0.03,
        "{mean:?} against {expected:?}"
    );
    assert_eq!(mean.coverage, 1.0);
    // The whole image's mean is another: the triangle's place in it counts.
    let whole = scene.textures[0].sample(Vec2::ZERO, 99.0).truncate();
    assert!((mean.albedo / whole - 1.0).abs().max_element() > 0.1);
}

#[test]
fn small_triangles_in_a_palette_take_their_texel_only() {
    let mut builder = Builder::new(&CORNERS);
    let red = |x, _| if x == 40 { [255, 0, 0, 255] } else { [0, 255, 255, 255] };
    builder.texture(64, red, &[[40.5 / 64.0, 0.5]; 3]);
    assert_eq!(builder.load().unwrap().mean_surface(0).albedo, Vec3::X);
}

#[test]
fn masks_weigh_by_coverage() {
    // The left 3/8 is white and covers; the rest is black and does not. The triangle spans the left 3/4.
    let texel = |x, _| if x < 24 { [255, 255, 255, 200] } else { [0, 0, 0, 100] };
    let mut builder = Builder::new(&CORNERS);
    let material = builder.texture(64, texel, &[[0.0, 0.0], [0.75, 0.0], [0.0, 1.0]]);
    material["alphaMode"] = json!("MASK");
    let scene = builder.load().unwrap();
    let mean = scene.mean_surface(0);
    // Half of its height is covered at the base: 1 - (1/2)^2 of its area.
    assert!((mean.coverage - 0.75).abs() < 0.02, "{mean:?}");
    assert!(mean.albedo.abs_diff_eq(Vec3::ONE, 0.02), "what does not cover does not darken: {mean:?}");
    assert!(mean.reflectance().abs_diff_eq(brute_force(&scene).reflectance(), 0.02));

    let mut builder = Builder::new(&CORNERS);
    let material = builder.texture(64, texel, &[[0.0, 0.0], [0.75, 0.0], [0.0, 1.0]]);
    material["alphaMode"] = json!("MASK");
    material["alphaCutoff"] = json!(0.3);
    assert_eq!(builder.load().unwrap().mean_surface(0).coverage, 1.0, "below the cutoff everything covers");
}

#[test]
fn the_footprint_chooses_the_level() {
    let mut builder = Builder::new(&CORNERS);
    let checker = |x: u32, y: u32| if (x + y).is_multiple_of(2) { [255; 4] } else { [0, 0, 0, 255] };
    builder.texture(64, checker, &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    let scene = builder.load().unwrap();
    let (u, v) = (10.5 / 64.0, 20.5 / 64.0);
    let at = vec3(1.0 - u - v, u, v);
    let sharp = scene.albedo_at(0, at, 0.0).albedo.x;
    assert!((sharp - 1.0).abs() < 1e-3, "the centre of a white texel: {sharp}");
    // A sixteenth of the square is 256 texels.
    let blurred = scene.albedo_at(0, at, 1.0 / 16.0).albedo.x;
    assert!((blurred - 0.5).abs() < 0.01, "{blurred}");
}

#[test]
fn texture_transforms_apply_to_the_coordinates() {
    let mut builder = Builder::new(&CORNERS);
    let material = builder.texture(4, |_, _| [255; 4], &UVS);
    material["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({ "KHR_texture_transform": { "offset": [0.5, 0.0], "scale": [2.0, -1.0] } });
    builder.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
    let scene = builder.load().unwrap();
    for (uv, [u, v]) in scene.vertex_uvs.iter().zip(UVS) {
        assert!(uv.abs_diff_eq(Vec2::new(0.5 + 2.0 * u, -v), 1e-6), "{uv}");
    }
}

#[test]
fn glass_reflects_nothing_and_decodes_nothing() {
    for property in [
        json!({ "alphaMode": "BLEND" }),
        json!({ "extensions": { "KHR_materials_transmission": { "transmissionFactor": 0.9 } } }),
    ] {
        let mut builder = Builder::new(&CORNERS);
        let material = builder.texture(4, |_, _| [255; 4], &UVS);
        for (key, value) in property.as_object().unwrap() {
            material[key] = value.clone();
        }
        let scene = builder.load().unwrap();
        assert_eq!(scene.mean_surface(0).albedo, Vec3::ZERO, "{property}");
        assert!(scene.textures.is_empty() && !scene.materials[0].reflects);
    }
}

#[test]
fn emission_is_factor_times_strength_times_texture() {
    let mut builder = Builder::new(&CORNERS);
    let material = builder.texture(4, |_, _| [188, 0, 255, 255], &UVS);
    *material = json!({
        "emissiveFactor": [1.0, 1.0, 0.5],
        "emissiveTexture": { "index": 0 },
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 100.0 } },
    });
    let scene = builder.load().unwrap();
    assert!(scene.mean_surface(0).emission.abs_diff_eq(vec3(50.288_65, 0.0, 50.0), 1e-3));
    assert_eq!(scene.mean_surface(0).albedo, Vec3::ONE);
}

#[test]
fn specular_glossiness_gives_its_diffuse_colour() {
    let mut builder = Builder::new(&CORNERS);
    builder.material(json!({
        "extensions": { "KHR_materials_pbrSpecularGlossiness": { "diffuseFactor": [0.25, 0.5, 0.75, 1.0] } },
    }));
    assert_eq!(builder.load().unwrap().mean_surface(0).albedo, vec3(0.25, 0.5, 0.75));
}

#[test]
fn broken_images_become_white_and_a_note() {
    let mut builder = Builder::new(&CORNERS);
    builder.texture(4, noise, &UVS);
    let view = builder.view(b"no image at all");
    builder.json["images"][0]["bufferView"] = view;
    let scene = builder.load().unwrap();
    assert_eq!(scene.mean_surface(0).albedo, Vec3::ONE);
    assert!(scene.notes.iter().any(|note| note.starts_with("/images/0")), "{:?}", scene.notes);
}

#[test]
fn primitives_without_material_have_the_default_one() {
    let scene = Builder::new(&CORNERS).load().unwrap();
    assert_eq!(scene.materials.len(), 1);
    let white = Surface { albedo: Vec3::ONE, painted: Vec3::ONE, coverage: 1.0, emission: Vec3::ZERO };
    assert_eq!(scene.mean_surface(0), white);
}

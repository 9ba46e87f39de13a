//! Target: whatever the bytes, a file opens or is refused; what opened can be walked, written, read again and stripped.

use gltf::camera::Projection;
use gltf::khr_lights_punctual::Kind as LightKind;
use vlm_format::{
    Code, Container, Error, GltfFile, Kind, Target, VlmAsset, WriteOptions, read_vlm, read_vlm_unchecked,
    strip_vlm, write_vlm_with,
};

use super::Reached;
use crate::sample_asset::quads;

/// Opens a file, reads everything that it holds, and takes a small asset into it and out again.
///
/// # Panics
/// Where the library panics, or where what it wrote is not what it reads.
pub fn format_reader(bytes: &[u8]) -> Reached {
    let file = match GltfFile::from_slice(bytes, "fuzzed", None) {
        Ok(file) => file,
        Err(error) => {
            assert_one_line(&error);
            return Reached::Refused;
        }
    };
    read_accessors(&file);
    walk(&file);
    for outcome in [read_vlm(&file), read_vlm_unchecked(&file)] {
        _ = outcome.map_err(|error| assert_one_line(&error));
    }
    let asset = quads(&file);
    for compress in [false, true] {
        if !round_trip(&file, &asset, compress) {
            return Reached::Opened;
        }
    }
    Reached::Done
}

/// Every error is a line that says something.
fn assert_one_line(error: &Error) {
    let text = error.to_string();
    assert!(!text.chars().any(|c| matches!(c, '\n' | '\r')), "more than a line: {text}");
    assert!(text.len() < 2000, "{} bytes of error: {text}", text.len());
}

fn read_accessors(file: &GltfFile) {
    for accessor in file.document().accessors() {
        let index = accessor.index();
        _ = file.read_floats(index).and_then(|_| file.read_positions(index));
        _ = (file.read_indices(index, 3), file.read_colors(index), file.read_mat4(index));
    }
}

/// Follows every reference of the typed view.
fn walk(file: &GltfFile) {
    let document = file.document();
    for image in document.images() {
        _ = (file.image_bytes(image.index()), image.source());
    }
    for scene in document.scenes() {
        _ = scene.nodes().map(|node| node.children().count()).sum::<usize>();
    }
    for node in document.nodes() {
        _ = (node.transform().matrix(), node.light().map(|light| matches!(light.kind(), LightKind::Point)));
        _ = node.camera().map(|camera| matches!(camera.projection(), Projection::Perspective(_)));
        _ = (node.mesh(), node.skin().map(|skin| skin.joints().count()));
    }
    for primitive in document.meshes().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>()) {
        _ = (primitive.attributes().count(), primitive.mode(), primitive.indices());
        let material = primitive.material();
        _ = (material.alpha_mode(), material.emissive_strength(), material.pbr_metallic_roughness());
        let texture = material.emissive_texture().map(|info| (info.texture_transform(), info.texture()));
        let Some((_, texture)) = texture else { continue };
        _ = (texture.source(), texture.sampler().wrap_s(), texture.sampler().mag_filter());
    }
}

/// Writes, reads and strips an asset; false if the file cannot take it, for a reason of its own.
fn round_trip(file: &GltfFile, asset: &VlmAsset, compress: bool) -> bool {
    let target = target(file);
    let outputs = match write_vlm_with(file, asset, &target, &WriteOptions { compress }) {
        Ok(outputs) => outputs,
        Err(error) => {
            assert_foreign(&error);
            return false;
        }
    };
    let written = opened(&outputs[0].bytes);
    let read = read_vlm(&written).unwrap_or_else(|error| panic!("{error}"));
    assert!(read.as_ref() == Some(asset), "what is read differs from what was written");

    let stripped = strip_vlm(&written, &target).unwrap_or_else(|error| panic!("{error}"));
    let before = strip_vlm(file, &target).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(opened(&stripped[0].bytes).json(), opened(&before[0].bytes).json(), "not as it was before");
    true
}

/// The container of the file, with all data inside.
fn target(file: &GltfFile) -> Target {
    let container = match file.kind() {
        Kind::Glb => Container::Glb,
        Kind::Gltf => Container::Gltf { embedded: true },
    };
    Target { container, file_name: String::from("out.glb") }
}

fn opened(bytes: &[u8]) -> GltfFile {
    GltfFile::from_slice(bytes, "written", None)
        .unwrap_or_else(|error| panic!("what was written does not open: {error}"))
}

/// The file's geometry cannot be read, or its transforms make slivers of any light: no fault of the asset.
fn assert_foreign(error: &Error) {
    match error {
        Error::Invalid { .. } => assert_one_line(error),
        Error::Asset { issues } if issues.iter().all(|issue| issue.code == Code::VlmAspect) => {}
        other => panic!("{other}"),
    }
}

//! Opens every file of the corpus, valid or not: no panic, no hang, and every refusal says where, what and what to do.

#![allow(clippy::unwrap_used, reason = "what cannot be unwrapped fails the test")]

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

use vlm_format::{Error, GltfFile};

/// Opens a file and decodes everything that it holds.
fn decode_all(path: &Path) -> Result<(), Error> {
    let file = GltfFile::open(path)?;
    for accessor in file.document().accessors() {
        file.read_floats(accessor.index())?;
    }
    for mesh in file.document().meshes() {
        for primitive in mesh.primitives() {
            for (semantic, accessor) in primitive.attributes() {
                assert_eq!(primitive.get(&semantic).unwrap().index(), accessor.index());
            }
            let Some(positions) = primitive.get(&gltf::Semantic::Positions) else { continue };
            let positions = file.read_positions(positions.index())?;
            if let Some(indices) = primitive.indices() {
                file.read_indices(indices.index(), positions.len())?;
            }
            let _ = primitive
                .material()
                .pbr_metallic_roughness()
                .base_color_texture()
                .map(|info| info.texture().source());
        }
    }
    for node in file.document().nodes() {
        let _ = (node.transform().matrix(), node.light().map(|light| light.kind()), node.children().count());
        let _ = (
            node.camera()
                .map(|camera| matches!(camera.projection(), gltf::camera::Projection::Perspective(_))),
            node.skin().map(|skin| skin.joints().count()),
        );
    }
    Ok(())
}

#[test]
#[cfg_attr(not(has_corpus), ignore = "the corpus is neither in VLM_ASSETS nor in ../shared/assets")]
fn every_file_opens_or_is_refused_with_reason_and_remedy() {
    let Some(corpus) = vlm_tests::assets::find("corpus") else { return };
    let files = vlm_tests::assets::gltf_files(&corpus);
    assert!(files.len() >= 234, "only {} files in the corpus", files.len());

    let mut outcomes: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for path in &files {
        let start = Instant::now();
        let outcome = match decode_all(path) {
            Ok(()) => String::from("opened"),
            Err(Error::Invalid { issues, file }) => {
                let first = &issues[0];
                assert!(!first.message.is_empty() && !first.code.remedy().is_empty());
                println!("{}", Error::Invalid { issues: issues.clone(), file });
                first.code.as_str().to_owned()
            }
            Err(other) => panic!("{}: unexpected kind of error: {other}", path.display()),
        };
        assert!(start.elapsed() < Duration::from_secs(5), "{} took {:?}", path.display(), start.elapsed());
        outcomes.entry(outcome).or_default().push(path.strip_prefix(&corpus).unwrap().display().to_string());
    }
    for (outcome, files) in &outcomes {
        println!("{:>4}  {outcome:24} {}", files.len(), files[0]);
    }
}

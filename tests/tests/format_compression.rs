//! Compressed arrays: the same asset as without, in fewer bytes, and whatever damages them is refused by name.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use serde_json::{Value, json};
use vlm_format::{
    Code, Container, EXTENSION, Error, GltfFile, OutputFile, Target, VlmAsset, WriteOptions, read_vlm,
    read_vlm_unchecked, strip_vlm, write_vlm, write_vlm_with,
};
use vlm_tests::assets;
use vlm_tests::random;
use vlm_tests::sample_asset::{many_quads, room};

const COMPRESSED: WriteOptions = WriteOptions { compress: true };

fn target(container: Container) -> Target {
    Target {
        container,
        file_name: String::from(if container == Container::Glb { "a.glb" } else { "a.gltf" }),
    }
}

fn embedded() -> Target {
    target(Container::Gltf { embedded: true })
}

fn asset() -> VlmAsset {
    many_quads(&room(), 50)
}

fn compressed(target: &Target) -> Vec<u8> {
    write_vlm_with(&room(), &asset(), target, &COMPRESSED).unwrap().swap_remove(0).bytes
}

fn plain(target: &Target) -> Vec<u8> {
    write_vlm(&room(), &asset(), target).unwrap().swap_remove(0).bytes
}

fn json_of(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

fn open(bytes: &[u8]) -> GltfFile {
    GltfFile::from_slice(bytes, "a.gltf", None).unwrap()
}

/// Every array of the root object: its pointer and JSON.
fn arrays(json: &Value) -> Vec<(String, &Value)> {
    let root = &json["extensions"][EXTENSION];
    let groups = ["lights", "samples", "grid"].into_iter();
    let all = groups.flat_map(|group| {
        root[group]
            .as_object()
            .unwrap()
            .iter()
            .map(move |(key, value)| (format!("/extensions/{EXTENSION}/{group}/{key}"), value))
    });
    all.filter(|(_, value)| value.get("accessor").is_some()).collect()
}

#[test]
fn the_asset_is_the_same_and_the_file_smaller() {
    let (small, large) = (compressed(&target(Container::Glb)), plain(&target(Container::Glb)));
    assert!(2 * small.len() < large.len(), "{} of {}", small.len(), large.len());
    assert_eq!(read_vlm(&open(&small)).unwrap(), Some(asset()));
    assert_ne!(read_vlm(&open(&small)).unwrap(), Some(many_quads(&room(), 49)));

    let (small, large) = (json_of(&compressed(&embedded())), json_of(&plain(&embedded())));
    let mut modes = Vec::new();
    for ((pointer, array), (_, before)) in arrays(&small).into_iter().zip(arrays(&large)) {
        assert_eq!(array["digest"], before["digest"], "{pointer}: digests cover what is decoded");
        modes.extend(array.get("compression").map(|codec| codec["mode"].as_str().unwrap().to_owned()));
        assert_eq!(before.get("compression"), None, "{pointer}");
    }
    assert!(modes.len() >= 10 && modes.len() < arrays(&small).len(), "{modes:?}");
    assert!(["ATTRIBUTES", "INDICES"].iter().all(|mode| modes.iter().any(|found| found == mode)));
}

#[test]
fn stored_sizes_are_those_of_the_file() {
    let (small, large) = (open(&compressed(&embedded())), open(&plain(&embedded())));
    let stored = |file: &GltfFile, array: &str| file.stored_vlm_bytes(&format!("grid/{array}"));
    let mut smaller = 0;
    for (array, bytes) in asset().grid.unwrap().sizes() {
        assert_eq!(stored(&large, array), bytes as u64, "{array}");
        let codec =
            small.json().pointer(&format!("/extensions/{EXTENSION}/grid/{array}/compression/byteLength"));
        let expected = codec.map_or(bytes as u64, |length| length.as_u64().unwrap());
        assert_eq!(stored(&small, array), expected, "{array}");
        smaller += usize::from(expected < bytes as u64);
    }
    assert!(smaller > 2);
    assert_eq!(stored(&small, "nothing"), 0);
}

#[test]
fn bytes_are_the_same_however_often_and_from_whatever_they_are_written() {
    let glb = target(Container::Glb);
    let first = compressed(&glb);
    assert!(first == compressed(&glb), "the second time");
    let again = |bytes: &[u8], options: &WriteOptions| {
        write_vlm_with(&open(bytes), &asset(), &glb, options).unwrap().swap_remove(0).bytes
    };
    // What follows starts from GLBs, as the room itself is a .gltf with its data inside.
    let base = strip_vlm(&room(), &glb).unwrap().swap_remove(0).bytes;
    let written = again(&base, &COMPRESSED);
    assert!(again(&written, &COMPRESSED) == written, "over itself");
    let decompressed = again(&written, &WriteOptions::default());
    assert!(decompressed == again(&base, &WriteOptions::default()), "over what is compressed");
    assert!(again(&decompressed, &COMPRESSED) == written, "over what is not");
    assert_ne!(decompressed.len(), written.len());
}

#[test]
#[cfg_attr(not(has_corpus), ignore = "the corpus is neither in VLM_ASSETS nor in ../shared/assets")]
fn stripping_gives_back_every_byte() {
    let Some(path) = assets::find("corpus/trimesh/CesiumMilkTruck.glb") else { return };
    let file = GltfFile::open(&path).unwrap();
    let glb = target(Container::Glb);
    let asset = many_quads(&file, 50);
    let bytes = |outputs: Vec<OutputFile>| outputs.into_iter().next().unwrap().bytes;
    let written = bytes(write_vlm_with(&file, &asset, &glb, &COMPRESSED).unwrap());
    assert_eq!(read_vlm(&open(&written)).unwrap().as_ref(), Some(&asset));
    let tags = &asset.triangle_tags[0];
    let place = format!("/meshes/{}/primitives/{}/extensions/{EXTENSION}", tags.mesh, tags.primitive);
    let mode = open(&written).json().pointer(&format!("{place}/triangleTags/compression/mode")).cloned();
    assert_eq!(mode, Some(json!("ATTRIBUTES")), "tags by triangle are compressed, too");

    let before = bytes(strip_vlm(&file, &glb).unwrap());
    assert_ne!(written, before);
    assert!(bytes(strip_vlm(&open(&written), &glb).unwrap()) == before);
    assert_eq!(open(&before).json().to_string(), file.json().to_string());
}

/// Reads a file whose JSON was changed.
fn read_changed(change: impl FnOnce(&mut Value)) -> Result<Option<VlmAsset>, Error> {
    let mut json = json_of(&compressed(&embedded()));
    change(&mut json);
    read_vlm(&open(json.to_string().as_bytes()))
}

fn in_root<'a>(json: &'a mut Value, array: &str) -> &'a mut Value {
    json.pointer_mut(&format!("/extensions/{EXTENSION}/{array}")).unwrap()
}

#[test]
fn hostile_properties_are_invalid_by_code_and_place() {
    for (key, value, code) in [
        ("mode", json!("TRIANGLES"), Code::WrongValue),
        ("mode", json!("INDICES"), Code::Compression),
        ("count", json!(u64::MAX), Code::AccessorTooLarge),
        ("count", json!(1_u64 << 40), Code::AccessorTooLarge),
        ("count", json!(-1), Code::WrongType),
        ("byteStride", json!(0), Code::WrongType),
        ("byteStride", json!(20), Code::Compression),
        ("byteLength", json!("all"), Code::WrongType),
    ] {
        let read = read_changed(|json| in_root(json, "lights/positions")["compression"][key] = value.clone());
        let Err(Error::Invalid { issues, .. }) = read else { panic!("{key} {value}: {read:?}") };
        let pointer = format!("/extensions/{EXTENSION}/lights/positions/compression/{key}");
        let pointer = if key == "mode" && code == Code::Compression {
            pointer.replace("/mode", "/byteStride")
        } else {
            pointer
        };
        assert_eq!((issues[0].code, issues[0].pointer.as_str()), (code, pointer.as_str()), "{}", issues[0]);
    }
    assert!(read_changed(|_| ()).is_ok_and(|asset| asset.is_some()));
}

#[test]
fn streams_that_do_not_decode_are_invalid_and_unchecked_reading_says_so_too() {
    let mut json = json_of(&compressed(&embedded()));
    let count = &mut in_root(&mut json, "grid/uncovered")["compression"]["count"];
    *count = json!(count.as_u64().unwrap() / 3);
    let file = open(json.to_string().as_bytes());
    for read in [read_vlm(&file), read_vlm_unchecked(&file)] {
        let Err(Error::Invalid { issues, .. }) = read else { panic!("{read:?}") };
        let pointer = format!("/extensions/{EXTENSION}/grid/uncovered/compression");
        assert_eq!((issues[0].code, issues[0].pointer.as_str()), (Code::Compression, pointer.as_str()));
    }
}

#[test]
fn what_other_tools_moved_is_stale() {
    let stale = |change: &dyn Fn(&mut Value), part: &str| {
        let read = read_changed(change);
        let Err(error @ Error::Stale { .. }) = read else { panic!("{part}: {read:?}") };
        assert!(error.to_string().contains(part), "`{part}` is missing in: {error}");
    };
    let accessor =
        |json: &mut Value, array: &str| in_root(json, array)["accessor"].as_u64().unwrap() as usize;
    stale(
        &|json| {
            let (a, b) = (accessor(json, "lights/positions"), accessor(json, "lights/indices"));
            json["accessors"].as_array_mut().unwrap().swap(a, b);
        },
        "`lights/positions` was renumbered or altered by another tool (it has another length)",
    );
    stale(
        &|json| {
            in_root(json, "lights/positions").as_object_mut().unwrap().remove("compression");
        },
        "`lights/positions` was renumbered or altered",
    );
    // An accessor without data has zeros, at no cost to the file, and so does one in a buffer view that is compressed again.
    stale(
        &|json| {
            let at = accessor(json, "lights/positions");
            json["accessors"][at].as_object_mut().unwrap().remove("bufferView");
        },
        "it does not lie in the buffer view of the extension",
    );
    stale(
        &|json| {
            let at = accessor(json, "lights/positions");
            json["accessors"][at]["bufferView"] = json!(0);
            json["accessors"][at]["byteOffset"] = json!(0);
            json["accessors"][at]["count"] = json!(36);
        },
        "it does not lie in the buffer view of the extension",
    );
    stale(&|json| in_root(json, "lights")["tags"]["compression"] = json!(3), "another tool altered the file");
}

#[test]
fn arrays_cannot_claim_the_same_bytes_again_and_again() {
    // The largest array, for all of its kind: together they would claim more than the buffer view has.
    let read = read_changed(|json| {
        let largest = in_root(json, "samples/positions").clone();
        for array in
            ["lights/positions", "lights/albedo", "lights/emission", "samples/normals", "samples/reflectance"]
        {
            *in_root(json, array) = largest.clone();
        }
        let view = json["extensions"][EXTENSION]["data"]["bufferView"].as_u64().unwrap() as usize;
        let length = largest["compression"]["byteLength"].as_u64().unwrap();
        let accessor = largest["accessor"].as_u64().unwrap() as usize;
        let offset = std::mem::replace(&mut json["accessors"][accessor]["byteOffset"], json!(0));
        let start = json["bufferViews"][view]["byteOffset"].as_u64().unwrap_or(0) + offset.as_u64().unwrap();
        json["bufferViews"][view]["byteOffset"] = json!(start);
        json["bufferViews"][view]["byteLength"] = json!(length);
        let accessors = json["accessors"].as_array_mut().unwrap();
        for (i, other) in accessors.iter_mut().enumerate() {
            if i != accessor && other["bufferView"] == json!(view) {
                other["count"] = json!(1);
                other["byteOffset"] = json!(0);
            }
        }
    });
    let Err(error @ Error::Stale { .. }) = read else { panic!("{read:?}") };
    assert!(format!("{error:?}").contains("the arrays claim more than there is"), "{error:?}");
}

/// Where the extension's data begins in a GLB, which ends with it.
fn data_start(bytes: &[u8]) -> usize {
    let file = open(bytes);
    let view = file.json()["bufferViews"].as_array().unwrap().last().unwrap();
    let buffer =
        file.json()["buffers"][view["buffer"].as_u64().unwrap() as usize]["byteLength"].as_u64().unwrap();
    let length = buffer - view["byteOffset"].as_u64().unwrap_or(0);
    bytes.len() - length as usize
}

#[test]
fn flipped_bytes_give_the_same_asset_or_a_typed_error() {
    let base = strip_vlm(&room(), &target(Container::Glb)).unwrap().swap_remove(0).bytes;
    let bytes = write_vlm_with(&open(&base), &asset(), &target(Container::Glb), &COMPRESSED).unwrap();
    let bytes = bytes.into_iter().next().unwrap().bytes;
    let start = data_start(&bytes);
    let mut drawn = 0;
    let mut below = |limit: usize| {
        drawn += 1;
        (random::bits(1, drawn) % limit as u64) as usize
    };
    let (mut invalid, mut stale, mut same) = (0, 0, 0);
    for _ in 0..4000 {
        let mut damaged = bytes.clone();
        for _ in 0..=below(3) {
            let at = start + below(bytes.len() - start);
            damaged[at] ^= 1 << below(8);
        }
        let file = open(&damaged);
        let _ = read_vlm_unchecked(&file);
        match read_vlm(&file) {
            // Padding, and what a decoder skips.
            Ok(found) => {
                assert_eq!(found, Some(asset()), "damage that was not seen");
                same += 1;
            }
            Err(Error::Invalid { issues, .. }) => {
                assert!(issues.iter().all(|issue| issue.pointer.contains(EXTENSION)), "{issues:?}");
                invalid += 1;
            }
            Err(Error::Stale { .. }) => stale += 1,
            Err(other) => panic!("{other}"),
        }
    }
    assert!(invalid > 100 && stale > 100 && same < 400, "{invalid} invalid, {stale} stale, {same} the same");
    println!("{invalid} invalid, {stale} stale, {same} the same");
}

#[test]
fn cuts_and_changed_numbers_never_panic() {
    let bytes = compressed(&target(Container::Glb));
    for end in (0..bytes.len()).step_by(97) {
        assert!(GltfFile::from_slice(&bytes[..end], "cut", None).is_err(), "{end}");
    }
    let json = json_of(&compressed(&embedded()));
    let values = [
        json!(0),
        json!(1),
        json!(4),
        json!(64),
        json!(1000),
        json!(u64::MAX),
        json!(null),
        json!("NONE"),
        json!({}),
    ];
    let compressed: Vec<String> = arrays(&json)
        .into_iter()
        .filter(|(_, array)| array.get("compression").is_some())
        .map(|(p, _)| p)
        .collect();
    for pointer in &compressed {
        for key in ["mode", "count", "byteStride", "byteLength", "filter"] {
            for value in &values {
                let mut damaged = json.clone();
                let before = &mut damaged.pointer_mut(pointer).unwrap()["compression"][key];
                // The property `filter` is unknown: those of `EXT_meshopt_compression` are not without loss.
                let harmless = before == value || key == "filter";
                *before = value.clone();
                match read_vlm(&open(damaged.to_string().as_bytes())) {
                    Ok(found) => {
                        assert_eq!(found, Some(asset()));
                        assert!(harmless, "{pointer}/{key} = {value} does no harm");
                    }
                    Err(Error::Invalid { .. } | Error::Stale { .. }) => {
                        assert!(!harmless, "{pointer}/{key} = {value} is refused");
                    }
                    Err(other) => panic!("{other}"),
                }
            }
        }
    }
    assert!(compressed.len() >= 10);
}

//! The rules of the visible surface's tags.

use super::Issues;
use crate::asset::VlmAsset;
use crate::check::array;
use crate::container::GltfFile;
use crate::error::Code;

/// Each list is sorted, names nothing twice, and holds no entry that says nothing.
pub(super) fn tags(asset: &VlmAsset, issues: &mut Issues) {
    let VlmAsset { primitive_tags: primitives, triangle_tags: triangles, node_tags: nodes, .. } = asset;
    ascending(
        primitives,
        "/primitive_tags",
        "a primitive",
        |&(mesh, primitive, _)| (mesh, primitive),
        issues,
    );
    ascending(triangles, "/triangle_tags", "a primitive", |tags| (tags.mesh, tags.primitive), issues);
    ascending(nodes, "/node_tags", "a node", |&(node, _)| node, issues);

    issues.check_all(primitives, Code::VlmNumber, "/primitive_tags", "the tag is 0", |entry| entry.2 != 0);
    issues.check_all(triangles, Code::VlmNumber, "/triangle_tags", "every tag is 0", |entry| {
        entry.tags.iter().any(|&tag| tag != 0)
    });
    issues.check_all(nodes, Code::VlmNumber, "/node_tags", "the tag is 0", |entry| entry.1 != 0);

    const TWICE: &str = "the primitive has a tag as a whole, too";
    issues.check_all(triangles, Code::VlmOrder, "/triangle_tags", TWICE, |entry| {
        primitives.binary_search_by_key(&(entry.mesh, entry.primitive), |&(m, p, _)| (m, p)).is_err()
    });
}

fn ascending<T, K: Ord>(list: &[T], pointer: &str, item: &str, key: fn(&T) -> K, issues: &mut Issues) {
    let sorted = list.is_sorted_by(|a, b| key(a) < key(b));
    issues.check(sorted, Code::VlmOrder, pointer, || format!("not sorted, or {item} occurs twice"));
}

/// What is tagged exists, and each of a primitive's triangles has one tag.
pub(super) fn in_file(file: &GltfFile, asset: &VlmAsset, issues: &mut Issues) {
    const NO_PRIMITIVE: &str = "there is no such primitive";
    let exists = |mesh: u32, primitive: u32| file.triangle_count(mesh, primitive).is_some();
    issues.check_all(&asset.primitive_tags, Code::VlmNode, "/primitive_tags", NO_PRIMITIVE, |entry| {
        exists(entry.0, entry.1)
    });
    issues.check_all(&asset.triangle_tags, Code::VlmNode, "/triangle_tags", NO_PRIMITIVE, |entry| {
        exists(entry.mesh, entry.primitive)
    });
    let nodes = array(file.json(), "/nodes").len();
    issues.check_all(&asset.node_tags, Code::VlmNode, "/node_tags", "there is no such node", |entry| {
        (entry.0 as usize) < nodes
    });
    for (i, entry) in asset.triangle_tags.iter().enumerate() {
        let drawn = file.triangle_count(entry.mesh, entry.primitive).unwrap_or(entry.tags.len());
        issues.check(entry.tags.len() == drawn, Code::VlmLength, &format!("/triangle_tags/{i}"), || {
            format!("{} tags for {drawn} triangles", entry.tags.len())
        });
    }
}

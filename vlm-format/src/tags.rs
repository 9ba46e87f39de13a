//! Tags of the visible surface: which lights a receiver ignores.

use serde_json::Value;

use crate::asset::VlmAsset;
use crate::check::{array, count, index};
use crate::container::GltfFile;

/// Tags of a visible primitive whose triangles differ.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TriangleTags {
    /// Index of the glTF mesh.
    pub mesh: u32,
    /// Index of the primitive within the mesh.
    pub primitive: u32,
    /// One tag per triangle in the order in which the primitive draws them, 0 for none; not all are 0. Triangles without
    /// area count: [`GltfFile::triangle_count`] of them.
    pub tags: Vec<u32>,
}

impl VlmAsset {
    /// The tag of a receiver, 0 for none: lights of the same tag never light it.
    ///
    /// `node` is the glTF node that is drawn, `triangle` the index within the primitive as drawn. The node's own tag comes
    /// first, then that of the whole primitive, then that of the triangle. Relies on the order of the lists, which
    /// [`validate`](crate::validate) checks; takes the logarithm of their lengths.
    #[must_use]
    pub fn tag_of(&self, node: u32, mesh: u32, primitive: u32, triangle: u32) -> u32 {
        let key = (mesh, primitive);
        let of_node = || {
            let found = self.node_tags.binary_search_by_key(&node, |&(node, _)| node).ok()?;
            self.node_tags.get(found).map(|&(_, tag)| tag)
        };
        let of_primitive = || {
            let found = self.primitive_tags.binary_search_by_key(&key, |&(m, p, _)| (m, p)).ok()?;
            self.primitive_tags.get(found).map(|&(_, _, tag)| tag)
        };
        let of_triangle = || {
            let found = self.triangle_tags.binary_search_by_key(&key, |t| (t.mesh, t.primitive)).ok()?;
            self.triangle_tags.get(found)?.tags.get(triangle as usize).copied()
        };
        of_node().or_else(of_primitive).or_else(of_triangle).unwrap_or(0)
    }
}

impl GltfFile {
    /// How many triangles a primitive draws, those without area counted; 0 for points and lines, `None` if there is no such
    /// primitive.
    ///
    /// glTF 2.0 specification, section 3.7.2.1: three corners each in a list, one more each after the first two in a strip
    /// or fan.
    #[must_use]
    pub fn triangle_count(&self, mesh: u32, primitive: u32) -> Option<usize> {
        let mesh = array(self.json(), "/meshes").get(mesh as usize)?;
        let primitive = array(mesh, "/primitives").get(primitive as usize)?;
        let positions = primitive.get("attributes").and_then(|attributes| index(attributes, "POSITION"));
        let Some(positions) = positions else { return Some(0) };
        let corners = elements(self.json(), index(primitive, "indices").unwrap_or(positions));
        Some(match count(primitive, "mode").unwrap_or(4) {
            4 => corners / 3,
            5 | 6 => corners.saturating_sub(2),
            _ => 0,
        })
    }
}

/// The number of elements that an accessor claims.
pub(crate) fn elements(root: &Value, accessor: usize) -> usize {
    let json = array(root, "/accessors").get(accessor);
    json.and_then(|json| index(json, "count")).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn nodes_come_before_primitives_and_those_before_triangles() {
        let triangles = |mesh, tags: &[u32]| TriangleTags { mesh, primitive: 1, tags: tags.to_vec() };
        let asset = VlmAsset {
            node_tags: vec![(3, 9), (5, 8)],
            primitive_tags: vec![(0, 0, 1), (2, 0, 2)],
            triangle_tags: vec![triangles(0, &[0, 4, 5]), triangles(2, &[6])],
            ..VlmAsset::default()
        };
        for (place, expected) in [
            ((0, 0, 0, 7), 1),
            ((0, 2, 0, 0), 2),
            ((0, 0, 1, 0), 0),
            ((0, 0, 1, 1), 4),
            ((0, 0, 1, 2), 5),
            ((0, 0, 1, 3), 0),
            ((0, 2, 1, 0), 6),
            ((0, 1, 1, 0), 0),
            ((3, 0, 0, 0), 9),
            ((5, 0, 1, 1), 8),
            ((4, 0, 1, 1), 4),
        ] {
            let (node, mesh, primitive, triangle) = place;
            assert_eq!(asset.tag_of(node, mesh, primitive, triangle), expected, "{place:?}");
        }
    }

    #[test]
    fn lists_strips_and_fans_are_counted_as_drawn() {
        let accessor = |count: u32| json!({ "componentType": 5126, "count": count, "type": "VEC3", "max": [0], "min": [0] });
        let indices = json!({ "componentType": 5123, "count": 7, "type": "SCALAR" });
        let primitive = |mode: u32, indexed: bool| {
            let mut json = json!({ "attributes": { "POSITION": 0 }, "mode": mode });
            if indexed {
                json["indices"] = json!(2);
            }
            json
        };
        let mut list = primitive(4, false);
        list.as_object_mut().unwrap().remove("mode");
        let primitives = [
            list,
            primitive(4, true),
            primitive(5, true),
            primitive(6, false),
            primitive(1, false),
            json!({ "attributes": { "POSITION": 1 }, "mode": 5 }),
            json!({ "attributes": {} }),
        ];
        let json = json!({
            "asset": { "version": "2.0" },
            "meshes": [{ "primitives": primitives }],
            "accessors": [accessor(9), accessor(1), indices],
        });
        let file = GltfFile::from_slice(json.to_string().as_bytes(), "modes.gltf", None).unwrap();
        let counts: Vec<_> = (0..8).map(|primitive| file.triangle_count(0, primitive)).collect();
        assert_eq!(counts, [Some(3), Some(2), Some(5), Some(7), Some(0), Some(0), Some(0), None]);
        assert_eq!(file.triangle_count(1, 0), None);
    }
}

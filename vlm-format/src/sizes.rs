//! What the Virtual Light Meshes take of a file, in bytes.

use serde_json::Value;

use crate::check::layout::element_bytes;
use crate::check::{array, count, index};
use crate::container::GltfFile;
use crate::strip::EXTENSION;

impl GltfFile {
    /// Bytes of the file itself and of the buffers beside it; images beside it are not counted.
    #[must_use]
    pub fn total_bytes(&self) -> u64 {
        let beside = array(self.json(), "/buffers")
            .iter()
            .enumerate()
            .filter(|(_, buffer)| buffer.get("uri").and_then(Value::as_str).is_some_and(|uri| !is_data(uri)));
        let beside: usize = beside.filter_map(|(i, _)| self.buffer(i)).map(<[u8]>::len).sum();
        (self.main_bytes() + beside) as u64
    }

    /// Bytes that the tags by triangle take in the file, as [`GltfFile::stored_vlm_bytes`] says.
    #[must_use]
    pub fn stored_triangle_tag_bytes(&self) -> u64 {
        let own = self.vlm_objects().filter_map(|own| own.get("triangleTags"));
        let accessors = own.filter_map(|tags| array(self.json(), "/accessors").get(index(tags, "accessor")?));
        accessors.map(|json| count(json, "count").unwrap_or(0).saturating_mul(element_bytes(json))).sum()
    }

    /// Bytes of the JSON of the extension, on one line: its objects, accessors and buffer view.
    #[must_use]
    pub fn vlm_json_bytes(&self) -> u64 {
        let view = self.vlm_view();
        let accessors = array(self.json(), "/accessors").iter();
        let ours = accessors.filter(|accessor| view.is_some() && index(accessor, "bufferView") == view);
        let views = view.and_then(|view| array(self.json(), "/bufferViews").get(view));
        let bytes = |json: &Value| json.to_string().len() as u64;
        self.vlm_objects().chain(ours).chain(views).map(bytes).sum()
    }

    /// True if the arrays stand in the JSON as base64: a third more bytes in the file than they have.
    #[must_use]
    pub fn has_embedded_vlm(&self) -> bool {
        let view = self.vlm_view().and_then(|view| array(self.json(), "/bufferViews").get(view));
        let buffer = view.and_then(|view| array(self.json(), "/buffers").get(index(view, "buffer")?));
        buffer.and_then(|buffer| buffer.get("uri")?.as_str()).is_some_and(is_data)
    }

    fn vlm_view(&self) -> Option<usize> {
        index(self.json().pointer(&format!("/extensions/{EXTENSION}/data"))?, "bufferView")
    }

    /// The extension's objects in the root, in nodes and in primitives.
    fn vlm_objects(&self) -> impl Iterator<Item = &Value> {
        let primitives = array(self.json(), "/meshes").iter().flat_map(|mesh| array(mesh, "/primitives"));
        let items = std::iter::once(self.json()).chain(array(self.json(), "/nodes")).chain(primitives);
        items.filter_map(|item| item.get("extensions")?.get(EXTENSION))
    }
}

fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

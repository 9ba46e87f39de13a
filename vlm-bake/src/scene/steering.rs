//! What artists say of an object's light: `extras.vlm` on a node or mesh, and the names that make a mesh a VLM.

use super::{AuthoredMode, Error, Steering};
use glam::Vec3;
use serde_json::Value;

/// Every key of `extras.vlm`.
const KEYS: [&str; 7] = ["intensity", "tint", "tag", "exclude", "density", "mode", "volume"];

/// What a node and its mesh ask for together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Request {
    pub steering: Steering,
    /// The mesh is an authored VLM.
    pub authored: Option<AuthoredMode>,
    /// The mesh is no surface and no VLM: its box is where moving objects need light.
    pub volume: bool,
}

/// Reads `extras.vlm` of a node and of its mesh; where both have a key, the node's counts.
///
/// A mesh is an authored VLM if its or the node's name says so, or if `extras.vlm.mode` does. Keys that nobody knows
/// make a note, in case they are misspelt.
///
/// # Errors
/// [`Error::Steering`] with the JSON pointer of a value that has the wrong type or range.
pub(super) fn read(
    file: &str,
    json: &Value,
    node: usize,
    mesh: usize,
    notes: &mut Vec<String>,
) -> Result<Request, Error> {
    let mut request = Request::default();
    for (collection, index) in [("meshes", mesh), ("nodes", node)] {
        let owner = format!("/{collection}/{index}");
        let value = json.pointer(&owner).unwrap_or(&Value::Null);
        if value.get("name").and_then(Value::as_str).is_some_and(names_a_vlm) {
            request.authored.get_or_insert_default();
        }
        if let Some(extras) = value.get("extras").and_then(|extras| extras.get("vlm")) {
            let pointer = format!("{owner}/extras/vlm");
            apply(extras, &mut request, &Place { file, pointer: &pointer })?;
            note_unknown_keys(extras, &pointer, notes);
        }
    }
    Ok(request)
}

/// `VLM_*` or `*-vlm` in any case. The `.001` that Blender appends to copies does not count.
fn names_a_vlm(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    let original = match name.rsplit_once('.') {
        Some((original, copy)) if !copy.is_empty() && copy.bytes().all(|b| b.is_ascii_digit()) => original,
        _ => &name,
    };
    original.starts_with("vlm_") || original.ends_with("-vlm")
}

fn note_unknown_keys(extras: &Value, pointer: &str, notes: &mut Vec<String>) {
    for key in extras.as_object().into_iter().flat_map(|object| object.keys()) {
        if !KEYS.contains(&key.as_str()) {
            notes.push(format!("{pointer}: no such setting as `{key}`; there are {}", KEYS.join(", ")));
        }
    }
}

fn apply(extras: &Value, request: &mut Request, place: &Place) -> Result<(), Error> {
    if !extras.is_object() {
        return Err(place.wrong("", extras, "an object such as { \"intensity\": 2 }"));
    }
    let steering = &mut request.steering;
    set(extras, "intensity", "a number of 0 or more", place, non_negative, &mut steering.intensity)?;
    set(extras, "tint", "three numbers of 0 or more", place, tint, &mut steering.tint)?;
    set(
        extras,
        "tag",
        "a whole number from 0 to 4294967295",
        place,
        |v| tag(v).map(Some),
        &mut steering.tag,
    )?;
    set(extras, "exclude", "true or false", place, boolean, &mut steering.exclude)?;
    set(extras, "density", "a number above 0", place, positive, &mut steering.density)?;
    set(extras, "volume", "true or false", place, boolean, &mut request.volume)?;
    set(
        extras,
        "mode",
        "\"add\", \"subtract\" or \"both\"",
        place,
        |v| mode(v).map(Some),
        &mut request.authored,
    )
}

/// Overwrites `target` if the key is there.
fn set<T>(
    extras: &Value,
    key: &str,
    expected: &'static str,
    place: &Place,
    parse: impl Fn(&Value) -> Option<T>,
    target: &mut T,
) -> Result<(), Error> {
    if let Some(value) = extras.get(key) {
        *target = parse(value).ok_or_else(|| place.wrong(&format!("/{key}"), value, expected))?;
    }
    Ok(())
}

/// Where the values stand, for messages.
struct Place<'a> {
    file: &'a str,
    pointer: &'a str,
}

impl Place<'_> {
    fn wrong(&self, key: &str, found: &Value, expected: &'static str) -> Error {
        Error::Steering {
            file: self.file.to_owned(),
            pointer: format!("{}{key}", self.pointer),
            found: abbreviated(found),
            expected,
        }
    }
}

fn abbreviated(value: &Value) -> String {
    let text = value.to_string();
    if text.chars().count() > 40 { text.chars().take(40).chain("...".chars()).collect() } else { text }
}

/// `None` for what is no number that `f32` can hold.
fn number(value: &Value) -> Option<f32> {
    value.as_f64().map(|x| x as f32).filter(|x| x.is_finite())
}

fn non_negative(value: &Value) -> Option<f32> {
    number(value).filter(|&x| x >= 0.0)
}

fn positive(value: &Value) -> Option<f32> {
    number(value).filter(|&x| x > 0.0)
}

/// Linear rgb; a fourth number (Blender's colour properties have alpha) is ignored.
fn tint(value: &Value) -> Option<Vec3> {
    let channels = value.as_array().filter(|channels| matches!(channels.len(), 3 | 4))?;
    let channels: Option<Vec<f32>> = channels.iter().map(non_negative).collect();
    channels.map(|c| Vec3::new(c[0], c[1], c[2]))
}

/// Whole numbers may be written `2.0`.
fn tag(value: &Value) -> Option<u32> {
    let number = value.as_f64().filter(|x| x.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(x))?;
    Some(number as u32)
}

/// Some exporters write booleans as 0 and 1.
fn boolean(value: &Value) -> Option<bool> {
    value.as_bool().or(match value.as_u64() {
        Some(0) => Some(false),
        Some(1) => Some(true),
        _ => None,
    })
}

fn mode(value: &Value) -> Option<AuthoredMode> {
    match value.as_str()?.to_ascii_lowercase().as_str() {
        "add" => Some(AuthoredMode::Add),
        "subtract" => Some(AuthoredMode::Subtract),
        "both" | "replace" => Some(AuthoredMode::Both),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn read_json(json: &Value) -> Result<Request, Error> {
        read("test.gltf", json, 0, 0, &mut Vec::new())
    }

    #[test]
    fn names_make_vlms() {
        for name in ["VLM_wall", "vlm_", "Wall-vlm", "wall-VLM.001"] {
            assert!(names_a_vlm(name), "{name}");
        }
        for name in ["wall", "VLM", "wall_vlm", "my VLM_wall", "wall-vlm.x", "", ".001"] {
            assert!(!names_a_vlm(name), "{name}");
        }
    }

    #[test]
    fn the_node_wins_over_its_mesh_key_by_key() {
        let json = json!({
            "meshes": [{ "extras": { "vlm": { "intensity": 2, "tag": 7, "tint": [1, 0.5, 0, 1] } } }],
            "nodes": [{ "extras": { "vlm": { "intensity": 3, "exclude": 1, "density": 0.5 } } }],
        });
        let expected = Steering {
            intensity: 3.0,
            tint: Vec3::new(1.0, 0.5, 0.0),
            tag: Some(7),
            exclude: true,
            density: 0.5,
        };
        assert_eq!(read_json(&json).unwrap(), Request { steering: expected, ..Request::default() });
    }

    #[test]
    fn a_mode_or_a_name_makes_a_mesh_an_authored_vlm() {
        let named = json!({ "meshes": [{ "name": "VLM_sky" }], "nodes": [{}] });
        assert_eq!(read_json(&named).unwrap().authored, Some(AuthoredMode::Add));
        for (mode, expected) in [
            ("Add", AuthoredMode::Add),
            ("subtract", AuthoredMode::Subtract),
            ("replace", AuthoredMode::Both),
        ] {
            let json = json!({ "nodes": [{ "name": "x-vlm", "extras": { "vlm": { "mode": mode } } }] });
            assert_eq!(read_json(&json).unwrap().authored, Some(expected));
        }
    }

    #[test]
    fn the_node_decides_whether_its_mesh_is_a_volume() {
        let json =
            |node: Value| json!({ "meshes": [{ "extras": { "vlm": { "volume": true } } }], "nodes": [node] });
        assert!(read_json(&json(json!({}))).unwrap().volume);
        assert!(!read_json(&json(json!({ "extras": { "vlm": { "volume": false } } }))).unwrap().volume);
        assert!(!read_json(&json!({ "nodes": [{}] })).unwrap().volume);
    }

    #[test]
    fn wrong_types_are_named_with_their_pointer() {
        let cases = [
            (json!(3), "/nodes/0/extras/vlm"),
            (json!({ "intensity": "high" }), "/nodes/0/extras/vlm/intensity"),
            (json!({ "intensity": -1 }), "/nodes/0/extras/vlm/intensity"),
            (json!({ "intensity": 1e300 }), "/nodes/0/extras/vlm/intensity"),
            (json!({ "tint": [1, 2] }), "/nodes/0/extras/vlm/tint"),
            (json!({ "tint": [1, 2, null] }), "/nodes/0/extras/vlm/tint"),
            (json!({ "tag": 1.5 }), "/nodes/0/extras/vlm/tag"),
            (json!({ "tag": -1 }), "/nodes/0/extras/vlm/tag"),
            (json!({ "exclude": "yes" }), "/nodes/0/extras/vlm/exclude"),
            (json!({ "density": 0 }), "/nodes/0/extras/vlm/density"),
            (json!({ "mode": "multiply" }), "/nodes/0/extras/vlm/mode"),
            (json!({ "volume": "yes" }), "/nodes/0/extras/vlm/volume"),
        ];
        for (extras, expected) in cases {
            let error = read_json(&json!({ "nodes": [{ "extras": { "vlm": extras } }] })).unwrap_err();
            assert!(matches!(&error, Error::Steering { pointer, .. } if pointer == expected), "{error}");
        }
    }

    #[test]
    fn unknown_keys_make_a_note() {
        let json = json!({ "nodes": [{ "extras": { "vlm": { "intesity": 2 } } }] });
        let mut notes = Vec::new();
        read("test.gltf", &json, 0, 0, &mut notes).unwrap();
        assert!(notes[0].contains("intesity"), "{notes:?}");
    }
}

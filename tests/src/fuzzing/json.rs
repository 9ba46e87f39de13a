//! Changes to a document: values, indices, names, members that come and go.

use serde_json::{Map, Value, json};

use super::Draw;

/// Numbers at which readers break: ends of ranges, and what is barely no longer valid.
const NUMBERS: [f64; 17] = [
    0.0,
    1.0,
    -1.0,
    0.5,
    2.0,
    3.0,
    1e-7,
    -1e-3,
    1e-38,
    1e-45,
    1e3,
    1e6,
    -1e6,
    1e30,
    3e38,
    4_294_967_295.0,
    5e-324,
];

/// Words that mean something in glTF, wherever they come to stand.
const WORDS: [&str; 15] = [
    "VEC2",
    "VEC3",
    "VEC4",
    "SCALAR",
    "MAT4",
    "OPAQUE",
    "MASK",
    "BLEND",
    "VLM_wall",
    "x-vlm",
    "point",
    "directional",
    "spot",
    "perspective",
    "",
];

/// Changes one thing; the document stays JSON, and most often glTF.
pub fn change(root: &mut Value, draw: &mut Draw) {
    match draw.below(10) {
        0..4 => change_value(root, draw),
        4..6 => insert_known(root, draw),
        6 => remove(root, draw),
        7 => duplicate(root, draw),
        8 => copy_over(root, draw),
        _ => change_number(root, draw),
    }
}

/// JSON pointers of everything below a value.
#[must_use]
pub fn places(root: &Value) -> Vec<String> {
    let mut found = Vec::new();
    collect(root, &mut String::new(), &mut found);
    found
}

fn collect(value: &Value, pointer: &mut String, found: &mut Vec<String>) {
    found.push(pointer.clone());
    let mut inside = |key: &str, item: &Value| {
        let length = pointer.len();
        pointer.push('/');
        pointer.push_str(&key.replace('~', "~0").replace('/', "~1"));
        collect(item, pointer, found);
        pointer.truncate(length);
    };
    match value {
        Value::Array(list) => list.iter().enumerate().for_each(|(i, item)| inside(&i.to_string(), item)),
        Value::Object(map) => map.iter().for_each(|(key, item)| inside(key, item)),
        _ => {}
    }
}

/// A place of the document that `suits`, all of them equally likely.
fn place<'a>(root: &'a mut Value, draw: &mut Draw, suits: fn(&Value) -> bool) -> Option<&'a mut Value> {
    let mut pointers = places(root);
    pointers.retain(|pointer| root.pointer(pointer).is_some_and(suits));
    let pointer = draw.of(&pointers)?;
    root.pointer_mut(pointer)
}

fn change_value(root: &mut Value, draw: &mut Draw) {
    if let Some(value) = place(root, draw, |value| !value.is_object()) {
        *value = match value {
            Value::Bool(b) => json!(!*b),
            Value::Number(_) => other_number(value, draw),
            Value::String(_) => json!(draw.of(&WORDS)),
            Value::Array(list) => shortened(list, draw),
            _ => json!(draw.below(3)),
        };
    }
}

fn change_number(root: &mut Value, draw: &mut Draw) {
    if let Some(value) = place(root, draw, Value::is_number) {
        *value = other_number(value, draw);
    }
}

/// Near the number, or one of [`NUMBERS`].
fn other_number(value: &Value, draw: &mut Draw) -> Value {
    let number = value.as_f64().unwrap_or_default();
    match (draw.below(5), value.as_i64()) {
        (0, Some(whole)) => json!(whole.saturating_add(1)),
        (1, Some(whole)) => json!(whole.saturating_sub(1)),
        (2, Some(whole)) => json!(draw.below(whole.unsigned_abs() as usize + 2)),
        (0, None) => json!(-number),
        (1, None) => json!(number * 1.5),
        (2, None) => json!(number * 1e-6),
        (3, _) => json!(draw.below(8)),
        _ => json!(draw.of(&NUMBERS)),
    }
}

fn shortened(list: &[Value], draw: &mut Draw) -> Value {
    Value::Array(list.iter().take(draw.below(list.len() + 1)).cloned().collect())
}

fn remove(root: &mut Value, draw: &mut Draw) {
    match place(root, draw, |value| children(value) > 0) {
        Some(Value::Array(list)) => _ = list.remove(draw.below(list.len())),
        Some(Value::Object(map)) => {
            let keys: Vec<String> = map.keys().cloned().collect();
            if let Some(key) = draw.of(&keys) {
                map.shift_remove(key);
            }
        }
        _ => {}
    }
}

fn duplicate(root: &mut Value, draw: &mut Draw) {
    if let Some(Value::Array(list)) = place(root, draw, |value| value.is_array() && children(value) > 0)
        && let Some(item) = draw.of(list).cloned()
    {
        list.insert(draw.below(list.len() + 1), item);
    }
}

/// Puts what stands at one place at another.
fn copy_over(root: &mut Value, draw: &mut Draw) {
    let pointers = places(root);
    let (Some(from), Some(to)) = (draw.of(&pointers), draw.of(&pointers)) else { return };
    let value = root.pointer(from).cloned().unwrap_or_default();
    if let Some(target) = root.pointer_mut(to).filter(|_| !to.is_empty() && value.to_string().len() < 4096) {
        *target = value;
    }
}

/// Gives an object of the right list a property that readers follow.
fn insert_known(root: &mut Value, draw: &mut Draw) {
    const LISTS: [&str; 6] = ["nodes", "nodes", "meshes", "materials", "accessors", "bufferViews"];
    let list = LISTS[draw.below(LISTS.len())];
    let (key, value) = match list {
        "nodes" => known_of_node(draw),
        "meshes" => known_of_primitive(draw),
        "materials" => known_of_material(draw),
        "accessors" => known_of_accessor(draw),
        _ => ("byteStride", json!(4 * draw.below(10))),
    };
    let Some(Value::Array(items)) = root.get_mut(list) else { return };
    let index = draw.below(items.len());
    let Some(mut item) = items.get_mut(index) else { return };
    if list == "meshes" && key != "name" && key != "extras" {
        let primitives = item.get_mut("primitives").and_then(Value::as_array_mut);
        let Some(primitives) = primitives else { return };
        let index = draw.below(primitives.len());
        let Some(primitive) = primitives.get_mut(index) else { return };
        item = primitive;
    }
    if let Value::Object(item) = item {
        merge(item, key, value);
    }
}

fn merge(item: &mut Map<String, Value>, key: &str, value: Value) {
    match (item.get_mut(key), value) {
        (Some(Value::Object(there)), Value::Object(more)) => there.extend(more),
        (_, value) => _ = item.insert(key.to_owned(), value),
    }
}

fn number(draw: &mut Draw) -> f64 {
    let signed = draw.below(2_000_001) as f64 * 1e-6 - 1.0;
    if draw.one_in(3) { draw.of(&NUMBERS).copied().unwrap_or_default() } else { 3.0 * signed }
}

fn numbers<const N: usize>(draw: &mut Draw) -> Value {
    (0..N).map(|_| json!(number(draw))).collect()
}

fn known_of_node(draw: &mut Draw) -> (&'static str, Value) {
    match draw.below(9) {
        0 => ("scale", numbers::<3>(draw)),
        1 => ("translation", numbers::<3>(draw)),
        2 => ("rotation", numbers::<4>(draw)),
        3 => ("matrix", numbers::<16>(draw)),
        4 => ("mesh", json!(draw.below(4))),
        5 => ("name", json!(draw.of(&WORDS))),
        6 => ("skin", json!(0)),
        7 => (
            "extensions",
            json!({ "EXT_mesh_gpu_instancing": { "attributes": {
                (if draw.one_in(2) { "TRANSLATION" } else { "SCALE" }): draw.below(6),
            } } }),
        ),
        _ => ("extras", json!({ "vlm": steering(draw) })),
    }
}

fn steering(draw: &mut Draw) -> Value {
    match draw.below(7) {
        0 => json!({ "intensity": number(draw) }),
        1 => json!({ "tint": numbers::<3>(draw) }),
        2 => json!({ "tag": draw.below(5) }),
        3 => json!({ "exclude": draw.one_in(2) }),
        4 => json!({ "density": number(draw) }),
        5 => json!({ "volume": true }),
        _ => json!({ "mode": draw.of(&["add", "subtract", "both"]) }),
    }
}

fn known_of_primitive(draw: &mut Draw) -> (&'static str, Value) {
    match draw.below(6) {
        0 => ("mode", json!(draw.below(7))),
        1 => ("material", json!(draw.below(4))),
        2 => ("indices", json!(draw.below(8))),
        3 => ("targets", json!([{ "POSITION": draw.below(8) }])),
        4 => ("extras", json!({ "vlm": steering(draw) })),
        _ => {
            let semantics = ["NORMAL", "TEXCOORD_0", "COLOR_0", "JOINTS_0", "WEIGHTS_0", "POSITION"];
            ("attributes", json!({ (semantics[draw.below(semantics.len())]): draw.below(8) }))
        }
    }
}

fn known_of_material(draw: &mut Draw) -> (&'static str, Value) {
    match draw.below(7) {
        0 => ("doubleSided", json!(draw.one_in(2))),
        1 => ("alphaMode", json!(draw.of(&["OPAQUE", "MASK", "BLEND"]))),
        2 => ("alphaCutoff", json!(number(draw))),
        3 => ("emissiveFactor", numbers::<3>(draw)),
        4 => ("pbrMetallicRoughness", json!({ "baseColorFactor": numbers::<4>(draw) })),
        5 => {
            ("extensions", json!({ "KHR_materials_emissive_strength": { "emissiveStrength": number(draw) } }))
        }
        _ => ("extensions", json!({ "KHR_materials_transmission": { "transmissionFactor": number(draw) } })),
    }
}

fn known_of_accessor(draw: &mut Draw) -> (&'static str, Value) {
    match draw.below(5) {
        0 => ("componentType", json!(5120 + draw.below(7))),
        1 => ("normalized", json!(draw.one_in(2))),
        2 => ("byteOffset", json!(4 * draw.below(20))),
        3 => ("count", json!(draw.below(40))),
        _ => (
            "sparse",
            json!({
                "count": draw.below(4),
                "indices": { "bufferView": draw.below(4), "componentType": 5121 },
                "values": { "bufferView": draw.below(4) },
            }),
        ),
    }
}

fn children(value: &Value) -> usize {
    match value {
        Value::Array(list) => list.len(),
        Value::Object(map) => map.len(),
        _ => 0,
    }
}

//! The shape of glTF JSON as tables, and the walk that compares a file with them.
//!
//! Only what some reader of this workspace follows is listed: types, required properties, enumerations, and every index
//! that leads into a root array. Properties that are not listed may hold anything.

use serde_json::{Map, Value};

use super::Report;
use crate::error::Code;

/// What a JSON value must look like.
#[derive(Clone, Copy)]
pub(super) enum Shape {
    Bool,
    Text,
    /// A number that is finite in single precision.
    Number,
    /// A whole number, 0 or more.
    Count,
    /// Exactly so many finite numbers; 0 for any number of them.
    Numbers(usize),
    /// Exactly so many whole numbers of 32 bits.
    Small(usize),
    /// An index into the root array at this JSON pointer.
    Index(&'static str),
    /// A list of such indices.
    Indices(&'static str),
    /// One of these whole numbers.
    OneOf(&'static [u64]),
    /// One of these words.
    Word(&'static [&'static str]),
    /// A list of texts.
    Texts,
    Object(&'static [Field]),
    Objects(&'static [Field]),
    /// An object whose values all have this shape.
    Map(&'static Shape),
    /// A list whose elements all have this shape.
    List(&'static Shape),
}

/// A property of an object.
#[derive(Clone, Copy)]
pub(super) struct Field {
    name: &'static str,
    shape: Shape,
    required: bool,
}

const fn must(name: &'static str, shape: Shape) -> Field {
    Field { name, shape, required: true }
}

const fn may(name: &'static str, shape: Shape) -> Field {
    Field { name, shape, required: false }
}

use Shape::{
    Bool, Count, Index, Indices, List, Map as MapOf, Number, Numbers, Object, Objects, OneOf, Small, Text,
    Texts, Word,
};

const NAME: Field = may("name", Text);
const ANY_EXTENSIONS: Field = may("extensions", Object(&[]));
const ACCESSOR: Shape = Index("/accessors");
const VIEW: Shape = Index("/bufferViews");
const COMPONENT_TYPES: &[u64] = &[5120, 5121, 5122, 5123, 5125, 5126];
const INDEX_TYPES: &[u64] = &[5121, 5123, 5125];

/// The root object of a glTF file.
pub(super) const ROOT: &[Field] = &[
    must(
        "asset",
        Object(&[must("version", Text), may("minVersion", Text), may("generator", Text), ANY_EXTENSIONS]),
    ),
    may("extensionsUsed", Texts),
    may("extensionsRequired", Texts),
    may("scene", Index("/scenes")),
    may("scenes", Objects(&[may("nodes", Indices("/nodes")), NAME, ANY_EXTENSIONS])),
    may("nodes", Objects(NODE)),
    may(
        "meshes",
        Objects(&[must("primitives", Objects(PRIMITIVE)), may("weights", Numbers(0)), NAME, ANY_EXTENSIONS]),
    ),
    may("accessors", Objects(ACCESSOR_FIELDS)),
    may("bufferViews", Objects(VIEW_FIELDS)),
    may("buffers", Objects(&[must("byteLength", Count), may("uri", Text), NAME, ANY_EXTENSIONS])),
    may("materials", Objects(MATERIAL)),
    may("textures", Objects(TEXTURE)),
    may(
        "images",
        Objects(&[may("bufferView", VIEW), may("uri", Text), may("mimeType", Text), NAME, ANY_EXTENSIONS]),
    ),
    may("samplers", Objects(SAMPLER)),
    may("cameras", Objects(CAMERA)),
    may("skins", Objects(SKIN)),
    may("animations", Objects(ANIMATION)),
    may("extensions", Object(&[may("KHR_lights_punctual", Object(&[must("lights", Objects(LIGHT))]))])),
];

const NODE: &[Field] = &[
    may("camera", Index("/cameras")),
    may("children", Indices("/nodes")),
    may("mesh", Index("/meshes")),
    may("skin", Index("/skins")),
    may("matrix", Numbers(16)),
    may("translation", Numbers(3)),
    may("rotation", Numbers(4)),
    may("scale", Numbers(3)),
    may("weights", Numbers(0)),
    NAME,
    may(
        "extensions",
        Object(&[
            may(
                "KHR_lights_punctual",
                Object(&[must("light", Index("/extensions/KHR_lights_punctual/lights"))]),
            ),
            may("EXT_mesh_gpu_instancing", Object(&[must("attributes", MapOf(&ACCESSOR))])),
        ]),
    ),
];

const PRIMITIVE: &[Field] = &[
    must("attributes", MapOf(&ACCESSOR)),
    may("indices", ACCESSOR),
    may("material", Index("/materials")),
    may("mode", OneOf(&[0, 1, 2, 3, 4, 5, 6])),
    may("targets", List(&MapOf(&ACCESSOR))),
    may(
        "extensions",
        Object(&[may(
            "KHR_materials_variants",
            Object(&[must("mappings", Objects(&[must("material", Index("/materials"))]))]),
        )]),
    ),
];

const ACCESSOR_FIELDS: &[Field] = &[
    may("bufferView", VIEW),
    may("byteOffset", Count),
    must("componentType", OneOf(COMPONENT_TYPES)),
    may("normalized", Bool),
    must("count", Count),
    must("type", Word(&["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"])),
    may("min", Numbers(0)),
    may("max", Numbers(0)),
    may(
        "sparse",
        Object(&[
            must("count", Count),
            must(
                "indices",
                Object(&[
                    must("bufferView", VIEW),
                    may("byteOffset", Count),
                    must("componentType", OneOf(INDEX_TYPES)),
                    ANY_EXTENSIONS,
                ]),
            ),
            must("values", Object(&[must("bufferView", VIEW), may("byteOffset", Count), ANY_EXTENSIONS])),
            ANY_EXTENSIONS,
        ]),
    ),
    NAME,
    ANY_EXTENSIONS,
];

const MESHOPT: Shape = Object(&[
    must("buffer", Index("/buffers")),
    may("byteOffset", Count),
    must("byteLength", Count),
    must("byteStride", Count),
    must("count", Count),
    must("mode", Word(&["ATTRIBUTES", "TRIANGLES", "INDICES"])),
    may("filter", Word(&["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"])),
]);

const VIEW_FIELDS: &[Field] = &[
    must("buffer", Index("/buffers")),
    may("byteOffset", Count),
    must("byteLength", Count),
    may("byteStride", Count),
    may("target", OneOf(&[34962, 34963])),
    NAME,
    may(
        "extensions",
        Object(&[may("EXT_meshopt_compression", MESHOPT), may("KHR_meshopt_compression", MESHOPT)]),
    ),
];

const TEXTURE_INFO_EXTENSIONS: Field = may(
    "extensions",
    Object(&[may(
        "KHR_texture_transform",
        Object(&[
            may("offset", Numbers(2)),
            may("rotation", Number),
            may("scale", Numbers(2)),
            may("texCoord", Count),
        ]),
    )]),
);

const TEXTURE_INFO: Shape =
    Object(&[must("index", Index("/textures")), may("texCoord", Count), TEXTURE_INFO_EXTENSIONS]);

const MATERIAL: &[Field] = &[
    NAME,
    may(
        "pbrMetallicRoughness",
        Object(&[
            may("baseColorFactor", Numbers(4)),
            may("baseColorTexture", TEXTURE_INFO),
            may("metallicFactor", Number),
            may("roughnessFactor", Number),
            may("metallicRoughnessTexture", TEXTURE_INFO),
            ANY_EXTENSIONS,
        ]),
    ),
    may(
        "normalTexture",
        Object(&[
            must("index", Index("/textures")),
            may("texCoord", Count),
            may("scale", Number),
            TEXTURE_INFO_EXTENSIONS,
        ]),
    ),
    may(
        "occlusionTexture",
        Object(&[
            must("index", Index("/textures")),
            may("texCoord", Count),
            may("strength", Number),
            TEXTURE_INFO_EXTENSIONS,
        ]),
    ),
    may("emissiveTexture", TEXTURE_INFO),
    may("emissiveFactor", Numbers(3)),
    may("alphaMode", Word(&["OPAQUE", "MASK", "BLEND"])),
    may("alphaCutoff", Number),
    may("doubleSided", Bool),
    may(
        "extensions",
        Object(&[
            may("KHR_materials_emissive_strength", Object(&[may("emissiveStrength", Number)])),
            may(
                "KHR_materials_transmission",
                Object(&[may("transmissionFactor", Number), may("transmissionTexture", TEXTURE_INFO)]),
            ),
            may(
                "KHR_materials_pbrSpecularGlossiness",
                Object(&[
                    may("diffuseFactor", Numbers(4)),
                    may("diffuseTexture", TEXTURE_INFO),
                    may("specularFactor", Numbers(3)),
                    may("specularGlossinessTexture", TEXTURE_INFO),
                ]),
            ),
        ]),
    ),
];

const IMAGE_SOURCE: Shape = Object(&[must("source", Index("/images"))]);

const TEXTURE: &[Field] = &[
    may("sampler", Index("/samplers")),
    may("source", Index("/images")),
    NAME,
    may("extensions", Object(&[may("EXT_texture_webp", IMAGE_SOURCE)])),
];

const SAMPLER: &[Field] = &[
    may("magFilter", OneOf(&[9728, 9729])),
    may("minFilter", OneOf(&[9728, 9729, 9984, 9985, 9986, 9987])),
    may("wrapS", OneOf(&[33071, 33648, 10497])),
    may("wrapT", OneOf(&[33071, 33648, 10497])),
    NAME,
    ANY_EXTENSIONS,
];

const CAMERA: &[Field] = &[
    must("type", Word(&["perspective", "orthographic"])),
    may(
        "perspective",
        Object(&[
            must("yfov", Number),
            must("znear", Number),
            may("zfar", Number),
            may("aspectRatio", Number),
            ANY_EXTENSIONS,
        ]),
    ),
    may(
        "orthographic",
        Object(&[
            must("xmag", Number),
            must("ymag", Number),
            must("znear", Number),
            must("zfar", Number),
            ANY_EXTENSIONS,
        ]),
    ),
    NAME,
    ANY_EXTENSIONS,
];

const SKIN: &[Field] = &[
    must("joints", Indices("/nodes")),
    may("skeleton", Index("/nodes")),
    may("inverseBindMatrices", ACCESSOR),
    NAME,
    ANY_EXTENSIONS,
];

const LIGHT: &[Field] = &[
    must("type", Word(&["directional", "point", "spot"])),
    may("color", Numbers(3)),
    may("intensity", Number),
    may("range", Number),
    may("spot", Object(&[may("innerConeAngle", Number), may("outerConeAngle", Number)])),
    NAME,
];

const ANIMATION: &[Field] = &[
    must(
        "channels",
        Objects(&[
            must("sampler", Count),
            must("target", Object(&[may("node", Index("/nodes")), must("path", Text)])),
        ]),
    ),
    must("samplers", Objects(&[must("input", ACCESSOR), must("output", ACCESSOR)])),
    NAME,
];

/// Compares a whole file with [`ROOT`].
pub(super) fn check(root: &Value, report: &mut Report) {
    let mut walk = Walk { root, pointer: String::new(), report };
    walk.value(root, Object(ROOT));
}

/// One array of the extension.
const ARRAY: Shape = Object(&[must("accessor", ACCESSOR), must("digest", Text)]);

/// The root object of `VLM_virtual_light_mesh`.
const EXTENSION: &[Field] = &[
    must("generator", Text),
    must("settings", Object(&[])),
    must("data", Object(&[must("bufferView", VIEW), must("bufferByteLength", Count)])),
    must(
        "vlms",
        Objects(&[
            must("id", Text),
            must("lights", RANGE),
            must("vertices", RANGE),
            may("authored", Bool),
            must("digests", Object(&[must("geometry", Text), must("transform", Text)])),
        ]),
    ),
    must(
        "lights",
        Object(&[
            may("positions", ARRAY),
            may("indices", ARRAY),
            may("albedo", ARRAY),
            may("emission", ARRAY),
            may("tags", ARRAY),
        ]),
    ),
    must(
        "samples",
        Object(&[
            must("starts", ARRAY),
            may("positions", ARRAY),
            may("normals", ARRAY),
            may("reflectance", ARRAY),
        ]),
    ),
    may(
        "grid",
        Object(&[
            must("origin", Numbers(3)),
            must("cellSize", Number),
            must("dimensions", Small(3)),
            may("cells", ARRAY),
            must("starts", ARRAY),
            may("entries", ARRAY),
            must("sceneDigest", Text),
        ]),
    ),
];

/// First element and number of elements.
const RANGE: Shape = Small(2);

/// Compares the extension's objects with their tables.
pub(super) fn check_extension(root: &Value, report: &mut Report) {
    const NAME: &str = "VLM_virtual_light_mesh";
    const IN_NODE: Shape = Object(&[may("extensions", Object(&[may(NAME, Object(&[must("vlm", Text)]))]))]);
    const IN_PRIMITIVE: Shape =
        Object(&[may("extensions", Object(&[may(NAME, Object(&[must("tag", Count)]))]))]);
    const ROOT: &[Field] = &[
        may("extensions", Object(&[may(NAME, Object(EXTENSION))])),
        may("nodes", List(&IN_NODE)),
        may("meshes", Objects(&[must("primitives", List(&IN_PRIMITIVE))])),
    ];
    let mut walk = Walk { root, pointer: String::new(), report };
    walk.value(root, Object(ROOT));
}

struct Walk<'a, 'r> {
    root: &'a Value,
    /// JSON pointer of the value at hand.
    pointer: String,
    report: &'r mut Report,
}

impl Walk<'_, '_> {
    fn value(&mut self, value: &Value, shape: Shape) {
        match shape {
            Bool => self.expect(value.is_boolean(), value, "true or false"),
            Text => self.expect(value.is_string(), value, "a text"),
            Number => self.number(value),
            Count => self.expect(value.is_u64(), value, "a whole number, 0 or more"),
            Index(array) => self.index(value, array),
            OneOf(allowed) => self.one_of(value, allowed),
            Word(allowed) => self.word(value, allowed),
            Object(fields) => self.object(value, fields),
            MapOf(shape) => self.map(value, *shape),
            List(shape) => self.list(value, *shape),
            Objects(fields) => self.list(value, Object(fields)),
            Indices(array) => self.list(value, Index(array)),
            Texts => self.list(value, Text),
            Small(count) => {
                let fits = |value: &Value| value.as_u64().is_some_and(|number| u32::try_from(number).is_ok());
                let list = value.as_array().is_some_and(|list| list.len() == count && list.iter().all(fits));
                self.expect(list, value, "a list of whole numbers of the right length");
            }
            Numbers(count) => {
                if count > 0 && value.as_array().is_some_and(|list| list.len() != count) {
                    self.wrong(Code::WrongType, format!("must be a list of {count} numbers"));
                }
                self.list(value, Number);
            }
        }
    }

    fn object(&mut self, value: &Value, fields: &[Field]) {
        let Some(object) = self.as_object(value) else { return };
        for field in fields {
            match object.get(field.name) {
                Some(value) => self.inside(field.name, |walk| walk.value(value, field.shape)),
                None if field.required => self.wrong(Code::Missing, format!("`{}` is missing", field.name)),
                None => {}
            }
        }
    }

    fn map(&mut self, value: &Value, shape: Shape) {
        let Some(object) = self.as_object(value) else { return };
        for (key, value) in object {
            self.inside(key, |walk| walk.value(value, shape));
        }
    }

    fn list(&mut self, value: &Value, shape: Shape) {
        let Value::Array(list) = value else {
            return self.expect(false, value, "a list");
        };
        for (index, value) in list.iter().enumerate() {
            self.inside(&index.to_string(), |walk| walk.value(value, shape));
        }
    }

    fn number(&mut self, value: &Value) {
        match value.as_f64() {
            Some(number) if !(number as f32).is_finite() => {
                self.wrong(Code::NumberRange, format!("{number:e} is beyond single precision"));
            }
            number => self.expect(number.is_some(), value, "a number"),
        }
    }

    fn index(&mut self, value: &Value, array: &str) {
        let Some(index) = value.as_u64() else {
            return self.expect(false, value, "a whole number, 0 or more");
        };
        let length = self.root.pointer(array).and_then(Value::as_array).map_or(0, Vec::len);
        if index >= length as u64 {
            self.wrong(
                Code::IndexOutOfRange,
                format!("{index} is no index into {array}, which has {length}"),
            );
        }
    }

    fn one_of(&mut self, value: &Value, allowed: &[u64]) {
        if !value.as_u64().is_some_and(|number| allowed.contains(&number)) {
            self.wrong(Code::WrongValue, format!("{} is none of {allowed:?}", shorten(value)));
        }
    }

    fn word(&mut self, value: &Value, allowed: &[&str]) {
        if !value.as_str().is_some_and(|word| allowed.contains(&word)) {
            self.wrong(Code::WrongValue, format!("{} is none of {}", shorten(value), allowed.join(", ")));
        }
    }

    fn as_object<'v>(&mut self, value: &'v Value) -> Option<&'v Map<String, Value>> {
        self.expect(value.is_object(), value, "an object");
        value.as_object()
    }

    fn expect(&mut self, holds: bool, value: &Value, expected: &str) {
        if !holds {
            self.wrong(Code::WrongType, format!("{} is not {expected}", shorten(value)));
        }
    }

    fn wrong(&mut self, code: Code, message: String) {
        self.report.error(code, self.pointer.clone(), message);
    }

    /// Runs a check one level deeper, with the key appended to the pointer.
    fn inside(&mut self, key: &str, check: impl FnOnce(&mut Self)) {
        let length = self.pointer.len();
        self.pointer.push('/');
        self.pointer.push_str(&key.replace('~', "~0").replace('/', "~1"));
        check(self);
        self.pointer.truncate(length);
    }
}

/// The value for a message: whole when short, else its kind.
fn shorten(value: &Value) -> String {
    match value {
        Value::Object(_) => String::from("an object"),
        Value::Array(_) => String::from("a list"),
        other => {
            let text = other.to_string();
            if text.chars().count() > 40 {
                format!("{}...", text.chars().take(40).collect::<String>())
            } else {
                text
            }
        }
    }
}

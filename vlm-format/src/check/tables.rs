//! The shape of glTF 2.0 and of the extensions that are read, as tables.
//!
//! Only what some reader of this workspace follows is listed: types, required properties, enumerations, and every index
//! that leads into a root array. Properties that are not listed may hold anything.

use super::shape::Shape::{
    self, Bool, Count, Index, Indices, List, Map as MapOf, Number, Numbers, Object, Objects, OneOf, Text,
    Texts, Word,
};

use super::shape::{Field, may, must};

const NAME: Field = may("name", Text);
const ANY_EXTENSIONS: Field = may("extensions", Object(&[]));
pub(super) const ACCESSOR: Shape = Index("/accessors");
pub(super) const VIEW: Shape = Index("/bufferViews");
const COMPONENT_TYPES: &[u64] = &[5120, 5121, 5122, 5123, 5125, 5126];
const INDEX_TYPES: &[u64] = &[5121, 5123, 5125];

/// The root object of a glTF file.
pub(super) const GLTF: &[Field] = &[
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

//! The shape of `VLM_virtual_light_mesh`, as tables.

use super::shape::Shape::{
    self, Bool, Count, Number, Numbers, Object, Objects, OneField, Small, SomeOf, Tag, Text, Texts,
};
use super::shape::{Field, may, must};
use super::tables::{ACCESSOR, VIEW};

const NAME: &str = "VLM_virtual_light_mesh";

/// The extension's objects in the root, in nodes and in primitives; nothing else of the file.
pub(super) const EXTENSION: &[Field] = &[
    may("extensions", Object(&[may(NAME, Object(ROOT))])),
    may("nodes", Objects(&[may("extensions", Object(&[may(NAME, NODE)]))])),
    may(
        "meshes",
        Objects(&[must("primitives", Objects(&[may("extensions", Object(&[may(NAME, PRIMITIVE)]))]))]),
    ),
];

/// A node that bears VLMs, has a tag, or both.
const NODE: Shape = SomeOf(&[may("vlms", Texts), may("tag", Tag)]);

/// A primitive that is tagged as a whole or by triangle.
const PRIMITIVE: Shape = OneField(&[may("tag", Tag), may("triangleTags", ARRAY)]);

/// One array of the extension. What is in `compression`, [`crate::compress`] checks when it reads the array.
const ARRAY: Shape =
    Object(&[must("accessor", ACCESSOR), must("digest", Text), may("compression", Object(&[]))]);

/// The root object of `VLM_virtual_light_mesh`.
const ROOT: &[Field] = &[
    must("generator", Text),
    must("settings", Object(&[])),
    must(
        "data",
        Object(&[
            must("bufferView", VIEW),
            must("bufferByteLength", Count),
            may("sourceDigest", Text),
            may("emptyBefore", Texts),
        ]),
    ),
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
            must("surfaceProbes", Count),
            must("cells", ARRAY),
            must("leaves", ARRAY),
            may("leafProbes", ARRAY),
            must("nearStarts", ARRAY),
            may("near", ARRAY),
            may("nearFormFactors", ARRAY),
            may("probes", ARRAY),
            may("sampleShares", ARRAY),
            may("surfaceGains", ARRAY),
            may("uncovered", ARRAY),
            must("rowStarts", ARRAY),
            may("rows", ARRAY),
            must("sceneDigest", Text),
        ]),
    ),
];

/// First element and number of elements.
const RANGE: Shape = Small(2);

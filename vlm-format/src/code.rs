//! The catalogue: every problem that is reported, by a name that never changes.

use std::fmt;

use serde::{Serialize, Serializer};

/// How much a problem matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Can be lived with; the message says what was assumed.
    Warning,
    /// The file is refused.
    Error,
}

impl Severity {
    /// `warning` or `error`.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

macro_rules! codes {
    ($($variant:ident $name:literal $severities:ident $meaning:literal $remedy:literal,)*) => {
        /// The rules that a file can break. Names never change; the list only grows.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum Code {
            $(#[doc = concat!("`", $name, "`: ", $meaning, ".")] $variant,)*
        }

        impl Code {
            /// Every code, in the order of the catalogue.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// The stable name, such as `INDEX_OUT_OF_RANGE`.
            pub fn as_str(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// How severe it is: the worst first, two where it depends on the place.
            #[must_use]
            pub fn severities(self) -> &'static [Severity] {
                match self { $(Self::$variant => $severities,)* }
            }

            /// What is wrong, in general.
            #[must_use]
            pub fn meaning(self) -> &'static str {
                match self { $(Self::$variant => $meaning,)* }
            }

            /// What the user can do about it.
            pub fn remedy(self) -> &'static str {
                match self { $(Self::$variant => $remedy,)* }
            }
        }
    };
}

const ERROR: &[Severity] = &[Severity::Error];
const EITHER: &[Severity] = &[Severity::Error, Severity::Warning];

codes! {
    Io "IO" ERROR "a file or folder could not be read or written" "check the path, the permissions and the disk",
    NotGltf "NOT_GLTF" ERROR "the file is not glTF 2.0" "export the model as glTF 2.0 (.glb or .gltf)",
    GlbDamaged "GLB_DAMAGED" ERROR "the chunks of the GLB do not fit its length" "export or download the file again",
    JsonSyntax "JSON_SYNTAX" ERROR "the JSON cannot be parsed" "export the file again, or mend the JSON at the place named",
    Version "VERSION" ERROR "the file has another version of glTF than 2.0" "convert the file to glTF 2.0, for example with `npx gltf-pipeline -i in.gltf -o out.glb`",
    WrongType "WRONG_TYPE" ERROR "a value has another type than glTF gives it" "export the file again, or mend the value: the glTF 2.0 specification names its type",
    Missing "MISSING" ERROR "a required property is missing" "export the file again, or add the property: the glTF 2.0 specification requires it",
    WrongValue "WRONG_VALUE" EITHER "a value is none of those that glTF allows" "export the file again, or choose one of the values that the glTF 2.0 specification allows",
    NumberRange "NUMBER_RANGE" ERROR "a number is beyond single precision" "export the file again: the number must be finite in single precision",
    IndexOutOfRange "INDEX_OUT_OF_RANGE" ERROR "an index leads nowhere" "export the file again: something was removed, but what refers to it was not",
    NodeCycle "NODE_CYCLE" EITHER "the node hierarchy is not a tree" "make the node hierarchy a tree: remove the node from one of its parents",
    ExtensionUnknown "EXTENSION_UNKNOWN" ERROR "the file requires an extension that is not read" "export without this extension, or move it from extensionsRequired to extensionsUsed if it does not change geometry",
    Draco "DRACO" ERROR "geometry exists compressed with Draco only" "decode it first: `npx @gltf-transform/cli copy in.glb out.glb`",
    UriUnsafe "URI_UNSAFE" ERROR "a URI leads out of the folder of the glTF" "put the file beside the glTF (or in a folder below it) and refer to it by a relative path",
    UriUnreadable "URI_UNREADABLE" ERROR "a file beside the glTF cannot be read" "put the file beside the glTF, or export with the data embedded (.glb)",
    UriNeedsFolder "URI_NEEDS_FOLDER" ERROR "a glTF from a pipe refers to a file beside it" "pass the file by its path, or as a .glb with all data inside",
    DataUri "DATA_URI" ERROR "a data URI is not valid base64" "export the file again: data URIs must be base64",
    BufferShort "BUFFER_SHORT" ERROR "a buffer has fewer bytes than it promises" "export or download the file again: its binary data is cut off",
    ViewOutOfRange "VIEW_OUT_OF_RANGE" ERROR "a buffer view reaches past its buffer" "export the file again: the buffer view reaches past its buffer",
    AccessorOutOfRange "ACCESSOR_OUT_OF_RANGE" ERROR "an accessor reaches past its buffer view" "export the file again: the accessor reaches past its buffer view",
    AccessorType "ACCESSOR_TYPE" ERROR "an accessor has another type than its use requires" "export the file again: the accessor has another type than its use requires",
    AccessorTooLarge "ACCESSOR_TOO_LARGE" ERROR "an accessor claims more elements than its data can hold" "export the file again: the accessor claims more elements than its data can hold",
    AttributeCount "ATTRIBUTE_COUNT" ERROR "attributes of a primitive differ in their number of elements" "export the file again: all attributes of a primitive need the same number of elements",
    SparseIndex "SPARSE_INDEX" ERROR "a sparse index is beyond its accessor" "export the file again: sparse indices must be below the accessor's count",
    VertexNotFinite "VERTEX_NOT_FINITE" ERROR "a vertex is not a finite number" "recompute or delete the vertex in the modelling tool (a division by zero is the usual cause)",
    VertexIndex "VERTEX_INDEX" ERROR "a triangle names a vertex that does not exist" "export the file again: an index names a vertex that does not exist",
    Compression "COMPRESSION" ERROR "compressed data cannot be decoded" "compress the file again, or decode it with `npx @gltf-transform/cli copy in.glb out.glb`",
    FileName "FILE_NAME" ERROR "the name of an output does not say which container it is to be" "name the output .glb or .gltf",
    TooLarge "TOO_LARGE" ERROR "the output exceeds what a GLB can hold" "write a .gltf with its data beside it, or make the file smaller: a GLB holds at most 4 GiB",
    VlmLength "VLM_LENGTH" ERROR "arrays of the Virtual Light Meshes that belong together differ in length" "bake the file again",
    VlmRange "VLM_RANGE" ERROR "a range or a number of the Virtual Light Meshes is beyond its limits" "bake the file again",
    VlmIndex "VLM_INDEX" ERROR "an index within the Virtual Light Meshes leads nowhere" "bake the file again",
    VlmNumber "VLM_NUMBER" ERROR "a number of the Virtual Light Meshes is not finite, or of the wrong sign" "bake the file again",
    VlmOrder "VLM_ORDER" ERROR "a list of the Virtual Light Meshes is not in order" "bake the file again",
    VlmId "VLM_ID" ERROR "the id of a Virtual Light Mesh is empty or not unique" "bake the file again, as the last step after every other tool",
    VlmAspect "VLM_ASPECT" ERROR "a light is longer than 100 times its height" "bake the file again, or split the triangle if you authored it",
    VlmNode "VLM_NODE" ERROR "a Virtual Light Mesh names a node or primitive that does not exist" "bake the file again, as the last step after every other tool",
    ImageMissing "IMAGE_MISSING" ERROR "an image has no data" "give the image a uri or a bufferView",
    Ktx2 "KTX2" ERROR "textures are compressed as KTX2, which is not read" "decode the textures first: `npx @gltf-transform/cli ktxdecompress in.glb out.glb`",
    BufferMissing "BUFFER_MISSING" ERROR "a buffer has no data" "give the buffer a uri, or export with the data embedded (.glb)",
    NoVlm "NO_VLM" ERROR "the file has no Virtual Light Mesh" "bake it, as the last step after every other tool",
    Stale "STALE" ERROR "the Virtual Light Mesh no longer fits the file around it" "bake again, as the last step after every other tool; where only the extension was lost or renumbered, `vlm relink` attaches it again",
    NotInSource "NOT_IN_SOURCE" ERROR "a node bears lights, but the source has no geometry there" "name the file that was baked, or bake again",
    LightsItself "LIGHTS_ITSELF" ERROR "a light lights the surface for which it stands" "bake again, or tag its object with `extras.vlm.tag`",
    PokesOut "POKES_OUT" ERROR "a light comes out of its object" "bake again, or tag its object with `extras.vlm.tag`",
    TooThin "TOO_THIN" ERROR "a light is longer than 100 times its height: single precision cannot hold its form factor" "bake again, or split the triangle if you authored it",
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl Serialize for Code {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_in_capitals() {
        let mut names: Vec<_> = Code::ALL.iter().map(|code| code.as_str()).collect();
        assert!(
            names
                .iter()
                .all(|name| name.bytes().all(|b| b.is_ascii_uppercase() || b.is_ascii_digit() || b == b'_')),
            "{names:?}"
        );
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Code::ALL.len());
    }

    #[test]
    fn every_code_says_what_it_means_and_what_to_do() {
        for code in Code::ALL {
            for text in [code.meaning(), code.remedy()] {
                assert!(text.len() > 10 && !text.ends_with('.') && !text.contains('|'), "{code}: {text}");
            }
            assert!(!code.severities().is_empty(), "{code}");
        }
    }
}

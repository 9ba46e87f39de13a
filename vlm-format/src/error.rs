//! What can go wrong with a file: each problem has a stable code, a place, a cause and a remedy.

use std::fmt;
use std::io;
use std::path::PathBuf;

use serde::{Serialize, Serializer};

/// Why a file was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder could not be read or written.
    #[error("{}: cannot {action}: {source}; {}", path.display(), io_remedy(source))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried: `read`, `write` and so on.
        action: &'static str,
        /// The operating system's answer.
        source: io::Error,
    },
    /// The file breaks rules that this library relies on.
    #[error("{file}: {}", summary(issues))]
    Invalid {
        /// Name of the file, as the caller gave it.
        file: String,
        /// All problems found, in the order of the checks; at least one.
        issues: Vec<Issue>,
    },
    /// The Virtual Light Meshes no longer belong to the rest of the file.
    #[error("{file}: {}", stale_summary(stale))]
    Stale {
        /// Name of the file, as the caller gave it.
        file: String,
        /// What is stale, and why; at least one.
        stale: Vec<Stale>,
    },
    /// The asset to be written breaks its own rules: a fault of the tool that made it.
    #[error("the Virtual Light Mesh is not valid: {}", summary(issues))]
    Asset {
        /// All problems found; at least one.
        issues: Vec<Issue>,
    },
}

/// A part of the extension that no longer fits the file around it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Stale {
    /// The id of the VLM, or `grid`, or `asset` for what all VLMs share.
    pub vlm: String,
    /// What changed since the bake, for the user to read.
    pub reason: String,
}

/// One problem of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Issue {
    /// Which rule was broken.
    pub code: Code,
    /// Whether the file is refused for it.
    pub severity: Severity,
    /// RFC 6901 JSON pointer of the offending value; empty for the file as a whole.
    pub pointer: String,
    /// What is wrong there.
    pub message: String,
}

/// How much an [`Issue`] matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Can be lived with; the message says what was assumed.
    Warning,
    /// The file is refused.
    Error,
}

impl Issue {
    /// A problem for which the file is refused.
    pub fn error(code: Code, pointer: impl Into<String>, message: impl Into<String>) -> Self {
        Self { code, severity: Severity::Error, pointer: pointer.into(), message: message.into() }
    }

    /// A problem that can be lived with.
    pub fn warning(code: Code, pointer: impl Into<String>, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, pointer, message) }
    }

    /// An error about `file` with this as its only problem.
    pub fn in_file(self, file: &str) -> Error {
        Error::Invalid { file: file.to_owned(), issues: vec![self] }
    }
}

impl fmt::Display for Issue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.pointer.is_empty() {
            write!(f, "{}: ", self.pointer)?;
        }
        write!(f, "{} [{}]; {}", self.message, self.code.as_str(), self.code.remedy())
    }
}

fn summary(issues: &[Issue]) -> String {
    let errors = issues.iter().filter(|issue| issue.severity == Severity::Error).count();
    match issues.iter().find(|issue| issue.severity == Severity::Error).or(issues.first()) {
        Some(first) if errors > 1 => format!("{first} (and {} more)", errors - 1),
        Some(first) => first.to_string(),
        None => String::from("no problem recorded"),
    }
}

fn stale_summary(stale: &[Stale]) -> String {
    // What one tool did to a file often shows in every array; the first few tell what it was.
    const SHOWN: usize = 3;
    let each: Vec<String> =
        stale.iter().take(SHOWN).map(|stale| format!("`{}`: {}", stale.vlm, stale.reason)).collect();
    let more = match stale.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!(" (and {more} more)"),
    };
    format!(
        "the Virtual Light Mesh is stale: {}{more}; bake again, as the last step after every other tool",
        each.join("; ")
    )
}

fn io_remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "check the path: the file or its folder does not exist",
        io::ErrorKind::PermissionDenied => "check the permissions of the file and its folder",
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "free some disk space; nothing was written"
        }
        io::ErrorKind::IsADirectory => "name a file, not a folder",
        io::ErrorKind::NotADirectory => "check the path: one of its folders is a file",
        io::ErrorKind::ReadOnlyFilesystem => "write to another folder",
        _ => "check the file, its folder and the disk",
    }
}

macro_rules! codes {
    ($($variant:ident $name:literal $remedy:literal,)*) => {
        /// The rules that a file can break. Names never change; the list only grows.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum Code {
            $(#[doc = concat!("`", $name, "`: ", $remedy, ".")] $variant,)*
        }

        impl Code {
            /// Every code, in the order of the catalogue.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// The stable name, such as `INDEX_OUT_OF_RANGE`.
            pub fn as_str(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// What the user can do about it.
            pub fn remedy(self) -> &'static str {
                match self { $(Self::$variant => $remedy,)* }
            }
        }
    };
}

codes! {
    NotGltf "NOT_GLTF" "export the model as glTF 2.0 (.glb or .gltf)",
    GlbDamaged "GLB_DAMAGED" "export or download the file again",
    JsonSyntax "JSON_SYNTAX" "export the file again, or mend the JSON at the place named",
    Version "VERSION" "convert the file to glTF 2.0, for example with `npx gltf-pipeline -i in.gltf -o out.glb`",
    WrongType "WRONG_TYPE" "export the file again, or mend the value: the glTF 2.0 specification names its type",
    Missing "MISSING" "export the file again, or add the property: the glTF 2.0 specification requires it",
    WrongValue "WRONG_VALUE" "export the file again, or choose one of the values that the glTF 2.0 specification allows",
    NumberRange "NUMBER_RANGE" "export the file again: the number must be finite in single precision",
    IndexOutOfRange "INDEX_OUT_OF_RANGE" "export the file again: something was removed, but what refers to it was not",
    NodeCycle "NODE_CYCLE" "make the node hierarchy a tree: remove the node from one of its parents",
    ExtensionUnknown "EXTENSION_UNKNOWN" "export without this extension, or move it from extensionsRequired to extensionsUsed if it does not change geometry",
    Draco "DRACO" "decode it first: `npx @gltf-transform/cli copy in.glb out.glb`",
    UriUnsafe "URI_UNSAFE" "put the file beside the glTF (or in a folder below it) and refer to it by a relative path",
    UriUnreadable "URI_UNREADABLE" "put the file beside the glTF, or export with the data embedded (.glb)",
    UriNeedsFolder "URI_NEEDS_FOLDER" "pass the file by its path, or as a .glb with all data inside",
    DataUri "DATA_URI" "export the file again: data URIs must be base64",
    BufferShort "BUFFER_SHORT" "export or download the file again: its binary data is cut off",
    ViewOutOfRange "VIEW_OUT_OF_RANGE" "export the file again: the buffer view reaches past its buffer",
    AccessorOutOfRange "ACCESSOR_OUT_OF_RANGE" "export the file again: the accessor reaches past its buffer view",
    AccessorType "ACCESSOR_TYPE" "export the file again: the accessor has another type than its use requires",
    AccessorTooLarge "ACCESSOR_TOO_LARGE" "export the file again: the accessor claims more elements than its data can hold",
    AttributeCount "ATTRIBUTE_COUNT" "export the file again: all attributes of a primitive need the same number of elements",
    SparseIndex "SPARSE_INDEX" "export the file again: sparse indices must be below the accessor's count",
    VertexNotFinite "VERTEX_NOT_FINITE" "recompute or delete the vertex in the modelling tool (a division by zero is the usual cause)",
    VertexIndex "VERTEX_INDEX" "export the file again: an index names a vertex that does not exist",
    Compression "COMPRESSION" "compress the file again, or decode it with `npx @gltf-transform/cli copy in.glb out.glb`",
    FileName "FILE_NAME" "name the output .glb or .gltf",
    TooLarge "TOO_LARGE" "write a .gltf with its data beside it, or make the file smaller: a GLB holds at most 4 GiB",
    VlmLength "VLM_LENGTH" "bake the file again",
    VlmRange "VLM_RANGE" "bake the file again",
    VlmIndex "VLM_INDEX" "bake the file again",
    VlmNumber "VLM_NUMBER" "bake the file again",
    VlmOrder "VLM_ORDER" "bake the file again",
    VlmId "VLM_ID" "bake the file again, as the last step after every other tool",
    VlmAspect "VLM_ASPECT" "bake the file again, or split the triangle if you authored it",
    VlmNode "VLM_NODE" "bake the file again, as the last step after every other tool",
    ImageMissing "IMAGE_MISSING" "give the image a uri or a bufferView",
    Ktx2 "KTX2" "decode the textures first: `npx @gltf-transform/cli ktxdecompress in.glb out.glb`",
    BufferMissing "BUFFER_MISSING" "give the buffer a uri, or export with the data embedded (.glb)",
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
    fn the_message_names_file_place_cause_and_remedy() {
        let issue = Issue::error(Code::NodeCycle, "/nodes/3", "the node is its own ancestor");
        let text = issue.in_file("loop.gltf").to_string();
        for part in ["loop.gltf", "/nodes/3", "own ancestor", "NODE_CYCLE", "make the node hierarchy a tree"]
        {
            assert!(text.contains(part), "{part} is missing in: {text}");
        }
    }

    #[test]
    fn code_names_are_unique() {
        let mut names: Vec<_> = Code::ALL.iter().map(|code| code.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Code::ALL.len());
    }
}

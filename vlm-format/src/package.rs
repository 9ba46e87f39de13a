//! The parts of a glTF file on their way to disk: JSON, buffers, container.
//!
//! A change of container changes only what it forces: buffer 0 moves between the BIN chunk and a URI. Every other URI
//! stays as it is, and the files that relative URIs name are passed on beside the output.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use base64::Engine;
use serde_json::{Value, json};

use crate::check::array;
use crate::container::{GltfFile, Kind, Text};
use crate::error::{Code, Error, Issue};
use crate::glb;
use crate::patch::{Patched, fresh, patch};
use crate::uri;

/// How an output is packed, and its file name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// The container.
    pub container: Container,
    /// Name of the main file, without a folder; names of files beside it derive from it.
    pub file_name: String,
}

/// The container of an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// One binary file.
    Glb,
    /// JSON.
    Gltf {
        /// What we add goes into a data URI (a third larger) rather than into a file beside it.
        embedded: bool,
    },
}

/// One file of an output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputFile {
    /// Path relative to the output folder; it never leaves it.
    pub path: PathBuf,
    /// Content.
    pub bytes: Vec<u8>,
    /// Where it was copied from, for a file that is passed on as it is.
    pub copied_from: Option<PathBuf>,
}

impl Target {
    /// Chooses the container by the extension of the output's path: `.glb` or `.gltf` (with its data beside it).
    ///
    /// # Errors
    /// [`Error::Invalid`] for any other extension.
    pub fn from_path(path: &Path) -> Result<Self, Error> {
        let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default().to_ascii_lowercase();
        let container = match extension.as_str() {
            "glb" => Some(Container::Glb),
            "gltf" => Some(Container::Gltf { embedded: false }),
            _ => None,
        };
        match (container, path.file_name().and_then(OsStr::to_str)) {
            (Some(container), Some(name)) => Ok(Self { container, file_name: name.to_owned() }),
            _ => {
                let issue = Issue::error(
                    Code::FileName,
                    "",
                    "the output is neither .glb nor .gltf, or its name is not UTF-8",
                );
                Err(issue.in_file(&path.display().to_string()))
            }
        }
    }

    /// The kind of file that the container is.
    pub(crate) fn kind(&self) -> Kind {
        if self.container == Container::Glb { Kind::Glb } else { Kind::Gltf }
    }

    fn stem(&self) -> &str {
        self.file_name.rsplit_once('.').map_or(self.file_name.as_str(), |(stem, _)| stem)
    }
}

/// Hexadecimal digits of the content in the names of files that the extension adds.
const CONTENT_DIGITS: usize = 16;

/// True for the name of a file that the extension added to a .gltf of that stem, whatever its content.
pub(crate) fn is_data_of(stem: &str, name: &str) -> bool {
    let digits = name
        .strip_prefix(stem)
        .and_then(|rest| rest.strip_prefix(".vlm."))
        .and_then(|rest| rest.strip_suffix(".bin"));
    digits.is_some_and(|digits| {
        digits.len() == CONTENT_DIGITS && digits.bytes().all(|digit| digit.is_ascii_hexdigit())
    })
}

/// A glTF file taken apart.
#[derive(Clone, Debug)]
pub(crate) struct Parts {
    pub(crate) json: Value,
    /// The data of the BIN chunk. In a GLB it is buffer 0 if that has no URI.
    pub(crate) bin: Option<Vec<u8>>,
    /// Chunks of the GLB beyond JSON and BIN.
    others: Vec<(u32, Vec<u8>)>,
    /// Files that relative URIs name.
    files: Vec<OutputFile>,
    kind: Kind,
    /// The text that the JSON's own follows, so that bytes stay and version control shows little more than what was added.
    text: Text,
}

impl Parts {
    /// Takes a file apart. Files beside it that cannot be read are left out, as they are missing already.
    pub(crate) fn of(file: &GltfFile) -> Self {
        let mut files: Vec<OutputFile> = Vec::new();
        for (uri, path) in file.external_uris() {
            let known = files.iter().any(|file| file.path == path);
            if let (false, Ok(bytes)) = (known, uri::load(uri, file.folder(), "")) {
                let copied_from = Some(file.folder().unwrap_or(Path::new("")).join(&path));
                files.push(OutputFile { path, bytes, copied_from });
            }
        }
        Self {
            json: file.json().clone(),
            bin: file.bin().map(<[u8]>::to_vec),
            others: file.other_chunks().to_vec(),
            files,
            kind: file.kind().clone(),
            text: file.text().clone(),
        }
    }

    /// Moves buffer 0 to where the target's container has it. Text of another container is written anew.
    pub(crate) fn convert(&mut self, file: &GltfFile, target: &Target) {
        let kind = target.kind();
        if self.kind == kind {
            return;
        }
        let indent = match kind {
            Kind::Glb => {
                self.buffer_to_bin(file);
                None
            }
            Kind::Gltf => {
                self.bin_to_uri(target);
                Some(String::from("  "))
            }
        };
        self.text = Text { object: fresh(&self.json, indent.as_deref()), indent, ..Text::default() };
        self.kind = kind;
    }

    /// Makes the JSON as it is now the text that later changes follow.
    pub(crate) fn settle(&mut self) {
        self.text.object = patch(&self.text.object, &self.json, self.text.indent.as_deref()).text;
    }

    /// Buffer 0 becomes the BIN chunk, unless it has no data (a fallback of compressed data).
    fn buffer_to_bin(&mut self, file: &GltfFile) {
        let Some(Value::Object(buffer)) = self.json.pointer_mut("/buffers/0") else { return };
        let Some(uri) = buffer.shift_remove("uri") else { return };
        self.bin = file.buffer(0).map(<[u8]>::to_vec);
        let path = uri.as_str().and_then(|uri| match uri::locate(uri, "") {
            Ok(uri::Location::Relative(path)) => Some(path),
            _ => None,
        });
        let still_used = array(&self.json, "/buffers")
            .iter()
            .chain(array(&self.json, "/images"))
            .any(|item| item.get("uri") == Some(&uri));
        self.files.retain(|file| still_used || Some(&file.path) != path.as_ref());
    }

    /// The BIN chunk becomes a file beside the output, or a data URI.
    fn bin_to_uri(&mut self, target: &Target) {
        let uses_bin = self.json.pointer("/buffers/0").is_some_and(|buffer| buffer.get("uri").is_none());
        let Some(bin) = self.bin.take_if(|_| uses_bin) else { return };
        let uri = self.place(bin, target, "bin");
        if let Some(Value::Object(buffer)) = self.json.pointer_mut("/buffers/0") {
            buffer.insert(String::from("uri"), uri);
        }
    }

    /// Puts data into a data URI or a new file, and returns the URI.
    pub(crate) fn place(&mut self, bytes: Vec<u8>, target: &Target, suffix: &str) -> Value {
        if target.container != (Container::Gltf { embedded: false }) {
            let text = base64::engine::general_purpose::STANDARD.encode(&bytes);
            return json!(format!("data:application/octet-stream;base64,{text}"));
        }
        let names = (0..).map(|n| match n {
            0 => format!("{}.{suffix}", target.stem()),
            n => format!("{}.{n}.{suffix}", target.stem()),
        });
        let taken = |name: &String| self.files.iter().any(|file| file.path == Path::new(name));
        let name = names.into_iter().find(|name| !taken(name)).unwrap_or_default();
        let uri = json!(percent_encode(&name));
        self.files.push(OutputFile { path: PathBuf::from(name), bytes, copied_from: None });
        uri
    }

    /// As [`Self::place`], but what the extension adds is named for its content: then a main file and its data belong together, though
    /// they reach the disk one after the other.
    pub(crate) fn place_by_content(&mut self, bytes: Vec<u8>, target: &Target) -> Value {
        let hash = blake3::hash(&bytes).to_hex();
        let digits = hash.as_str().get(..CONTENT_DIGITS).unwrap_or_default();
        self.place(bytes, target, &format!("vlm.{digits}.bin"))
    }

    /// True if data can be appended to buffer 0 as the BIN chunk (or such a buffer can be made).
    pub(crate) fn appends_to_bin(&self) -> bool {
        let first = self.json.pointer("/buffers/0");
        self.kind == Kind::Glb && first.is_none_or(|buffer| buffer.get("uri").is_none() && self.bin.is_some())
    }

    /// Forgets the file that a URI names, for a buffer that is taken out.
    pub(crate) fn drop_file(&mut self, uri: &str) {
        if let Ok(uri::Location::Relative(path)) = uri::locate(uri, "") {
            self.files.retain(|file| file.path != path);
        }
    }

    /// The bytes of the main file; `None` if they would exceed what a GLB can hold.
    pub(crate) fn main_bytes(&self) -> Option<Vec<u8>> {
        let Text { before, after, indent, .. } = &self.text;
        let Patched { mut text, gap } = patch(&self.text.object, &self.json, indent.as_deref());
        if let (Kind::Glb, Some(gap)) = (&self.kind, gap) {
            // Padding of the chunk that goes when the additions go; the file's own stays at the end.
            let length = before.len() + text.len() + after.len();
            text.insert_str(gap, &"   "[..length.next_multiple_of(4) - length]);
        }
        let json = [before, text.as_bytes(), after].concat();
        match self.kind {
            Kind::Glb => glb::build(&json, self.bin.as_deref(), &self.others),
            Kind::Gltf => Some(json),
        }
    }

    /// The files of the output; the main one first.
    pub(crate) fn pack(self, target: &Target) -> Result<Vec<OutputFile>, Error> {
        let Some(bytes) = self.main_bytes() else {
            return Err(
                Issue::error(Code::TooLarge, "", "the output exceeds 4 GiB").in_file(&target.file_name)
            );
        };
        let main = OutputFile { path: PathBuf::from(&target.file_name), bytes, copied_from: None };
        Ok(std::iter::once(main).chain(self.files).collect())
    }
}

/// Encodes what may not stand in a relative URI (RFC 3986, section 3.3; `:` could be taken for a scheme).
fn percent_encode(name: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~!$&'()*+,;=@".contains(&byte);
    name.bytes()
        .map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") })
        .collect()
}

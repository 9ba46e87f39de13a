//! A glTF file in memory: JSON as it was written, its buffers, and a typed view that is safe to walk.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde_json::Value;

use crate::check::{self, array, count, index, layout};
use crate::codec;
use crate::error::{Code, Error, Issue};
use crate::glb;
use crate::typed;
use crate::uri;

/// How the file was packed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One binary file (.glb).
    Glb,
    /// JSON (.gltf), with its data in data URIs or files beside it.
    Gltf,
}

/// A checked glTF file with all its buffers in memory.
#[derive(Debug)]
pub struct GltfFile {
    name: String,
    folder: Option<PathBuf>,
    kind: Kind,
    /// The JSON as it was written.
    text: Text,
    json: Value,
    document: gltf::Document,
    /// The BIN chunk: buffer 0, if that has no URI.
    bin: Option<Vec<u8>>,
    /// One per buffer; empty for the one that is the BIN chunk.
    buffers: Vec<Vec<u8>>,
    /// Chunks of the GLB beyond JSON and BIN.
    other_chunks: Vec<(u32, Vec<u8>)>,
    /// Compressed buffer views, decoded when first asked for.
    decoded: Vec<OnceLock<Result<Vec<u8>, Issue>>>,
    warnings: Vec<Issue>,
    /// Bytes of the main file.
    main_bytes: usize,
}

/// JSON text as it stands in its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Text {
    /// Byte order mark and white space.
    pub before: Vec<u8>,
    /// The object, from brace to brace.
    pub object: String,
    /// White space; in a GLB, padding, which some writers make of zeros.
    pub after: Vec<u8>,
    /// What each level is indented by; `None` for JSON on one line.
    pub indent: Option<String>,
}

impl GltfFile {
    /// Reads a .glb or .gltf file; its content decides which it is, not its name.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read, [`Error::Invalid`] with every problem found if it cannot be relied on.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let io = |source| Error::Io { path: path.to_owned(), action: "read", source };
        let bytes = fs::read(path).map_err(io)?;
        Self::from_slice(&bytes, &path.display().to_string(), path.parent())
    }

    /// Reads the bytes of a .glb or .gltf file. `name` is for messages. `folder` is where files beside it lie; without
    /// one (a pipe), all data must be inside.
    ///
    /// # Errors
    /// [`Error::Invalid`] with every problem found if the file cannot be relied on.
    pub fn from_slice(bytes: &[u8], name: &str, folder: Option<&Path>) -> Result<Self, Error> {
        let refuse = |issue: Issue| issue.in_file(name);
        let packed = unpack(bytes).map_err(refuse)?;
        let mut report = check::check_json(&packed.json);
        report.refuse(name)?;
        let buffers = load_buffers(&packed.json, folder).map_err(refuse)?;
        let sizes = usable_bytes(&packed.json, packed.bin, &buffers).map_err(refuse)?;
        layout::check(&packed.json, &sizes, &mut report);
        report.refuse(name)?;
        let document = typed::document(&packed.json).map_err(refuse)?;
        Ok(Self {
            name: name.to_owned(),
            folder: folder.map(Path::to_owned),
            kind: packed.kind,
            text: packed.text,
            document,
            bin: packed.bin.map(<[u8]>::to_vec),
            buffers,
            other_chunks: packed.others,
            decoded: array(&packed.json, "/bufferViews").iter().map(|_| OnceLock::new()).collect(),
            json: packed.json,
            warnings: report.into_issues(),
            main_bytes: bytes.len(),
        })
    }

    /// The name for messages, as the caller gave it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How the file was packed.
    pub fn kind(&self) -> &Kind {
        &self.kind
    }

    /// The JSON as it was read: key order, unknown extensions and extras included.
    pub fn json(&self) -> &Value {
        &self.json
    }

    /// The typed view of the JSON. Every index in it leads somewhere and the nodes are a forest, so it may be walked
    /// freely, with these exceptions: animations are left out; a texture without a readable source has none; the
    /// bytes of images are to be had from [`Self::image_bytes`], and those of accessors from the `read_` methods.
    pub fn document(&self) -> &gltf::Document {
        &self.document
    }

    /// Problems that can be lived with.
    pub fn warnings(&self) -> &[Issue] {
        &self.warnings
    }

    /// The encoded bytes of an image (PNG, JPEG, WebP, whatever the file holds).
    ///
    /// # Errors
    /// [`Error::Invalid`] if the image does not exist or its file cannot be read.
    pub fn image_bytes(&self, image: usize) -> Result<Cow<'_, [u8]>, Error> {
        let pointer = format!("/images/{image}");
        let json = array(&self.json, "/images").get(image).unwrap_or(&Value::Null);
        let uri = json.get("uri").and_then(Value::as_str);
        let bytes = match (index(json, "bufferView"), uri) {
            (Some(view), _) => self.view_bytes(view).map(Cow::Borrowed),
            (None, Some(uri)) => {
                uri::load(uri, self.folder.as_deref(), &format!("{pointer}/uri")).map(Cow::Owned)
            }
            (None, None) => {
                Err(Issue::error(Code::ImageMissing, pointer, "the image has neither uri nor bufferView"))
            }
        };
        bytes.map_err(|issue| issue.in_file(&self.name))
    }

    /// The files beside this one that it refers to (buffers, then images), for watchers and caches. They need not exist.
    pub fn external_files(&self) -> Vec<PathBuf> {
        let folder = self.folder.as_deref().unwrap_or(Path::new(""));
        self.external_uris().map(|(_, path)| folder.join(path)).collect()
    }

    /// URI and relative path of every file beside this one.
    pub(crate) fn external_uris(&self) -> impl Iterator<Item = (&str, PathBuf)> {
        let items = array(&self.json, "/buffers").iter().chain(array(&self.json, "/images"));
        items.filter_map(|item| {
            let uri = item.get("uri")?.as_str()?;
            match uri::locate(uri, "") {
                Ok(uri::Location::Relative(path)) => Some((uri, path)),
                _ => None,
            }
        })
    }

    /// The bytes of a buffer view, decompressed where it is compressed.
    pub(crate) fn view_bytes(&self, view: usize) -> Result<&[u8], Issue> {
        let pointer = || format!("/bufferViews/{view}");
        let json = array(&self.json, "/bufferViews").get(view).ok_or_else(|| {
            Issue::error(Code::IndexOutOfRange, "/bufferViews", format!("there is no buffer view {view}"))
        })?;
        let Some((extension, source)) = layout::meshopt(json) else {
            return self.range(json).ok_or_else(|| cut_off(pointer()));
        };
        let decode = || {
            let pointer = format!("{}/extensions/{extension}", pointer());
            let encoded = self.range(source).ok_or_else(|| cut_off(pointer.clone()))?;
            codec::decode(source, encoded, &pointer)
        };
        let slot = self.decoded.get(view).ok_or_else(|| cut_off(pointer()))?;
        slot.get_or_init(decode).as_deref().map_err(Clone::clone)
    }

    /// The bytes that `buffer`, `byteOffset` and `byteLength` name.
    fn range(&self, json: &Value) -> Option<&[u8]> {
        let start = usize::try_from(count(json, "byteOffset").unwrap_or_default()).ok()?;
        let length = usize::try_from(count(json, "byteLength")?).ok()?;
        self.buffer(index(json, "buffer")?)?.get(start..start.checked_add(length)?)
    }

    /// The data of a buffer, padding included.
    pub(crate) fn buffer(&self, buffer: usize) -> Option<&[u8]> {
        let has_uri = array(&self.json, "/buffers").get(buffer)?.get("uri").is_some();
        if buffer == 0 && !has_uri { self.bin() } else { self.buffers.get(buffer).map(Vec::as_slice) }
    }

    /// The data of the BIN chunk, padding included.
    pub(crate) fn bin(&self) -> Option<&[u8]> {
        self.bin.as_deref()
    }

    /// Chunks of the GLB beyond JSON and BIN.
    pub(crate) fn other_chunks(&self) -> &[(u32, Vec<u8>)] {
        &self.other_chunks
    }

    /// The JSON as it was written.
    pub(crate) fn text(&self) -> &Text {
        &self.text
    }

    /// Bytes of the .glb or .gltf file itself, without files beside it.
    #[must_use]
    pub fn main_bytes(&self) -> usize {
        self.main_bytes
    }

    /// Where files beside this one lie.
    pub(crate) fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }
}

fn cut_off(pointer: String) -> Issue {
    Issue::error(Code::ViewOutOfRange, pointer, "the data is cut off")
}

/// The parts of a file, before any check.
struct Unpacked<'a> {
    kind: Kind,
    text: Text,
    json: Value,
    bin: Option<&'a [u8]>,
    others: Vec<(u32, Vec<u8>)>,
}

fn unpack(bytes: &[u8]) -> Result<Unpacked<'_>, Issue> {
    if glb::is_glb(bytes) {
        let glb = glb::parse(bytes)?;
        let others = glb.others.into_iter().map(|(kind, data)| (kind, data.to_vec())).collect();
        let (text, json) = parse_json(glb.json)?;
        return Ok(Unpacked { kind: Kind::Glb, text, json, bin: glb.bin, others });
    }
    let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    if text.trim_ascii_start().first() != Some(&b'{') {
        return Err(Issue::error(Code::NotGltf, "", "the file is neither GLB nor JSON"));
    }
    let (text, json) = parse_json(bytes)?;
    Ok(Unpacked { kind: Kind::Gltf, text, json, bin: None, others: Vec::new() })
}

const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// The white space before the first key, if that stands on a line of its own.
fn indent(json: &str) -> Option<String> {
    let rest = json.strip_prefix('{')?;
    let blank = &rest[..rest.len() - rest.trim_start().len()];
    Some(blank[blank.rfind('\n')? + 1..].to_owned())
}

fn parse_json(bytes: &[u8]) -> Result<(Text, Value), Issue> {
    let refuse = |error: &dyn std::fmt::Display| {
        Issue::error(Code::JsonSyntax, "", format!("the JSON cannot be parsed: {error}"))
    };
    let marked = if bytes.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
    let start = bytes.len() - bytes[marked..].trim_ascii_start().len();
    // Some writers pad the JSON chunk with zeros where the specification asks for spaces.
    let is_padding = |byte: &u8| *byte == 0 || byte.is_ascii_whitespace();
    let end = bytes.iter().rposition(|byte| !is_padding(byte)).map_or(0, |last| last + 1).max(start);
    let json = serde_json::from_slice(&bytes[start..end]).map_err(|error| refuse(&error))?;
    let object = std::str::from_utf8(&bytes[start..end]).map_err(|error| refuse(&error))?.to_owned();
    let indent = indent(&object);
    let text = Text { before: bytes[..start].to_vec(), object, after: bytes[end..].to_vec(), indent };
    Ok((text, json))
}

/// The data of all buffers but the BIN chunk.
fn load_buffers(json: &Value, folder: Option<&Path>) -> Result<Vec<Vec<u8>>, Issue> {
    let load = |(i, buffer): (usize, &Value)| match buffer.get("uri").and_then(Value::as_str) {
        Some(uri) => uri::load(uri, folder, &format!("/buffers/{i}/uri")),
        None => Ok(Vec::new()),
    };
    array(json, "/buffers").iter().enumerate().map(load).collect()
}

/// How many bytes of each buffer may be referred to: all that it promises, which must be there.
fn usable_bytes(json: &Value, bin: Option<&[u8]>, buffers: &[Vec<u8>]) -> Result<Vec<u64>, Issue> {
    let mut usable = Vec::new();
    for (i, (buffer, data)) in array(json, "/buffers").iter().zip(buffers).enumerate() {
        let is_bin = i == 0 && buffer.get("uri").is_none();
        let promised = count(buffer, "byteLength").unwrap_or_default();
        if is_bin && bin.is_none() && promised > 0 && !is_fallback(buffer) {
            let message =
                format!("the buffer has no uri, and there is no BIN chunk for its {promised} bytes");
            return Err(Issue::error(Code::BufferMissing, format!("/buffers/{i}"), message));
        }
        let available = if is_bin { bin.map_or(0, <[u8]>::len) } else { data.len() } as u64;
        if available < promised && !is_fallback(buffer) {
            let message = format!("the buffer has {available} bytes of the {promised} that it promises");
            return Err(Issue::error(Code::BufferShort, format!("/buffers/{i}"), message));
        }
        usable.push(promised.min(available));
    }
    Ok(usable)
}

/// True for a buffer that stands for decompressed data and need not have any of its own.
fn is_fallback(buffer: &Value) -> bool {
    ["EXT_meshopt_compression", "KHR_meshopt_compression"]
        .into_iter()
        .any(|name| buffer.pointer(&format!("/extensions/{name}/fallback")) == Some(&Value::Bool(true)))
}

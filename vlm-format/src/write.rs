//! Writes a [`VlmAsset`] into a glTF file: patches the JSON, appends to the data, touches nothing else.

use std::collections::BTreeMap;

use glam::Vec3;
use serde_json::{Map, Value, json};

use crate::asset::{Sample, VlmAsset};
use crate::check::array;
use crate::compress::{self, Codec};
use crate::container::GltfFile;
use crate::digest::{self, Source};
use crate::error::Error;
use crate::grid::Grid;
use crate::package::{OutputFile, Parts, Target};
use crate::strip::{EMPTY, EXTENSION, empty_places, source_digest, strip};
use crate::validate::validate_in;

/// How [`write_vlm_with`] stores an asset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WriteOptions {
    /// Compresses every array that this makes smaller, without loss. Only readers that know the property `compression` of arrays can read
    /// the Virtual Light Meshes then; the rest of the file is as open to all others as without.
    pub compress: bool,
}

/// Adds Virtual Light Meshes to a file. Those that it has already are replaced.
///
/// Returns the files of the output, the main one first; nothing is written to disk, see [`crate::write_atomic`]. Every
/// byte and JSON value of the input stays as it was. If the container changes, buffer 0 moves between the BIN chunk and
/// a URI; all other URIs stay, and the files that they name are returned too.
///
/// # Errors
/// [`Error::Asset`] if the asset breaks its invariants or names nodes or primitives that the file lacks;
/// [`Error::Invalid`] if the geometry cannot be read or the output would be too large.
pub fn write_vlm(file: &GltfFile, asset: &VlmAsset, target: &Target) -> Result<Vec<OutputFile>, Error> {
    write_vlm_with(file, asset, target, &WriteOptions::default())
}

/// Adds Virtual Light Meshes to a file as [`write_vlm`] does, stored as `options` say.
///
/// # Errors
/// As [`write_vlm`].
pub fn write_vlm_with(
    file: &GltfFile,
    asset: &VlmAsset,
    target: &Target,
    options: &WriteOptions,
) -> Result<Vec<OutputFile>, Error> {
    let issues = validate_in(file, asset);
    if !issues.is_empty() {
        return Err(Error::Asset { issues });
    }
    let mut parts = Parts::of(file);
    let removed = strip(&mut parts);
    let source_digest = source_digest(file, &parts, removed.is_some());
    parts.convert(file, target);
    let traces = Traces { source_digest, empty: empty_places(&mut parts.json) };
    let mut extension = Arrays::new(&parts.json, options).extension(asset);
    add_digests(&mut extension.json, file, asset)?;
    refer(&mut parts.json, asset, std::mem::take(&mut extension.triangle_tags));
    extension.append_to(&mut parts, target, traces);
    parts.pack(target)
}

/// What stripping has to know of the file before writing.
struct Traces {
    source_digest: Option<String>,
    /// Pointers of lists and objects that were there, and empty.
    empty: Vec<String>,
}

/// The arrays of an asset on their way into one buffer view.
struct Arrays {
    bytes: Vec<u8>,
    /// Accessors, to be appended to those of the file.
    accessors: Vec<Value>,
    first_accessor: usize,
    view: usize,
    compress: bool,
}

/// The root object, and the data that it refers to.
struct Extension {
    json: Map<String, Value>,
    /// The objects of the primitives whose triangles have tags, in the order of the asset.
    triangle_tags: Vec<Value>,
    arrays: Arrays,
}

impl Arrays {
    fn new(root: &Value, options: &WriteOptions) -> Self {
        Self {
            bytes: Vec::new(),
            accessors: Vec::new(),
            first_accessor: array(root, "/accessors").len(),
            view: array(root, "/bufferViews").len(),
            compress: options.compress,
        }
    }

    fn extension(mut self, asset: &VlmAsset) -> Extension {
        let mut json = Map::new();
        json.insert(String::from("generator"), json!(asset.generator));
        json.insert(String::from("settings"), serde_json::to_value(&asset.settings).unwrap_or_default());
        json.insert(String::from("vlms"), asset.vlms.iter().map(vlm_json).collect());
        json.insert(String::from("lights"), self.lights(asset));
        json.insert(String::from("samples"), self.samples(asset));
        if let Some(grid) = &asset.grid {
            json.insert(String::from("grid"), self.grid(grid));
        }
        let triangle_tags = asset.triangle_tags.iter().map(|entry| self.triangle_tags(&entry.tags)).collect();
        Extension { json, triangle_tags, arrays: self }
    }

    fn lights(&mut self, asset: &VlmAsset) -> Value {
        let mut json = Map::new();
        self.vectors(&mut json, "lights/positions", &asset.positions);
        self.integers(&mut json, "lights/indices", asset.triangles.as_flattened());
        self.vectors(&mut json, "lights/albedo", &asset.albedo);
        self.vectors(&mut json, "lights/emission", &asset.emission);
        self.integers(&mut json, "lights/tags", &asset.tags);
        Value::Object(json)
    }

    fn samples(&mut self, asset: &VlmAsset) -> Value {
        let column = |part: fn(&Sample) -> Vec3| asset.samples.iter().map(part).collect::<Vec<Vec3>>();
        let mut json = Map::new();
        self.integers(&mut json, "samples/starts", &asset.sample_starts);
        self.vectors(&mut json, "samples/positions", &column(|sample| sample.position));
        self.vectors(&mut json, "samples/normals", &column(|sample| sample.normal));
        self.vectors(&mut json, "samples/reflectance", &column(|sample| sample.reflectance));
        Value::Object(json)
    }

    fn grid(&mut self, grid: &Grid) -> Value {
        let mut json = Map::new();
        json.insert(String::from("origin"), json!(grid.origin.to_array()));
        json.insert(String::from("cellSize"), json!(grid.cell_size));
        json.insert(String::from("dimensions"), json!(grid.dimensions));
        json.insert(String::from("surfaceProbes"), json!(grid.surface_probes));
        self.integers(&mut json, "grid/cells", &grid.cells);
        self.integers(&mut json, "grid/leaves", bytemuck::cast_slice(&grid.leaves));
        self.integers(&mut json, "grid/leafProbes", &grid.leaf_probes);
        self.integers(&mut json, "grid/nearStarts", &grid.near_starts);
        self.integers(&mut json, "grid/near", &grid.near);
        self.scalars(&mut json, "grid/nearFormFactors", &grid.near_form_factors);
        self.structs(&mut json, "grid/probes", bytemuck::cast_slice(&grid.probes));
        self.scalars(&mut json, "grid/sampleShares", &grid.sample_shares);
        self.scalars(&mut json, "grid/surfaceGains", &grid.surface_gains);
        self.structs(&mut json, "grid/uncovered", bytemuck::cast_slice(&grid.uncovered));
        self.integers(&mut json, "grid/rowStarts", &grid.row_starts);
        self.integers(&mut json, "grid/rows", &grid.rows);
        Value::Object(json)
    }

    fn triangle_tags(&mut self, tags: &[u32]) -> Value {
        let mut json = Map::new();
        self.integers(&mut json, "triangleTags", tags);
        Value::Object(json)
    }

    fn vectors(&mut self, json: &mut Map<String, Value>, name: &str, values: &[Vec3]) {
        let bytes: Vec<u8> =
            values.iter().flat_map(|value| value.to_array()).flat_map(f32::to_le_bytes).collect();
        self.push(json, name, "VEC3", 5126, values.len(), &bytes);
    }

    /// Structs of vectors of four numbers.
    fn structs(&mut self, json: &mut Map<String, Value>, name: &str, vectors: &[[f32; 4]]) {
        let bytes: Vec<u8> = vectors.iter().flatten().copied().flat_map(f32::to_le_bytes).collect();
        self.push(json, name, "VEC4", 5126, vectors.len(), &bytes);
    }

    fn scalars(&mut self, json: &mut Map<String, Value>, name: &str, values: &[f32]) {
        let bytes: Vec<u8> = values.iter().copied().flat_map(f32::to_le_bytes).collect();
        self.push(json, name, "SCALAR", 5126, values.len(), &bytes);
    }

    fn integers(&mut self, json: &mut Map<String, Value>, name: &str, values: &[u32]) {
        let bytes: Vec<u8> = values.iter().copied().flat_map(u32::to_le_bytes).collect();
        self.push(json, name, "SCALAR", 5125, values.len(), &bytes);
    }

    /// Adds an accessor. An empty array has none: glTF's accessors have one element at least.
    fn push(
        &mut self,
        json: &mut Map<String, Value>,
        name: &str,
        kind: &str,
        component: u32,
        count: usize,
        bytes: &[u8],
    ) {
        if count == 0 {
            return;
        }
        let accessor = self.first_accessor + self.accessors.len();
        let mut place = json!({ "accessor": accessor, "digest": digest::of_array(kind, bytes) });
        let compressed = if self.compress { Codec::encode(name, bytes) } else { None };
        match compressed {
            Some((codec, encoded)) => {
                place[compress::PROPERTY] = codec.json();
                self.store("SCALAR", 5121, encoded.len(), &encoded);
            }
            None => self.store(kind, component, count, bytes),
        }
        json.insert(name.rsplit('/').next().unwrap_or(name).to_owned(), place);
    }

    fn store(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) {
        self.accessors.push(json!({
            "bufferView": self.view,
            "byteOffset": self.bytes.len(),
            "componentType": component,
            "count": count,
            "type": kind,
        }));
        self.bytes.extend_from_slice(bytes);
        // What is compressed ends anywhere, but numbers of four bytes start at multiples of four.
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
    }
}

fn vlm_json(vlm: &crate::asset::Vlm) -> Value {
    let mut json = json!({ "id": vlm.id, "lights": vlm.lights, "vertices": vlm.vertices });
    if vlm.authored {
        json["authored"] = json!(true);
    }
    json
}

/// Digests of what the lights and the grid were made from.
fn add_digests(extension: &mut Map<String, Value>, file: &GltfFile, asset: &VlmAsset) -> Result<(), Error> {
    let mut source = Source::new(file);
    let vlms = extension.get_mut("vlms").and_then(Value::as_array_mut);
    for (json, vlm) in vlms.into_iter().flatten().zip(&asset.vlms) {
        let node = vlm.node as usize;
        json["digests"] = json!({ "geometry": source.geometry(node)?, "transform": source.transform(node)? });
    }
    if let Some(grid) = extension.get_mut("grid") {
        grid["sceneDigest"] = json!(source.scene()?);
    }
    Ok(())
}

impl Extension {
    /// Appends data, buffer view and accessors, and sets the root object.
    fn append_to(mut self, parts: &mut Parts, target: &Target, traces: Traces) {
        let (view, byte_length) = (self.arrays.view, self.arrays.bytes.len());
        let place = if parts.appends_to_bin() {
            append_to_bin(parts, &self.arrays.bytes)
        } else {
            add_buffer(parts, std::mem::take(&mut self.arrays.bytes), target)
        };
        push(
            &mut parts.json,
            "bufferViews",
            json!({
                "buffer": place.buffer,
                "byteOffset": place.offset,
                "byteLength": byte_length,
                "name": EXTENSION,
            }),
        );
        for accessor in self.arrays.accessors {
            push(&mut parts.json, "accessors", accessor);
        }
        let mut data = json!({ "bufferView": view, "bufferByteLength": place.length_before });
        if let Some(digest) = traces.source_digest {
            data["sourceDigest"] = json!(digest);
        }
        if !traces.empty.is_empty() {
            data[EMPTY] = json!(traces.empty);
        }
        self.json.insert(String::from("data"), data);
        let mut json = Value::Object(self.json);
        shorten_floats(&mut json);
        insert_extension(&mut parts.json, json);
        push(&mut parts.json, "extensionsUsed", json!(EXTENSION));
    }
}

/// Writes numbers of single precision with as few digits as they need: 0.1, not 0.10000000149011612.
fn shorten_floats(json: &mut Value) {
    match json {
        Value::Array(list) => list.iter_mut().for_each(shorten_floats),
        Value::Object(map) => map.values_mut().for_each(shorten_floats),
        Value::Number(number) if number.is_f64() => {
            let single = number.as_f64().map(|number| number as f32);
            let shortest = single.and_then(|single| single.to_string().parse::<f64>().ok());
            if let Some(shortest) = shortest.and_then(serde_json::Number::from_f64) {
                *number = shortest;
            }
        }
        _ => {}
    }
}

/// Where the data went.
struct Place {
    buffer: usize,
    offset: usize,
    /// `byteLength` of the buffer before; 0 if it did not exist.
    length_before: u64,
}

fn append_to_bin(parts: &mut Parts, bytes: &[u8]) -> Place {
    let bin = parts.bin.get_or_insert_default();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let offset = bin.len();
    bin.extend_from_slice(bytes);
    let length = json!(bin.len());
    let length_before = match parts.json.pointer_mut("/buffers/0/byteLength") {
        Some(known) => std::mem::replace(known, length).as_u64().unwrap_or(0),
        None => {
            push(&mut parts.json, "buffers", json!({ "byteLength": length }));
            0
        }
    };
    Place { buffer: 0, offset, length_before }
}

fn add_buffer(parts: &mut Parts, bytes: Vec<u8>, target: &Target) -> Place {
    let buffer = array(&parts.json, "/buffers").len();
    let byte_length = bytes.len();
    let uri = parts.place_by_content(bytes, target);
    push(&mut parts.json, "buffers", json!({ "byteLength": byte_length, "uri": uri }));
    Place { buffer, offset: 0, length_before: 0 }
}

/// Marks the nodes that bear lights, and the nodes and primitives that are tagged.
fn refer(json: &mut Value, asset: &VlmAsset, triangle_tags: Vec<Value>) {
    let mut nodes: BTreeMap<u32, Map<String, Value>> = BTreeMap::new();
    for vlm in &asset.vlms {
        push_in(nodes.entry(vlm.node).or_default(), "vlms", json!(vlm.id));
    }
    for (node, tag) in &asset.node_tags {
        nodes.entry(*node).or_default().insert(String::from("tag"), json!(tag));
    }
    for (node, extension) in nodes {
        if let Some(node) = json.pointer_mut(&format!("/nodes/{node}")) {
            insert_extension(node, Value::Object(extension));
        }
    }
    let whole =
        asset.primitive_tags.iter().map(|&(mesh, primitive, tag)| (mesh, primitive, json!({ "tag": tag })));
    let places = asset.triangle_tags.iter().map(|entry| (entry.mesh, entry.primitive));
    let parts = places.zip(triangle_tags).map(|((mesh, primitive), tags)| (mesh, primitive, tags));
    for (mesh, primitive, extension) in whole.chain(parts) {
        if let Some(primitive) = json.pointer_mut(&format!("/meshes/{mesh}/primitives/{primitive}")) {
            insert_extension(primitive, extension);
        }
    }
}

fn insert_extension(item: &mut Value, extension: Value) {
    if let Value::Object(item) = item
        && let Value::Object(extensions) = item.entry("extensions").or_insert_with(|| json!({}))
    {
        extensions.insert(EXTENSION.to_owned(), extension);
    }
}

fn push(json: &mut Value, key: &str, item: Value) {
    if let Value::Object(object) = json {
        push_in(object, key, item);
    }
}

fn push_in(object: &mut Map<String, Value>, key: &str, item: Value) {
    if let Value::Array(list) = object.entry(key).or_insert_with(|| json!([])) {
        list.push(item);
    }
}

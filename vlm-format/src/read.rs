//! Reads a [`VlmAsset`] out of a glTF file and says when it no longer fits the file around it.

use glam::Vec3;
use serde_json::Value;

use crate::asset::{Sample, Settings, Vlm, VlmAsset};
use crate::check::{self, array, count, index, layout};
use crate::compress::{self, Codec};
use crate::container::GltfFile;
use crate::digest::{self, Source};
use crate::error::{Error, Issue, Stale};
use crate::grid::Grid;
use crate::nodes;
use crate::place;
use crate::recover::Arrays;
use crate::strip::EXTENSION;
use crate::tags::{TriangleTags, elements};
use crate::validate::validate_in;

/// Reads the Virtual Light Meshes of a file; `None` if it has none.
///
/// # Errors
/// [`Error::Stale`] names every VLM whose source geometry, transform or own data changed since it was written, and why;
/// [`Error::Invalid`] if the data breaks the invariants of [`VlmAsset`].
pub fn read_vlm(file: &GltfFile) -> Result<Option<VlmAsset>, Error> {
    read(file, Trust::Verify)
}

/// Reads as [`read_vlm`] does, without comparing any digest: for tools that show or mend stale files.
///
/// # Errors
/// [`Error::Stale`] if the extension is incomplete; [`Error::Invalid`] as [`read_vlm`].
pub fn read_vlm_unchecked(file: &GltfFile) -> Result<Option<VlmAsset>, Error> {
    read(file, Trust::Blind)
}

/// Reads as [`read_vlm`] does, and finds arrays by their digests wherever they are: for files in which another tool renumbered accessors.
///
/// # Errors
/// As [`read_vlm`].
pub fn read_vlm_recovered(file: &GltfFile) -> Result<Option<VlmAsset>, Error> {
    read(file, Trust::Recover)
}

#[derive(Clone, Copy, PartialEq)]
enum Trust {
    Verify,
    Blind,
    /// As `Verify`, without a look at the accessors' numbers.
    Recover,
}

fn read(file: &GltfFile, trust: Trust) -> Result<Option<VlmAsset>, Error> {
    let Some(extension) = file.json().get("extensions").and_then(|all| all.get(EXTENSION)) else {
        return if_orphaned(file).map_or(Ok(None), |stale| refuse(file, vec![stale]));
    };
    let arrays = if trust == Trust::Recover { Arrays::of(file) } else { Arrays::default() };
    let mut reader =
        Reader { file, extension, trust, arrays, stale: Vec::new(), invalid: Vec::new(), unclaimed: 0 };
    if trust != Trust::Recover {
        reader.check_shape();
        reader.fail_if_stale()?;
    }
    let mut asset = reader.asset();
    reader.fail_if_invalid()?;
    reader.bearers(&mut asset);
    reader.fail_if_stale()?;
    if trust != Trust::Blind {
        reader.compare_sources(&asset)?;
        reader.fail_if_stale()?;
    }
    match validate_in(file, &asset) {
        issues if issues.is_empty() => Ok(Some(asset)),
        issues => {
            let issues = issues.into_iter().map(place::in_file).collect();
            Err(Error::Invalid { file: file.name().to_owned(), issues })
        }
    }
}

fn refuse<T>(file: &GltfFile, stale: Vec<Stale>) -> Result<T, Error> {
    Err(Error::Stale { file: file.name().to_owned(), stale })
}

/// Nodes that refer to VLMs, or have tags, without the root object that would hold them.
fn if_orphaned(file: &GltfFile) -> Option<Stale> {
    let nodes = array(file.json(), "/nodes");
    let node = nodes.iter().position(|node| own(node).is_some())?;
    let pointer = format!("/nodes/{node}/extensions/{EXTENSION}");
    let path = nodes::path(file, &nodes::parents(file), node);
    let what =
        if nodes.get(node).and_then(own)?.get("vlms").is_some() { "refers to" } else { "has a tag of" };
    let reason = format!("`{path}` {what} a VLM, but another tool removed the root object of the extension");
    Some(Stale { vlm: String::from("asset"), pointer, reason })
}

/// The extension's object in a node or primitive.
fn own(item: &Value) -> Option<&Value> {
    item.get("extensions")?.get(EXTENSION)
}

struct Reader<'a> {
    file: &'a GltfFile,
    extension: &'a Value,
    trust: Trust,
    /// Where arrays may be found by digest.
    arrays: Arrays,
    stale: Vec<Stale>,
    /// Compression that no writer makes.
    invalid: Vec<Issue>,
    /// Bytes of the buffer view that no array has claimed yet. No array of ours overlaps another: else a small file could name a large
    /// accessor again and again.
    unclaimed: usize,
}

/// An array of the extension.
struct Place<'a> {
    /// Accessor and digest; `None` where the array is absent.
    json: Option<&'a Value>,
    /// For messages.
    name: String,
    /// JSON pointer of the array.
    pointer: String,
    /// What is stale if the array was altered: `grid` or `asset`.
    vlm: &'static str,
}

/// Why an array cannot be read.
enum Refusal {
    /// Another tool changed what the array refers to.
    Altered(String),
    Invalid(Issue),
}

impl<'a> Reader<'a> {
    fn fail_if_stale(&mut self) -> Result<(), Error> {
        if self.stale.is_empty() { Ok(()) } else { refuse(self.file, std::mem::take(&mut self.stale)) }
    }

    fn fail_if_invalid(&mut self) -> Result<(), Error> {
        match std::mem::take(&mut self.invalid) {
            issues if issues.is_empty() => Ok(()),
            issues => Err(Error::Invalid { file: self.file.name().to_owned(), issues }),
        }
    }

    fn outdated(&mut self, vlm: &str, pointer: impl Into<String>, reason: String) {
        self.stale.push(Stale { vlm: vlm.to_owned(), pointer: pointer.into(), reason });
    }

    /// An extension that lost properties, or accessors that do not exist, were left behind by another tool.
    fn check_shape(&mut self) {
        for Issue { pointer, message, .. } in check::check_extension(self.file.json()).into_issues() {
            let reason = format!("another tool altered the file: {pointer}: {message}");
            self.outdated("asset", pointer, reason);
        }
    }

    fn asset(&mut self) -> VlmAsset {
        self.unclaimed = self.view().and_then(|view| index(view, "byteLength")).unwrap_or(0);
        let text = |key| self.extension.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
        let settings = self.extension.get("settings").cloned().unwrap_or_default();
        let positions = self.vectors("samples", "positions");
        let normals = self.vectors("samples", "normals");
        let reflectance = self.vectors("samples", "reflectance");
        let samples = positions.into_iter().zip(normals).zip(reflectance);
        VlmAsset {
            generator: text("generator"),
            settings: serde_json::from_value::<Settings>(settings).unwrap_or_default(),
            vlms: array(self.extension, "/vlms").iter().map(vlm).collect(),
            positions: self.vectors("lights", "positions"),
            triangles: self.integers("lights", "indices").as_chunks().0.to_vec(),
            albedo: self.vectors("lights", "albedo"),
            emission: self.vectors("lights", "emission"),
            tags: self.integers("lights", "tags"),
            sample_starts: self.integers("samples", "starts"),
            samples: samples
                .map(|((position, normal), reflectance)| Sample { position, normal, reflectance })
                .collect(),
            primitive_tags: primitive_tags(self.file),
            triangle_tags: self.triangle_tags(),
            node_tags: node_tags(self.file),
            grid: self.extension.get("grid").map(|json| self.grid(json)),
        }
    }

    fn grid(&mut self, json: &Value) -> Grid {
        let dimensions =
            array(json, "/dimensions").iter().map(|size| size.as_u64().unwrap_or_default() as u32);
        Grid {
            origin: nodes::numbers(json, "origin")
                .map_or(Vec3::NAN, |origin| glam::DVec3::from(origin).as_vec3()),
            cell_size: json.get("cellSize").and_then(Value::as_f64).unwrap_or(f64::NAN) as f32,
            dimensions: dimensions.collect::<Vec<u32>>().try_into().unwrap_or_default(),
            cells: self.integers("grid", "cells"),
            leaves: self.records("leaves"),
            leaf_probes: self.integers("grid", "leafProbes"),
            near_starts: self.integers("grid", "nearStarts"),
            near: self.integers("grid", "near"),
            near_form_factors: self.scalars("nearFormFactors"),
            probes: self.structs("probes"),
            surface_probes: count(json, "surfaceProbes")
                .and_then(|n| u32::try_from(n).ok())
                .unwrap_or(u32::MAX),
            sample_shares: self.scalars("sampleShares"),
            surface_gains: self.scalars("surfaceGains"),
            uncovered: self.structs("uncovered"),
            row_starts: self.integers("grid", "rowStarts"),
            rows: self.integers("grid", "rows"),
        }
    }

    /// Structs of unsigned integers; a torn one at the end is left out.
    fn records<T: bytemuck::Pod>(&mut self, key: &str) -> Vec<T> {
        from_words(&self.integers("grid", key))
    }

    fn scalars(&mut self, key: &str) -> Vec<f32> {
        let read = |file: &GltfFile, accessor| {
            let values = file.read_floats(accessor)?;
            let bytes = values.iter().copied().flat_map(f32::to_le_bytes).collect();
            Ok((values, bytes))
        };
        self.elements(&self.place("grid", key), "SCALAR", read)
    }

    /// Structs of vectors of four numbers; a torn one at the end is left out.
    fn structs<T: bytemuck::Pod>(&mut self, key: &str) -> Vec<T> {
        let read = |file: &GltfFile, accessor| {
            let values = file.read_vec4(accessor)?;
            let bytes = values.iter().flat_map(|value| value.to_array()).flat_map(f32::to_le_bytes).collect();
            Ok((values, bytes))
        };
        let vectors = self.elements(&self.place("grid", key), "VEC4", read);
        from_words(bytemuck::cast_slice(&vectors))
    }

    /// Tags of the primitives whose triangles differ, in the order of the file.
    fn triangle_tags(&mut self) -> Vec<TriangleTags> {
        let mut all = Vec::new();
        for (mesh, primitive, json) in own_of_primitives(self.file) {
            let Some(json) = json.get("triangleTags") else { continue };
            let name = format!("meshes/{mesh}/primitives/{primitive}/triangleTags");
            let pointer =
                format!("/meshes/{mesh}/primitives/{primitive}/extensions/{EXTENSION}/triangleTags");
            // Those that are compressed claim what they are stored in.
            let claimed = match index(json, "accessor") {
                Some(accessor) if json.get(compress::PROPERTY).is_none() => {
                    elements(self.file.json(), accessor).saturating_mul(size_of::<u32>())
                }
                _ => 0,
            };
            if !self.claim(claimed) {
                let reason = format!("another tool altered the file: `{name}` claims more than there is");
                self.outdated("asset", pointer, reason);
                break;
            }
            let tags = self.integers_at(&Place { json: Some(json), name, pointer, vlm: "asset" });
            all.push(TriangleTags { mesh, primitive, tags });
        }
        all
    }

    /// The accessor of an array: the one that it names, or, when recovering, any that holds it.
    fn accessor(&self, json: &Value, kind: &str) -> usize {
        let named = index(json, "accessor").unwrap_or(usize::MAX);
        if self.trust != Trust::Recover {
            return named;
        }
        let digest = digest::text(json, "digest");
        self.arrays.find(self.file, json.get(compress::PROPERTY), kind, digest).unwrap_or(named)
    }

    /// Takes bytes of the buffer view for one array; false if so many are not left.
    fn claim(&mut self, bytes: usize) -> bool {
        if self.trust == Trust::Recover {
            // The view is where another tool put it, or gone. A user asks for this, of a file of his own.
            return true;
        }
        let rest = self.unclaimed.checked_sub(bytes);
        self.unclaimed = rest.unwrap_or(self.unclaimed);
        rest.is_some()
    }

    /// The buffer view that holds all arrays.
    fn view(&self) -> Option<&'a Value> {
        let view = index(self.extension.get("data")?, "bufferView")?;
        array(self.file.json(), "/bufferViews").get(view)
    }

    fn place(&self, group: &str, key: &str) -> Place<'a> {
        Place {
            json: self.extension.get(group).and_then(|group| group.get(key)),
            name: format!("{group}/{key}"),
            pointer: format!("/extensions/{EXTENSION}/{group}/{key}"),
            vlm: if group == "grid" { "grid" } else { "asset" },
        }
    }

    fn vectors(&mut self, group: &str, key: &str) -> Vec<Vec3> {
        let read = |file: &GltfFile, accessor| {
            let values = file.read_vec3(accessor)?;
            let bytes = values.iter().flat_map(|value| value.to_array()).flat_map(f32::to_le_bytes).collect();
            Ok((values, bytes))
        };
        self.elements(&self.place(group, key), "VEC3", read)
    }

    fn integers(&mut self, group: &str, key: &str) -> Vec<u32> {
        self.integers_at(&self.place(group, key))
    }

    fn integers_at(&mut self, place: &Place<'_>) -> Vec<u32> {
        let read = |file: &GltfFile, accessor| {
            let values = file.read_u32(accessor)?;
            let bytes = values.iter().copied().flat_map(u32::to_le_bytes).collect();
            Ok((values, bytes))
        };
        self.elements(place, "SCALAR", read)
    }

    /// Reads an array; absent ones are empty. One that cannot be read, or has another digest, is stale.
    fn elements<T: bytemuck::Pod>(
        &mut self,
        place: &Place<'_>,
        kind: &str,
        read: impl Fn(&GltfFile, usize) -> Result<(Vec<T>, Vec<u8>), Error>,
    ) -> Vec<T> {
        let Place { json: Some(json), name, vlm, pointer } = place else { return Vec::new() };
        let accessor = self.accessor(json, kind);
        let altered = format!("accessor {accessor} `{name}` was renumbered or altered by another tool");
        let found = match json.get(compress::PROPERTY) {
            None => read(self.file, accessor).map_err(|error| Refusal::Altered(why(error))),
            Some(codec) => self.decompress(place, codec, kind, accessor),
        };
        match found {
            Ok((_, bytes))
                if self.trust != Trust::Blind
                    && digest::of_array(kind, &bytes) != digest::text(json, "digest") =>
            {
                self.outdated(vlm, pointer, altered);
            }
            Ok((values, _)) => return values,
            Err(Refusal::Altered(why)) => self.outdated(vlm, pointer, format!("{altered} ({why})")),
            Err(Refusal::Invalid(issue)) => self.invalid.push(issue),
        }
        Vec::new()
    }

    /// The values and decoded bytes of a compressed array.
    fn decompress<T: bytemuck::Pod>(
        &mut self,
        place: &Place<'_>,
        codec: &Value,
        kind: &str,
        accessor: usize,
    ) -> Result<(Vec<T>, Vec<u8>), Refusal> {
        let pointer = format!("{}/{}", place.pointer, compress::PROPERTY);
        let (_, components) = layout::columns_and_rows(kind);
        let element = components * size_of::<u32>() as u64;
        let codec = Codec::read(codec, element, &pointer).map_err(Refusal::Invalid)?;
        let stored = self.stored(accessor, codec.byte_length)?;
        let bytes = codec.decode(&stored, &pointer).map_err(Refusal::Invalid)?;
        let words: Vec<u32> = bytes.as_chunks().0.iter().map(|&word| u32::from_le_bytes(word)).collect();
        Ok((from_words(&words), bytes))
    }

    /// The bytes that a compressed array is stored in. Only bytes that are really in the file justify what they decode to, so the
    /// accessor has to lie in our own buffer view, which nothing else has compressed.
    fn stored(&mut self, accessor: usize, length: u64) -> Result<Vec<u8>, Refusal> {
        let refuse = |message: &str| Err(Refusal::Altered(message.to_owned()));
        let json = array(self.file.json(), "/accessors").get(accessor).unwrap_or(&Value::Null);
        let view = self.extension.get("data").and_then(|data| index(data, "bufferView"));
        let plain = self.view().is_some_and(|view| layout::meshopt(view).is_none());
        let ours = plain && index(json, "bufferView") == view && json.get("sparse").is_none();
        if !ours && self.trust != Trust::Recover {
            return refuse("it does not lie in the buffer view of the extension");
        }
        if count(json, "count") != Some(length) {
            return refuse("it has another length");
        }
        if !usize::try_from(length).is_ok_and(|length| self.claim(length)) {
            return refuse("the arrays claim more than there is");
        }
        self.file.read_bytes(accessor).map_err(|error| Refusal::Altered(why(error)))
    }

    /// Finds the node that bears each VLM.
    fn bearers(&mut self, asset: &mut VlmAsset) {
        let parents = nodes::parents(self.file);
        let mut bearers: Vec<Option<usize>> = vec![None; asset.vlms.len()];
        for (node, json) in array(self.file.json(), "/nodes").iter().enumerate() {
            let ids = own(json).map_or(&[][..], |own| array(own, "/vlms")).iter().filter_map(Value::as_str);
            let path = || nodes::path(self.file, &parents, node);
            let pointer = || format!("/nodes/{node}/extensions/{EXTENSION}/vlms");
            for id in ids {
                match asset.vlms.iter().position(|vlm| vlm.id == id) {
                    None => {
                        self.outdated(
                            id,
                            pointer(),
                            format!("`{}` refers to it, but it does not exist", path()),
                        );
                    }
                    Some(vlm) => match bearers[vlm] {
                        None => bearers[vlm] = Some(node),
                        Some(first) => {
                            let first = nodes::path(self.file, &parents, first);
                            let reason = format!("both `{first}` and `{}` refer to it", path());
                            self.outdated(id, pointer(), reason);
                        }
                    },
                }
            }
        }
        for (i, (vlm, bearer)) in asset.vlms.iter_mut().zip(bearers).enumerate() {
            match bearer {
                Some(node) => vlm.node = node as u32,
                None => {
                    self.outdated(&vlm.id, vlm_pointer(i), String::from("no node refers to it any more"));
                }
            }
        }
    }

    /// Compares the digests of the sources with what the file now holds.
    fn compare_sources(&mut self, asset: &VlmAsset) -> Result<(), Error> {
        let parents = nodes::parents(self.file);
        let mut source = Source::new(self.file);

        for (i, (vlm, json)) in asset.vlms.iter().zip(array(self.extension, "/vlms")).enumerate() {
            let node = vlm.node as usize;
            let digests = json.get("digests").unwrap_or(&Value::Null);
            let path = nodes::path(self.file, &parents, node);
            if source.geometry(node)? != digest::text(digests, "geometry") {
                let reason = format!("geometry or colours of `{path}` changed");
                self.outdated(&vlm.id, format!("{}/digests/geometry", vlm_pointer(i)), reason);
            }
            if asset.grid.is_some() && source.transform(node)? != digest::text(digests, "transform") {
                let pointer = format!("{}/digests/transform", vlm_pointer(i));
                self.outdated("grid", pointer, format!("`{path}` was moved"));
            }
        }
        let Some(grid) = self.extension.get("grid") else { return Ok(()) };
        if self.stale.is_empty() && source.scene()? != digest::text(grid, "sceneDigest") {
            let reason = String::from("a visible object was added, removed, moved or changed");
            self.outdated("grid", format!("/extensions/{EXTENSION}/grid/sceneDigest"), reason);
        }
        Ok(())
    }
}

/// JSON pointer of a VLM in the extension.
fn vlm_pointer(vlm: usize) -> String {
    format!("/extensions/{EXTENSION}/vlms/{vlm}")
}

fn vlm(json: &Value) -> Vlm {
    let range = |key| {
        let mut numbers = array(json, key).iter().map(|number| number.as_u64().unwrap_or_default() as u32);
        [numbers.next().unwrap_or_default(), numbers.next().unwrap_or_default()]
    };
    Vlm {
        id: json.get("id").and_then(Value::as_str).unwrap_or_default().to_owned(),
        node: 0,
        lights: range("/lights"),
        vertices: range("/vertices"),
        authored: json.get("authored").and_then(Value::as_bool).unwrap_or(false),
    }
}

/// Tags of visible primitives as wholes, in the order of the file.
fn primitive_tags(file: &GltfFile) -> Vec<(u32, u32, u32)> {
    own_of_primitives(file).filter_map(|(mesh, primitive, own)| Some((mesh, primitive, tag(own)?))).collect()
}

/// Tags of nodes, in the order of the file.
fn node_tags(file: &GltfFile) -> Vec<(u32, u32)> {
    let nodes = array(file.json(), "/nodes").iter().enumerate();
    nodes.filter_map(|(node, json)| Some((node as u32, tag(own(json)?)?))).collect()
}

/// The tag of a node or primitive as a whole.
fn tag(own: &Value) -> Option<u32> {
    own.get("tag")?.as_u64().and_then(|tag| u32::try_from(tag).ok())
}

/// The extension's objects in primitives, with mesh and primitive.
fn own_of_primitives(file: &GltfFile) -> impl Iterator<Item = (u32, u32, &Value)> {
    array(file.json(), "/meshes").iter().enumerate().flat_map(|(m, mesh)| {
        let primitives = array(mesh, "/primitives").iter().enumerate();
        primitives.filter_map(move |(p, primitive)| Some((m as u32, p as u32, own(primitive)?)))
    })
}

/// The reason of an error, without the file's name where it is about one place.
fn why(error: Error) -> String {
    match error {
        Error::Invalid { issues, .. } => {
            issues.into_iter().next().map(|issue| issue.message).unwrap_or_default()
        }
        other => other.to_string(),
    }
}

/// Structs of whole words, one after the other; a torn one at the end is left out.
fn from_words<T: bytemuck::Pod>(words: &[u32]) -> Vec<T> {
    let structs = words.chunks_exact(size_of::<T>() / size_of::<u32>());
    structs.map(|words| bytemuck::pod_read_unaligned(bytemuck::cast_slice(words))).collect()
}

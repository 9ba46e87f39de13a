//! Attaches Virtual Light Meshes again that another tool dropped, to the nodes for which they were baked.
//!
//! Nodes are found by the digests of their geometry and transform, then by their path, so that a tool may rename and renumber. What changed
//! is refused: its lights stand for another surface.

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};

use serde::{Deserialize, Serialize};

use crate::asset::VlmAsset;
use crate::check::{array, index};
use crate::code::Code;
use crate::container::GltfFile;
use crate::digest::Source;
use crate::error::{Error, Issue, Stale};
use crate::nodes;
use crate::read::read_vlm;
use crate::sidecar;
use crate::tags::TriangleTags;

/// Virtual Light Meshes with what they were baked for.
#[derive(Clone, Debug)]
pub struct Donor {
    /// Without the tags of primitives, which are below.
    pub(crate) asset: VlmAsset,
    /// Every node that shows a mesh or has a tag.
    pub(crate) nodes: Vec<Origin>,
    pub(crate) meshes: Vec<MeshTags>,
}

/// A node by what it shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Origin {
    pub node: u32,
    pub path: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<u32>,
    pub geometry: String,
    pub transform: String,
}

/// Tags of a mesh's primitives.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct MeshTags {
    pub mesh: u32,
    /// Primitive and tag.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub whole: Vec<(u32, u32)>,
    /// Primitive, and how many triangles have which tag, one run after the other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub by_triangle: Vec<(u32, Vec<(u32, u32)>)>,
}

/// What [`relink`] accepts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RelinkOptions {
    /// Attaches lights to nodes of the same path whose geometry or colours changed, too. The caller has to prove that the lights still lie
    /// behind the surface.
    pub changed: bool,
}

/// The result of [`relink`].
#[derive(Clone, Debug)]
pub struct Relinked {
    /// Fits the file; to be written with [`crate::write_vlm`].
    pub asset: VlmAsset,
    /// Former and new path of nodes that were found under another one.
    pub renamed: Vec<(String, String)>,
    /// Paths of nodes whose geometry or colours changed. Empty unless [`RelinkOptions::changed`] allows them.
    pub changed: Vec<String>,
}

impl Donor {
    /// Of a baked file, or a sidecar that [`crate::write_sidecar`] wrote.
    ///
    /// # Errors
    /// [`Code::NoVlm`] if the file has no Virtual Light Mesh; [`Error::Stale`] and [`Error::Invalid`] as [`read_vlm`].
    pub fn of(file: &GltfFile) -> Result<Self, Error> {
        let Some(asset) = read_vlm(file)? else {
            let issue = Issue::error(Code::NoVlm, "/extensions", Code::NoVlm.meaning());
            return Err(issue.in_file(file.name()));
        };
        match sidecar::read(file, &asset)? {
            Some(donor) => Ok(donor),
            None => Self::new(file, asset),
        }
    }

    /// Of an asset in the file that it was baked from.
    pub(crate) fn new(file: &GltfFile, mut asset: VlmAsset) -> Result<Self, Error> {
        let mut meshes: BTreeMap<u32, MeshTags> = BTreeMap::new();
        for (mesh, primitive, tag) in std::mem::take(&mut asset.primitive_tags) {
            meshes.entry(mesh).or_default().whole.push((primitive, tag));
        }
        for TriangleTags { mesh, primitive, tags } in std::mem::take(&mut asset.triangle_tags) {
            let runs = tags.chunk_by(|a, b| a == b).map(|run| (run.len() as u32, run[0])).collect();
            meshes.entry(mesh).or_default().by_triangle.push((primitive, runs));
        }
        let meshes = meshes.into_iter().map(|(mesh, tags)| MeshTags { mesh, ..tags }).collect();
        let tagged: BTreeSet<u32> = asset.node_tags.iter().map(|&(node, _)| node).collect();
        let nodes = origins(file, &tagged)?;
        Ok(Self { asset, nodes, meshes })
    }
}

/// The nodes of a file that show a mesh, and some others.
fn origins(file: &GltfFile, others: &BTreeSet<u32>) -> Result<Vec<Origin>, Error> {
    let (parents, mut source) = (nodes::parents(file), Source::new(file));
    let mut origins = Vec::new();
    for (node, json) in array(file.json(), "/nodes").iter().enumerate() {
        let mesh = index(json, "mesh").map(|mesh| mesh as u32);
        if mesh.is_some() || others.contains(&(node as u32)) {
            origins.push(Origin {
                node: node as u32,
                path: nodes::path(file, &parents, node),
                mesh,
                geometry: source.geometry(node)?,
                transform: source.transform(node)?,
            });
        }
    }
    Ok(origins)
}

/// Fits Virtual Light Meshes to a file in which another tool may have renamed, renumbered and repacked everything.
///
/// # Errors
/// [`Error::Stale`] names every object that is gone, changed, moved or new, where lights or grid depend on it; [`Error::Invalid`] if
/// geometry cannot be read.
pub fn relink(file: &GltfFile, donor: &Donor, options: &RelinkOptions) -> Result<Relinked, Error> {
    let all: BTreeSet<u32> = (0..array(file.json(), "/nodes").len() as u32).collect();
    let has_tags = donor.nodes.iter().any(|origin| origin.mesh.is_none());
    let found = origins(file, if has_tags { &all } else { const { &BTreeSet::new() } })?;
    let matches = match_nodes(&donor.nodes, &found, options);
    let mut relinker = Relinker { file, donor, found: &found, matches: &matches, stale: Vec::new() };
    let asset = relinker.asset();
    relinker.check_grid(options);
    if !relinker.stale.is_empty() {
        return Err(Error::Stale { file: file.name().to_owned(), stale: relinker.stale });
    }
    let pairs = || donor.nodes.iter().zip(&matches).filter_map(|(old, new)| Some((old, &found[(*new)?])));
    let renamed = pairs().filter(|(old, new)| old.path != new.path);
    let changed = pairs().filter(|(old, new)| old.geometry != new.geometry);
    Ok(Relinked {
        asset,
        renamed: renamed.map(|(old, new)| (old.path.clone(), new.path.clone())).collect(),
        changed: changed.map(|(_, new)| new.path.clone()).collect(),
    })
}

/// For each node its place among the found ones: by geometry, transform and path, then with one of these given up, the least telling
/// first. Geometry alone has to be unique.
fn match_nodes(nodes: &[Origin], found: &[Origin], options: &RelinkOptions) -> Vec<Option<usize>> {
    let mut matcher =
        Matcher { nodes, found, matches: vec![None; nodes.len()], free: vec![true; found.len()] };
    matcher.pair(false, |o| Some([&o.geometry, &o.transform, &o.path]));
    matcher.pair(false, |o| o.mesh.map(|_| [&*o.geometry, &*o.transform, ""]));
    matcher.pair(false, |o| Some([&*o.geometry, "", &*o.path]));
    matcher.pair(true, |o| o.mesh.map(|_| [&*o.geometry, "", ""]));
    if options.changed {
        matcher.pair(true, |o| o.mesh.map(|_| ["", "", &*o.path]));
    }
    matcher.matches
}

struct Matcher<'a> {
    nodes: &'a [Origin],
    found: &'a [Origin],
    matches: Vec<Option<usize>>,
    free: Vec<bool>,
}

impl<'a> Matcher<'a> {
    /// Pairs what has no partner yet and the same key, in the order of the nodes; `unique` leaves out keys that several have.
    fn pair<S: AsRef<str> + ?Sized + 'a>(
        &mut self,
        unique: bool,
        key: impl Fn(&'a Origin) -> Option<[&'a S; 3]>,
    ) {
        let text = |origin| key(origin).map(|parts: [&S; 3]| parts.map(AsRef::as_ref));
        let mut free: HashMap<[&str; 3], VecDeque<usize>> = HashMap::new();
        for (at, origin) in self.found.iter().enumerate().filter(|(at, _)| self.free[*at]) {
            if let Some(key) = text(origin) {
                free.entry(key).or_default().push_back(at);
            }
        }
        let mut asking: HashMap<[&str; 3], usize> = HashMap::new();
        let alone = |at: usize| self.matches[at].is_none();
        let keys: Vec<_> =
            (0..self.nodes.len()).filter(|&at| alone(at)).map(|at| (at, text(&self.nodes[at]))).collect();
        keys.iter().filter_map(|(_, key)| *key).for_each(|key| *asking.entry(key).or_default() += 1);
        for (at, key) in keys {
            let Some(places) = key.and_then(|key| free.get_mut(&key)) else { continue };
            let one = places.len() == 1 && key.is_some_and(|key| asking.get(&key) == Some(&1));
            if let Some(place) = places.front().copied().filter(|_| one || !unique) {
                places.pop_front();
                self.matches[at] = Some(place);
                self.free[place] = false;
            }
        }
    }
}

struct Relinker<'a> {
    file: &'a GltfFile,
    donor: &'a Donor,
    found: &'a [Origin],
    matches: &'a [Option<usize>],
    stale: Vec<Stale>,
}

impl Relinker<'_> {
    fn outdated(&mut self, vlm: &str, pointer: impl Into<String>, reason: String) {
        self.stale.push(Stale { vlm: vlm.to_owned(), pointer: pointer.into(), reason });
    }

    fn asset(&mut self) -> VlmAsset {
        let mut asset = self.donor.asset.clone();
        for vlm in &mut asset.vlms {
            vlm.node = self.node(vlm.node, &vlm.id);
        }
        for (node, tag) in &mut asset.node_tags {
            *node = self.node(*node, &format!("tag {tag}"));
        }
        asset.node_tags.sort_unstable();
        self.mesh_tags(&mut asset);
        asset
    }

    /// The new number of a node.
    fn node(&mut self, node: u32, vlm: &str) -> u32 {
        let old = self.donor.nodes.iter().position(|origin| origin.node == node);
        if let Some(new) = old.and_then(|old| self.matches[old]) {
            return self.found[new].node;
        }
        let path = old.map_or_else(|| format!("node {node}"), |old| self.donor.nodes[old].path.clone());
        match self.found.iter().find(|origin| origin.path == path) {
            Some(new) => {
                let pointer = format!("/nodes/{}", new.node);
                self.outdated(vlm, pointer, format!("geometry or colours of `{path}` changed"));
            }
            None => {
                let reason = format!("no object has the geometry of `{path}`, nor its path");
                self.outdated(vlm, "/nodes", reason);
            }
        }
        node
    }

    /// A grid knows the whole scene in world space.
    fn check_grid(&mut self, options: &RelinkOptions) {
        if self.donor.asset.grid.is_none() {
            return;
        }
        let bears = |node: u32| self.donor.asset.vlms.iter().any(|vlm| vlm.node == node);
        let mut reasons = Vec::new();
        for (old, new) in self.donor.nodes.iter().zip(self.matches).filter(|(old, _)| old.mesh.is_some()) {
            match new.map(|new| &self.found[new]) {
                Some(new) if new.transform != old.transform => {
                    reasons.push((format!("/nodes/{}", new.node), format!("`{}` was moved", new.path)));
                }
                Some(_) => {}
                // Those that bear lights have been named.
                None if bears(old.node) => {}
                None => {
                    let reason = format!("`{}` was removed or changed", old.path);
                    reasons.push((String::from("/nodes"), reason));
                }
            }
        }
        let taken: BTreeSet<usize> = self.matches.iter().flatten().copied().collect();
        let changed = self.matches.iter().any(Option::is_none) && !options.changed;
        let added =
            self.found.iter().enumerate().filter(|(at, new)| new.mesh.is_some() && !taken.contains(at));
        // What changed is new as well.
        reasons.extend(
            added
                .filter(|_| !changed)
                .map(|(_, new)| (format!("/nodes/{}", new.node), format!("`{}` was added", new.path))),
        );
        reasons.into_iter().for_each(|(pointer, reason)| self.outdated("grid", pointer, reason));
    }

    /// Tags of primitives go to every mesh that the mesh's nodes now show.
    fn mesh_tags(&mut self, asset: &mut VlmAsset) {
        let mut tags_of: BTreeMap<u32, Option<&MeshTags>> = BTreeMap::new();
        let mut conflicts: BTreeSet<u32> = BTreeSet::new();
        let donor = self.donor;
        for (old, new) in donor.nodes.iter().zip(self.matches) {
            let Some((new, mesh)) = new.and_then(|new| Some((self.found[new].mesh?, old.mesh?))) else {
                continue;
            };
            let tags = donor.meshes.iter().find(|tags| tags.mesh == mesh);
            let content = |tags: Option<&MeshTags>| tags.map(|t| (t.whole.clone(), t.by_triangle.clone()));
            let known = *tags_of.entry(new).or_insert(tags);
            if content(known) != content(tags) {
                conflicts.insert(new);
            }
        }
        for mesh in conflicts {
            let reason = String::from("another tool made one mesh of several that have different tags");
            self.outdated("asset", format!("/meshes/{mesh}"), reason);
        }
        for (mesh, tags) in tags_of {
            let Some(tags) = tags else { continue };
            asset.primitive_tags.extend(tags.whole.iter().map(|&(primitive, tag)| (mesh, primitive, tag)));
            for (primitive, runs) in &tags.by_triangle {
                self.triangle_tags(mesh, *primitive, runs, asset);
            }
        }
    }

    fn triangle_tags(&mut self, mesh: u32, primitive: u32, runs: &[(u32, u32)], asset: &mut VlmAsset) {
        let triangles: u64 = runs.iter().map(|&(count, _)| u64::from(count)).sum();
        if self.file.triangle_count(mesh, primitive).map(|count| count as u64) != Some(triangles) {
            let reason =
                format!("the primitive does not have the {triangles} triangles of the bake, which have tags");
            return self.outdated("asset", format!("/meshes/{mesh}/primitives/{primitive}"), reason);
        }
        let tags = runs.iter().flat_map(|&(count, tag)| std::iter::repeat_n(tag, count as usize)).collect();
        asset.triangle_tags.push(TriangleTags { mesh, primitive, tags });
    }
}

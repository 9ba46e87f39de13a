//! What differs between two bakes: lights by object, tags, grid, settings.
//!
//! Objects pair up by id, then by the path of their node. The lights of a pair match where their corners are the same, then each with the
//! nearest that has no partner, by centroid and by the side from which it shines.

use std::collections::{BTreeSet, HashMap};
use std::fmt;

use glam::{DMat4, DVec3, Vec3};
use rstar::RTree;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use vlm_format::{GltfFile, Grid, Sample, Vlm, VlmAsset};

use crate::grid_content::GridContent;

/// Lights whose centroids lie farther apart than this times the root of an average light's area are not the same. Higher values call more
/// lights moved that are new; lower ones call those new that moved.
const SAME_LIGHT: f64 = 0.5;

/// Reflectance and albedo of a light that differ by less are the same: sums over samples and points round.
const SAME_REFLECTANCE: f64 = 1e-5;

/// Virtual Light Meshes with what the diff needs of their file.
#[derive(Clone, Debug)]
pub struct Side {
    asset: VlmAsset,
    /// Node path of each VLM.
    paths: Vec<String>,
    world_from_nodes: Vec<DMat4>,
}

/// What differs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Diff {
    /// True if nothing does.
    pub same: bool,
    /// Generator and settings that differ.
    pub settings: Vec<Change<Setting>>,
    /// Objects whose lights differ.
    pub objects: Vec<ObjectDiff>,
    /// Tags of nodes, primitives and triangles of the visible surface that differ.
    pub tags: TagsDiff,
    /// `None` if the grids are the same.
    pub grid: Option<GridDiff>,
    /// Sum of the lights' areas times their reflectance, square metres, R, G, B: the light that they reflect per irradiance.
    pub reflected_m2: Change<[f64; 3]>,
}

/// A value before and after.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Change<T> {
    /// Its name.
    pub name: String,
    /// In the first file.
    pub from: T,
    /// In the second.
    pub to: T,
}

/// A setting's value.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Setting {
    /// A number.
    Number(f64),
    /// A name.
    Text(String),
}

impl Setting {
    fn of(value: &Value) -> Self {
        match value {
            Value::String(text) => Self::Text(text.clone()),
            other => other.as_f64().map_or_else(|| Self::Text(other.to_string()), Self::Number),
        }
    }
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Text(text) => text.fmt(f),
        }
    }
}

/// The lights of one object.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct ObjectDiff {
    /// Node path, in the second file where it is there.
    pub object: String,
    /// Id of the VLM.
    pub id: String,
    /// Number of lights before and after.
    pub lights: [u32; 2],
    /// Lights that only the second file has.
    pub added: u32,
    /// Lights that only the first file has.
    pub removed: u32,
    /// Lights whose centroid moved, metres in world space.
    pub moved: Amount,
    /// Lights of other corners around the same centroid.
    pub reshaped: u32,
    /// Lights whose albedo or reflectance changed, by the largest channel of either.
    pub recoloured: Amount,
    /// Lights whose own emission changed, by the largest channel, lx.
    pub emission: Amount,
    /// Lights of another tag.
    pub retagged: u32,
    /// Lights whose samples lie elsewhere, or share the light's reflectance otherwise.
    pub resampled: u32,
    /// True if it became authored, or is no longer.
    pub authored: bool,
    /// True if the same lights stand in another order, so that their numbers differ.
    pub reordered: bool,
}

/// How many, and by how much.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Amount {
    /// How many changed.
    pub count: u32,
    /// Mean over those.
    pub mean: f64,
    /// The most.
    pub max: f64,
}

/// How many have another tag than before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct TagsDiff {
    /// Nodes.
    pub nodes: usize,
    /// Primitives as wholes.
    pub primitives: usize,
    /// Primitives whose triangles have tags of their own.
    pub primitives_by_triangle: usize,
}

/// The static grid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct GridDiff {
    /// Numbers that differ; empty if only the content does.
    pub numbers: Vec<Change<f64>>,
}

impl Side {
    /// Of an asset and the file that it was read from.
    #[must_use]
    pub fn new(file: &GltfFile, asset: VlmAsset) -> Self {
        let paths = asset.vlms.iter().map(|vlm| file.node_path(vlm.node)).collect();
        Self { asset, paths, world_from_nodes: file.world_from_nodes() }
    }

    fn lights(&self, vlm: &Vlm) -> Vec<Light<'_>> {
        let world = self.world_from_nodes.get(vlm.node as usize).copied().unwrap_or_default();
        let range = vlm.lights[0] as usize..(vlm.lights[0] + vlm.lights[1]) as usize;
        range.map(|light| Light::of(&self.asset, light, &world)).collect()
    }
}

/// A light with all that belongs to it.
struct Light<'a> {
    /// Node space.
    corners: [Vec3; 3],
    centroid: DVec3,
    /// As long as twice the area in world space.
    normal: DVec3,
    albedo: Vec3,
    emission: Vec3,
    tag: u32,
    samples: &'a [Sample],
    /// Metres in world space per unit of node space.
    scale: f64,
}

impl<'a> Light<'a> {
    fn of(asset: &'a VlmAsset, light: usize, world: &DMat4) -> Self {
        let corners = asset.triangles[light].map(|vertex| asset.positions[vertex as usize]);
        let [a, b, c] = corners.map(|corner| world.transform_point3(corner.as_dvec3()));
        let samples = asset.sample_starts[light] as usize..asset.sample_starts[light + 1] as usize;
        Self {
            corners,
            centroid: corners.iter().map(|corner| corner.as_dvec3()).sum::<DVec3>() / 3.0,
            normal: (b - a).cross(c - a),
            albedo: asset.albedo[light],
            emission: asset.emission.get(light).copied().unwrap_or_default(),
            tag: asset.tags.get(light).copied().unwrap_or(0),
            samples: &asset.samples[samples],
            scale: world.determinant().abs().cbrt(),
        }
    }

    fn area(&self) -> f64 {
        self.normal.length() / 2.0
    }

    fn reflectance(&self) -> Vec3 {
        self.samples.iter().map(|sample| sample.reflectance).sum()
    }

    fn places(&self) -> Vec<(Vec3, Vec3)> {
        self.samples.iter().map(|sample| (sample.position, sample.normal)).collect()
    }

    fn key(&self) -> [u32; 9] {
        let numbers = self.corners.map(|corner| corner.to_array().map(f32::to_bits));
        std::array::from_fn(|i| numbers[i / 3][i % 3])
    }
}

/// Compares two bakes. Both assets are valid, as they are when [`vlm_format::read_vlm_unchecked`] read them.
#[must_use]
pub fn diff(a: &Side, b: &Side) -> Diff {
    let mut diff = Diff {
        settings: settings(&a.asset, &b.asset),
        objects: objects(a, b),
        tags: tags(&a.asset, &b.asset),
        grid: grid(a.asset.grid.as_ref(), b.asset.grid.as_ref()),
        reflected_m2: change("reflected_m2", reflected(a), reflected(b)),
        ..Diff::default()
    };
    let tags_same = diff.tags == TagsDiff::default();
    diff.same = diff.settings.is_empty() && diff.objects.is_empty() && tags_same && diff.grid.is_none();
    diff
}

fn change<T>(name: &str, from: T, to: T) -> Change<T> {
    Change { name: name.to_owned(), from, to }
}

fn settings(a: &VlmAsset, b: &VlmAsset) -> Vec<Change<Setting>> {
    let all = |asset: &VlmAsset| {
        let mut json = serde_json::to_value(&asset.settings).unwrap_or_default();
        json["generator"] = Value::from(asset.generator.as_str());
        json
    };
    let (a, b) = (all(a), all(b));
    let keys = a.as_object().into_iter().flat_map(|map| map.keys());
    let differing = keys.filter(|key| a[*key] != b[*key]);
    differing.map(|key| change(key, Setting::of(&a[key]), Setting::of(&b[key]))).collect()
}

fn reflected(side: &Side) -> [f64; 3] {
    let lights = side.asset.vlms.iter().flat_map(|vlm| side.lights(vlm));
    lights.map(|light| light.area() * light.reflectance().as_dvec3()).sum::<DVec3>().to_array()
}

fn objects(a: &Side, b: &Side) -> Vec<ObjectDiff> {
    let mut partner: Vec<Option<usize>> =
        a.asset.vlms.iter().map(|vlm| b.asset.vlms.iter().position(|other| other.id == vlm.id)).collect();
    for (at, path) in a.paths.iter().enumerate() {
        let taken = |other: usize| partner.contains(&Some(other));
        if partner[at].is_none() {
            partner[at] = (0..b.paths.len()).find(|&other| b.paths[other] == *path && !taken(other));
        }
    }
    let before = a.asset.vlms.iter().zip(&partner).enumerate().map(|(at, (vlm, partner))| match partner {
        Some(other) => {
            let new = &b.asset.vlms[*other];
            let authored = vlm.authored != new.authored;
            ObjectDiff { authored, ..object(&b.paths[*other], &new.id, &a.lights(vlm), &b.lights(new)) }
        }
        None => object(&a.paths[at], &vlm.id, &a.lights(vlm), &[]),
    });
    let added = (0..b.paths.len()).filter(|other| !partner.contains(&Some(*other)));
    let after = added.map(|other| {
        let vlm = &b.asset.vlms[other];
        object(&b.paths[other], &vlm.id, &[], &b.lights(vlm))
    });
    let unchanged = |object: &ObjectDiff| {
        let ObjectDiff { object: path, id, lights, .. } = object;
        *object
            == ObjectDiff { object: path.clone(), id: id.clone(), lights: *lights, ..ObjectDiff::default() }
    };
    before.chain(after).filter(|object| !unchanged(object)).collect()
}

fn object(path: &str, id: &str, a: &[Light<'_>], b: &[Light<'_>]) -> ObjectDiff {
    let pairs = match_lights(a, b);
    let amount =
        |of: fn(&Light<'_>, &Light<'_>) -> f64| Amount::of(pairs.iter().map(|&(i, j)| of(&a[i], &b[j])));
    let count = |of: fn(&Light<'_>, &Light<'_>) -> bool| {
        pairs.iter().filter(|&&(i, j)| of(&a[i], &b[j])).count() as u32
    };
    let matched = pairs.len() as u32;
    ObjectDiff {
        object: path.to_owned(),
        id: id.to_owned(),
        lights: [a.len() as u32, b.len() as u32],
        added: b.len() as u32 - matched,
        removed: a.len() as u32 - matched,
        moved: amount(|a, b| a.centroid.distance(b.centroid) * b.scale),
        reshaped: count(|a, b| a.corners != b.corners && a.centroid == b.centroid),
        recoloured: amount(recoloured),
        emission: amount(|a, b| largest(a.emission - b.emission)),
        retagged: count(|a, b| a.tag != b.tag),
        resampled: count(|a, b| {
            a.samples != b.samples && (a.places() != b.places() || recoloured(a, b) == 0.0)
        }),
        reordered: pairs.len() == a.len() && pairs.iter().any(|(i, j)| i != j),
        ..ObjectDiff::default()
    }
}

fn recoloured(a: &Light<'_>, b: &Light<'_>) -> f64 {
    let difference = largest(a.reflectance() - b.reflectance()).max(largest(a.albedo - b.albedo));
    if difference < SAME_REFLECTANCE { 0.0 } else { difference }
}

fn largest(difference: Vec3) -> f64 {
    f64::from(difference.abs().max_element())
}

impl Amount {
    fn of(differences: impl Iterator<Item = f64>) -> Self {
        let changed: Vec<f64> = differences.filter(|&difference| difference > 0.0).collect();
        if changed.is_empty() {
            return Self::default();
        }
        Self {
            count: changed.len() as u32,
            mean: changed.iter().sum::<f64>() / changed.len() as f64,
            max: changed.iter().copied().fold(0.0, f64::max),
        }
    }
}

/// Pairs of lights, in the order of the first.
fn match_lights(a: &[Light<'_>], b: &[Light<'_>]) -> Vec<(usize, usize)> {
    let mut same: HashMap<[u32; 9], Vec<usize>> = HashMap::new();
    b.iter().enumerate().rev().for_each(|(j, light)| same.entry(light.key()).or_default().push(j));
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    let mut rest = Vec::new();
    for (i, light) in a.iter().enumerate() {
        match same.get_mut(&light.key()).and_then(Vec::pop) {
            Some(j) => pairs.push((i, j)),
            None => rest.push(i),
        }
    }
    let taken: BTreeSet<usize> = pairs.iter().map(|&(_, j)| j).collect();
    let size = (b.iter().map(Light::area).sum::<f64>() / b.len().max(1) as f64).sqrt();
    // Both sides of a thin wall have lights in about the same place: the normal tells them apart.
    let point = |light: &Light<'_>| {
        let (at, side) = (light.centroid * light.scale, light.normal.normalize_or_zero() * size);
        [at.x, at.y, at.z, side.x, side.y, side.z]
    };
    let free = (0..b.len()).filter(|j| !taken.contains(j));
    let mut tree =
        RTree::bulk_load(free.map(|j| rstar::primitives::GeomWithData::new(point(&b[j]), j)).collect());
    for i in rest {
        let nearest = tree.nearest_neighbor(point(&a[i])).map(|found| found.data);
        let near = |j: &usize| a[i].centroid.distance(b[*j].centroid) * b[*j].scale <= SAME_LIGHT * size;
        if let Some(j) = nearest.filter(near) {
            tree.pop_nearest_neighbor(point(&a[i]));
            pairs.push((i, j));
        }
    }
    pairs.sort_unstable();
    pairs
}

fn tags(a: &VlmAsset, b: &VlmAsset) -> TagsDiff {
    TagsDiff {
        nodes: places_that_differ(&a.node_tags, &b.node_tags, |entry| entry.0),
        primitives: places_that_differ(&a.primitive_tags, &b.primitive_tags, |entry| (entry.0, entry.1)),
        primitives_by_triangle: places_that_differ(&a.triangle_tags, &b.triangle_tags, |entry| {
            (entry.mesh, entry.primitive)
        }),
    }
}

/// How many places have another entry, or one in one of the lists only.
fn places_that_differ<T: PartialEq, K: Ord>(a: &[T], b: &[T], place: impl Fn(&T) -> K) -> usize {
    let lone = |from: &[T], other: &[T]| -> Vec<K> {
        from.iter().filter(|entry| !other.contains(entry)).map(&place).collect()
    };
    lone(a, b).into_iter().chain(lone(b, a)).collect::<BTreeSet<K>>().len()
}

fn grid(a: Option<&Grid>, b: Option<&Grid>) -> Option<GridDiff> {
    if a == b {
        return None;
    }
    let numbers = |grid: Option<&Grid>| -> Vec<(&str, f64)> {
        let content = grid.map(GridContent::of);
        let number = |of: fn(&GridContent) -> f64| content.as_ref().map_or(0.0, of);
        vec![
            ("cell_size_m", number(|c| f64::from(c.cell_size_m))),
            ("leaves", number(|c| c.leaves as f64)),
            ("probes", number(|c| c.probes as f64)),
            ("surface_probes", number(|c| f64::from(c.surface_probes))),
            ("near_entries", number(|c| c.near_entries as f64)),
            ("far_entries", number(|c| f64::from(c.far_entries))),
            ("bytes", number(|c| c.bytes as f64)),
        ]
    };
    let pairs = numbers(a).into_iter().zip(numbers(b)).filter(|(a, b)| a.1 != b.1);
    Some(GridDiff { numbers: pairs.map(|((name, from), (_, to))| change(name, from, to)).collect() })
}

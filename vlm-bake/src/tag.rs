//! Stage 10: ids for the lights that cannot hide. A receiver is never lit by a light of its own tag.
//!
//! A tag covers as little as it can: the triangles that a light would light wrongly, and no others, so that a two-sided banner
//! still lights the wall beside it though both are one primitive. Lights and such triangles form a graph, and each of its connected
//! parts gets an id. Instances of a mesh share its triangles, and so their tags. An artist's tag (`extras.vlm.tag`) holds for all
//! lights and triangles of its object, and wins.

use std::collections::BTreeMap;

use petgraph::unionfind::UnionFind;
use rustc_hash::FxHashMap;
use schemars::JsonSchema;
use serde::Serialize;
use vlm_format::TriangleTags;

use crate::patches::Patches;
use crate::samples::BakedLight;
use crate::scene::Scene;
use crate::topology::area;

/// Why a tag was given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TagReason {
    /// The artist asked for it.
    Authored,
    /// Both sides of the surface reflect, so nothing lies behind it.
    TwoSided,
    /// The object is too thin for a light behind its surface.
    Thin,
    /// The surface bends more than its lights can follow.
    Uncleared,
}

/// What a light would light wrongly.
#[derive(Clone, Debug, PartialEq)]
pub struct Accusation {
    /// The scene's triangles that it must not light, ascending.
    pub triangles: Vec<u32>,
    /// Why it would.
    pub reason: TagReason,
}

/// One tag, as the report shows it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct TagReport {
    /// The id.
    pub tag: u32,
    /// Node path of the object of its first light.
    pub object: String,
    /// glTF mesh of its first triangle.
    pub mesh: u32,
    /// Index within the mesh of that triangle's primitive.
    pub primitive: u32,
    /// Why.
    pub reason: TagReason,
    /// Lights that carry it.
    pub lights: usize,
    /// Their area in square metres.
    pub area_m2: f64,
    /// Area of the surface that it keeps dark from them, square metres; both sides of two-sided surface.
    pub covers_m2: f64,
    /// Share (0 to 1) of the light of these lights that they would rightly have sent to other parts of that surface, were nothing
    /// between.
    pub light_lost: f64,
}

/// The tags of a scene.
#[derive(Clone, Debug, Default)]
pub struct Tags {
    /// Per triangle of the scene, 0 for none; artists' tags are not in it.
    pub triangles: Vec<u32>,
    /// Artists' tags: glTF node and tag, ascending.
    pub nodes: Vec<(u32, u32)>,
    /// One entry per tag, ascending.
    pub reports: Vec<TagReport>,
}

/// A triangle of a glTF primitive, whichever node draws it: mesh, primitive, index as drawn.
type Drawn = (u32, u32, u32);

fn drawn(scene: &Scene, triangle: u32) -> Drawn {
    let primitive = &scene.primitives[scene.triangle_primitive[triangle as usize] as usize];
    (primitive.mesh, primitive.primitive, scene.triangle_in_primitive[triangle as usize])
}

/// Gives tags to the lights that are accused, or whose artist asked for it.
#[must_use]
pub fn tag(scene: &Scene, patches: &Patches, lights: &mut [BakedLight]) -> Tags {
    let authored = |light: &BakedLight| scene.objects[light.object as usize].steering.tag;
    let parts = Parts::new(scene, lights, |light| authored(light).is_none());
    // Automatic ids follow the authored ones, so that the two never meet.
    let mut last = scene.objects.iter().filter_map(|o| o.steering.tag).max().unwrap_or(0);
    let mut id_of_part: FxHashMap<u32, u32> = FxHashMap::default();
    for (l, light) in lights.iter_mut().enumerate() {
        let automatic = parts.of_light(l).map(|part| {
            *id_of_part.entry(part).or_insert_with(|| {
                last += 1;
                last
            })
        });
        light.tag = authored(light).or(automatic).unwrap_or(0);
    }
    let triangle =
        |t: u32| parts.of_triangle(drawn(scene, t)).and_then(|part| id_of_part.get(&part).copied());
    let triangles = (0..scene.triangles.len() as u32).map(|t| triangle(t).unwrap_or(0)).collect();
    let nodes: BTreeMap<u32, u32> =
        scene.objects.iter().filter_map(|o| Some((o.node, o.steering.tag.filter(|&t| t != 0)?))).collect();
    let mut tags = Tags { triangles, nodes: nodes.into_iter().collect(), reports: Vec::new() };
    tags.reports = reports(scene, patches, lights, &tags);
    tags
}

/// The connected parts of the graph of lights and triangles.
struct Parts {
    light: Vec<Option<u32>>,
    node_of_triangle: FxHashMap<Drawn, u32>,
    part_of_node: Vec<u32>,
}

impl Parts {
    fn new(scene: &Scene, lights: &[BakedLight], counts: impl Fn(&BakedLight) -> bool) -> Self {
        let mut node_of_triangle: FxHashMap<Drawn, u32> = FxHashMap::default();
        let mut joints = Vec::new();
        let mut nodes = lights.len() as u32;
        for (l, light) in lights.iter().enumerate().filter(|(_, light)| counts(light)) {
            for &triangle in light.accused.iter().flat_map(|accused| &accused.triangles) {
                let node = *node_of_triangle.entry(drawn(scene, triangle)).or_insert_with(|| {
                    nodes += 1;
                    nodes - 1
                });
                joints.push((l as u32, node));
            }
        }
        let mut joined = UnionFind::<u32>::new(nodes as usize);
        for &(light, triangle) in &joints {
            joined.union(light, triangle);
        }
        let mut light = vec![None; lights.len()];
        for (l, _) in joints {
            light[l as usize] = Some(joined.find_mut(l));
        }
        Self { light, node_of_triangle, part_of_node: joined.into_labeling() }
    }

    fn of_light(&self, light: usize) -> Option<u32> {
        self.light[light]
    }

    fn of_triangle(&self, triangle: Drawn) -> Option<u32> {
        self.node_of_triangle.get(&triangle).map(|&node| self.part_of_node[node as usize])
    }
}

fn reports(scene: &Scene, patches: &Patches, lights: &[BakedLight], tags: &Tags) -> Vec<TagReport> {
    let mut reports: BTreeMap<u32, TagReport> = BTreeMap::new();
    for light in lights.iter().filter(|light| light.tag != 0) {
        let object = &scene.objects[light.object as usize];
        let reason = match &light.accused {
            Some(accused) if object.steering.tag.is_none() => accused.reason,
            _ => TagReason::Authored,
        };
        let first = light.accused.as_ref().and_then(|accused| accused.triangles.first());
        let entry = reports.entry(light.tag).or_insert_with(|| {
            let (mesh, primitive, _) = first.map_or((0, 0, 0), |&t| drawn(scene, t));
            TagReport {
                tag: light.tag,
                object: object.path.clone(),
                mesh,
                primitive,
                reason,
                ..TagReport::default()
            }
        });
        entry.reason = entry.reason.min(reason);
        entry.lights += 1;
        entry.area_m2 += area(light.corners);
    }
    for (t, &source) in patches.triangle_source.iter().enumerate() {
        if let Some(report) = reports.get_mut(&tags.triangles[source as usize]) {
            let sides = if patches.triangle_two_sided[t] { 2.0 } else { 1.0 };
            report.covers_m2 += sides * patches.area(t);
        }
    }
    reports.into_values().collect()
}

impl Default for TagReport {
    fn default() -> Self {
        Self {
            tag: 0,
            object: String::new(),
            mesh: 0,
            primitive: 0,
            reason: TagReason::Uncleared,
            lights: 0,
            area_m2: 0.0,
            covers_m2: 0.0,
            light_lost: 0.0,
        }
    }
}

impl Tags {
    /// The tags of primitives of one tag throughout, `(mesh, primitive, tag)`, and those of primitives whose triangles differ; both
    /// ascending.
    #[must_use]
    pub fn of_primitives(&self, scene: &Scene) -> (Vec<(u32, u32, u32)>, Vec<TriangleTags>) {
        let mut by_primitive: BTreeMap<(u32, u32), Vec<u32>> = BTreeMap::new();
        for (t, &tag) in self.triangles.iter().enumerate().filter(|(_, tag)| **tag != 0) {
            let of = &scene.primitives[scene.triangle_primitive[t] as usize];
            let tags = by_primitive
                .entry((of.mesh, of.primitive))
                .or_insert_with(|| vec![0; of.drawn_triangles as usize]);
            tags[scene.triangle_in_primitive[t] as usize] = tag;
        }
        let (mut whole, mut parts) = (Vec::new(), Vec::new());
        for ((mesh, primitive), tags) in by_primitive {
            match tags.first() {
                Some(&tag) if tags.iter().all(|&t| t == tag) => whole.push((mesh, primitive, tag)),
                _ => parts.push(TriangleTags { mesh, primitive, tags }),
            }
        }
        (whole, parts)
    }
}

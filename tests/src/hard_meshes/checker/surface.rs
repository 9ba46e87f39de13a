//! The visible triangles as the checker sees them.

use std::collections::BTreeMap;

use glam::DVec3;
use vlm_bake::scene::{Scene, ScenePrimitive};
use vlm_format::VlmAsset;

use super::Triangle;
use super::geometry::{closest_on, cross, unit_normal, winding};

/// The visible triangles. Arrays without a word about their length are as long as `triangles`.
pub struct Surface {
    /// World space, metres.
    pub triangles: Vec<Triangle>,
    /// Unit normals.
    pub normals: Vec<DVec3>,
    /// Square metres.
    pub areas: Vec<f64>,
    /// Both sides reflect: by the material, or because the triangle is there twice.
    pub two_sided: Vec<bool>,
    /// The receiver's tag, 0 for none.
    pub tags: Vec<u32>,
    /// Number of the part: connected, of one primitive.
    pub part: Vec<u32>,
    /// Index into the scene's objects.
    pub object: Vec<u32>,
    /// Largest extent along an axis, metres.
    pub extent: f64,
    /// Heights below this are rounding of single precision, metres.
    pub rounding: f64,
    /// How far a light must lie behind what it stands for, metres: half a step of 14-bit quantisation for it and for the surface, and the
    /// rounding of a few operations. It is half of what the baker asks for, whose other half is a margin.
    pub clearance: f64,
    /// How far behind the surface walks begin, metres.
    pub step: f64,
    /// Every edge has its opposite: the surface bounds a volume.
    pub closed: bool,
    /// Area times albedo, mean over the channels, of both sides where both reflect; square metres.
    pub flux: f64,
    /// The winding number of free space, if closed.
    free: f64,
}

type Bits = [u32; 3];

/// The receiver's tag of a scene triangle, as a renderer finds it: its node's, else its primitive's, else its own.
#[must_use]
pub fn tag_of_triangle(scene: &Scene, asset: &VlmAsset, triangle: usize) -> u32 {
    let ScenePrimitive { object, mesh, primitive, .. } =
        scene.primitives[scene.triangle_primitive[triangle] as usize];
    let node = scene.objects[object as usize].node;
    let of_node = asset.node_tags.iter().filter(|t| t.0 == node).map(|t| t.1);
    let of_primitive = asset.primitive_tags.iter().filter(|t| (t.0, t.1) == (mesh, primitive)).map(|t| t.2);
    let of_triangle = asset.triangle_tags.iter().filter(|t| (t.mesh, t.primitive) == (mesh, primitive));
    let number = scene.triangle_in_primitive[triangle] as usize;
    of_node.chain(of_primitive).chain(of_triangle.map(|t| t.tags[number])).next().unwrap_or(0)
}

impl Surface {
    /// Reads the scene and, for the tags, the asset.
    #[must_use]
    pub fn new(scene: &Scene, asset: &VlmAsset) -> Self {
        let triangles: Vec<Triangle> =
            scene.triangles.iter().map(|t| t.map(|v| scene.positions[v as usize].as_dvec3())).collect();
        let keys: Vec<[Bits; 3]> = triangles.iter().map(|t| t.map(key)).collect();
        let primitive_of = |t: usize| &scene.primitives[scene.triangle_primitive[t] as usize];
        let material_of = |t: usize| &scene.materials[primitive_of(t).material as usize];
        let doubled = doubled(&keys, &scene.triangle_primitive);
        let all = 0..triangles.len();
        let two_sided: Vec<bool> = all.clone().map(|t| doubled[t] || material_of(t).two_sided).collect();
        let areas: Vec<f64> = triangles.iter().map(|&t| 0.5 * cross(t).length()).collect();
        // A doubled triangle is in the list twice already.
        let sides = |t: usize| if material_of(t).two_sided && !doubled[t] { 2.0 } else { 1.0 };
        let albedo = |t: usize| f64::from(material_of(t).base_color.element_sum()) / 3.0;
        let corners = || triangles.iter().flatten();
        let low = corners().fold(DVec3::INFINITY, |low, p| low.min(*p));
        let high = corners().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
        let extent = (high - low).max_element();
        let farthest = low.abs().max(high.abs()).max_element();
        let rounding = 4.0 * farthest * 2f64.powi(-24);
        let mut surface = Self {
            normals: triangles.iter().map(|&t| unit_normal(t)).collect(),
            tags: all.clone().map(|t| tag_of_triangle(scene, asset, t)).collect(),
            part: parts(&keys, &scene.triangle_primitive),
            object: all.clone().map(|t| primitive_of(t).object).collect(),
            flux: all.map(|t| areas[t] * albedo(t) * sides(t)).sum(),
            closed: is_closed(&keys),
            clearance: extent * 2f64.powi(-14) + 8.0 * farthest * 2f64.powi(-24),
            step: 1e-6 * extent + rounding,
            two_sided,
            areas,
            triangles,
            extent,
            rounding,
            free: 0.0,
        };
        surface.free = surface.least_winding_in_front();
        surface
    }

    /// In front of some visible surface there is free space: the least winding number there is that of free space.
    fn least_winding_in_front(&self) -> f64 {
        if !self.closed {
            return 0.0;
        }
        let stride = (self.triangles.len() / 64).max(1);
        let fronts = (0..self.triangles.len()).step_by(stride).map(|t| {
            let [a, b, c] = self.triangles[t];
            winding(&self.triangles, (a + b + c) / 3.0 + 4.0 * self.step * self.normals[t])
        });
        fronts.fold(0.0, f64::min).round()
    }

    /// True if no body holds the place; for closed surfaces only.
    #[must_use]
    pub fn is_free(&self, place: DVec3) -> bool {
        winding(&self.triangles, place) < self.free + 0.5
    }

    /// The signs of a triangle's normal towards the sides that reflect.
    #[must_use]
    pub fn sides(&self, triangle: usize) -> &'static [f64] {
        if self.two_sided[triangle] { &[1.0, -1.0] } else { &[1.0] }
    }

    /// The triangles of an object on which a sample lies.
    #[must_use]
    pub fn triangles_at(&self, x: DVec3, n: DVec3, object: u32) -> Vec<u32> {
        let slack = 2.0 * self.rounding + 1e-6 * self.extent;
        let holds = |&t: &usize| {
            let cosine = self.normals[t].dot(n);
            let faces = if self.two_sided[t] { cosine.abs() } else { cosine };
            self.object[t] == object
                && faces > 0.999
                && (x - self.triangles[t][0]).dot(self.normals[t]).abs() < slack
                && closest_on(self.triangles[t], x).distance(x) < slack
        };
        (0..self.triangles.len()).filter(holds).map(|t| t as u32).collect()
    }

    /// The place of a triangle nearest to `x`, moved off its border.
    #[must_use]
    pub fn inner_place(&self, triangle: usize, x: DVec3) -> DVec3 {
        let corners = self.triangles[triangle];
        let centre = corners.iter().sum::<DVec3>() / 3.0;
        let nearest = closest_on(corners, x);
        nearest + (centre - nearest) * 1e-4
    }

    /// The lights by the triangles and by the parts on which their samples lie.
    #[must_use]
    pub fn candidates(&self, owned: &[Vec<u32>]) -> Candidates {
        let mut of_triangle = vec![Vec::new(); self.triangles.len()];
        let mut of_part = vec![Vec::new(); self.triangles.len()];
        for (l, own) in owned.iter().enumerate() {
            own.iter().for_each(|&t| of_triangle[t as usize].push(l as u32));
            let mut parts: Vec<u32> = own.iter().map(|&t| self.part[t as usize]).collect();
            parts.sort_unstable();
            parts.dedup();
            parts.iter().for_each(|&p| of_part[p as usize].push(l as u32));
        }
        Candidates { of_triangle, of_part }
    }
}

/// Lights that may stand for the points of a triangle.
pub struct Candidates {
    of_triangle: Vec<Vec<u32>>,
    of_part: Vec<Vec<u32>>,
}

impl Candidates {
    /// Those with a sample on it.
    #[must_use]
    pub fn of_triangle(&self, triangle: usize) -> &[u32] {
        &self.of_triangle[triangle]
    }

    /// Those with a sample on a connected part.
    #[must_use]
    pub fn of_part(&self, part: u32) -> &[u32] {
        &self.of_part[part as usize]
    }
}

/// A place by its bits; both zeros are one place.
fn key(p: DVec3) -> Bits {
    (p.as_vec3() + glam::Vec3::ZERO).to_array().map(f32::to_bits)
}

/// Triangles of one primitive that are there more than once.
fn doubled(keys: &[[Bits; 3]], primitive: &[u32]) -> Vec<bool> {
    let sorted = |t: usize| {
        let mut corners = keys[t];
        corners.sort_unstable();
        (primitive[t], corners)
    };
    let mut count: BTreeMap<_, u32> = BTreeMap::new();
    (0..keys.len()).for_each(|t| *count.entry(sorted(t)).or_default() += 1);
    (0..keys.len()).map(|t| count[&sorted(t)] > 1).collect()
}

/// Connected parts of one primitive: the least triangle that edges lead to, found by passing it on until nothing changes.
fn parts(keys: &[[Bits; 3]], primitive: &[u32]) -> Vec<u32> {
    let mut part: Vec<u32> = (0..keys.len() as u32).collect();
    let edge = |t: usize, i: usize| {
        let (a, b) = (keys[t][i], keys[t][(i + 1) % 3]);
        (primitive[t], a.min(b), a.max(b))
    };
    loop {
        let mut least: BTreeMap<_, u32> = BTreeMap::new();
        for (t, &own) in part.iter().enumerate() {
            for i in 0..3 {
                let entry = least.entry(edge(t, i)).or_insert(own);
                *entry = own.min(*entry);
            }
        }
        let next = (0..keys.len()).map(|t| (0..3).map(|i| least[&edge(t, i)]).fold(part[t], u32::min));
        let next: Vec<u32> = next.collect();
        if next == part {
            return part;
        }
        part = next;
    }
}

/// Every directed edge is there as often as its opposite.
fn is_closed(keys: &[[Bits; 3]]) -> bool {
    let mut balance: BTreeMap<(Bits, Bits), i32> = BTreeMap::new();
    for t in keys {
        for i in 0..3 {
            let (a, b) = (t[i], t[(i + 1) % 3]);
            *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    balance.values().all(|&b| b == 0)
}

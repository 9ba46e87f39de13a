//! Stage 2: the visible triangles that reflect or emit, welded by position and grouped into regions of one albedo.
//!
//! Decimation must see one connected surface (welded first, budgets are met; per primitive they are missed), yet
//! must not smear a red wall over its white neighbour. So vertices are welded within an object, and triangles form
//! *regions*: connected, of one primitive, without a hard step of albedo inside. Borders between regions survive
//! decimation as seams.

use std::collections::hash_map::Entry;

use glam::{DVec3, Vec3};
use petgraph::unionfind::UnionFind;
use rustc_hash::FxHashMap;

use crate::scene::{Scene, Surface};
use crate::topology::{area, edge_uses, edges};

/// Two neighbours whose albedos differ by more than this, in the square root of linear albedo (about evenly spaced to
/// the eye), lie on different sides of a border. Lower values keep more borders, and more lights are spent on them;
/// higher values let strong textures average out. The material's factor counts as the nearest power of two, so that a small change of it
/// moves no border.
const HARD_STEP: f32 = 0.12;

/// Surfaces darker than this (largest channel) that emit nothing make no lights: they return less than a thousandth of
/// the light that falls on them.
const BLACK: f32 = 1e-3;

/// The surface that the lights will stand for. Arrays called `triangle_*` are as long as `triangles`.
#[derive(Clone, Debug, Default)]
pub struct Patches {
    /// World-space vertices, each once per object.
    pub positions: Vec<DVec3>,
    /// Index into [`Scene::objects`] for each vertex.
    pub vertex_object: Vec<u32>,
    /// Counter-clockwise seen from the front. A two-sided surface is here once.
    pub triangles: Vec<[u32; 3]>,
    /// The scene's triangle.
    pub triangle_source: Vec<u32>,
    /// Triangles that the scene holds again, with the scene's number of the second; ascending.
    pub twins: Vec<(u32, u32)>,
    /// Both sides reflect: the material says so, or the file holds the triangle a second time, turned round.
    pub triangle_two_sided: Vec<bool>,
    /// Index into `regions`.
    pub triangle_region: Vec<u32>,
    /// Connected runs of one albedo.
    pub regions: Vec<Region>,
    /// Number of islands (connected parts of an object).
    pub islands: u32,
}

/// A connected part of one primitive without a hard step of albedo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Index into [`Scene::primitives`].
    pub primitive: u32,
    /// Connected part of the object; regions that touch share it.
    pub island: u32,
    /// Both sides of the surface reflect, so its lights cannot hide behind it.
    pub two_sided: bool,
}

impl Patches {
    /// The corners of a triangle.
    #[must_use]
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }

    /// The scene's triangles that lie there: one, or more where it is modelled several times.
    pub fn scene_triangles(&self, triangle: u32) -> impl Iterator<Item = u32> {
        let first = self.twins.partition_point(|&(of, _)| of < triangle);
        let twins = self.twins[first..].iter().take_while(move |&&(of, _)| of == triangle);
        std::iter::once(self.triangle_source[triangle as usize]).chain(twins.map(|&(_, twin)| twin))
    }

    /// Area of a triangle's front in square metres.
    #[must_use]
    pub fn area(&self, triangle: usize) -> f64 {
        area(self.corners(triangle))
    }

    /// The region of a triangle.
    #[must_use]
    pub fn region(&self, triangle: usize) -> &Region {
        &self.regions[self.triangle_region[triangle] as usize]
    }
}

/// Finds the surface that makes lights. `surfaces` holds the mean surface of each scene triangle; `lights` is the
/// budget: a region smaller than a quarter of a light's share of the area joins the neighbour most like it.
#[must_use]
pub fn patches(scene: &Scene, surfaces: &[Surface], lights: u32) -> Patches {
    let mut patches = weld(scene, surfaces);
    let area: f64 = (0..patches.triangles.len()).map(|t| patches.area(t)).sum();
    let least_area = 0.25 * area / f64::from(lights.max(1));
    group(&mut patches, scene, surfaces, least_area);
    patches
}

/// True if a triangle of this material and mean surface makes lights.
fn makes_lights(scene: &Scene, triangle: usize, surface: &Surface) -> bool {
    let primitive = &scene.primitives[scene.triangle_primitive[triangle] as usize];
    let material = &scene.materials[primitive.material as usize];
    let steering = &scene.objects[primitive.object as usize].steering;
    let bright = surface.reflectance().max_element() > BLACK && material.reflects;
    !steering.exclude && (bright || surface.emission.max_element() > 0.0)
}

/// Collects the triangles that make lights, vertices welded by exact position within each object.
fn weld(scene: &Scene, surfaces: &[Surface]) -> Patches {
    let mut patches = Patches::default();
    let mut vertex_of: FxHashMap<(u32, [u32; 3]), u32> = FxHashMap::default();
    let mut triangle_at: FxHashMap<[u32; 3], (u32, bool)> = FxHashMap::default();
    for (t, corners) in scene.triangles.iter().enumerate() {
        if !makes_lights(scene, t, &surfaces[t]) {
            continue;
        }
        let primitive = &scene.primitives[scene.triangle_primitive[t] as usize];
        let welded = corners.map(|v| {
            let p = scene.positions[v as usize] + Vec3::ZERO; // -0 + 0 = 0: both zeros are one place
            *vertex_of.entry((primitive.object, p.to_array().map(f32::to_bits))).or_insert_with(|| {
                patches.positions.push(p.as_dvec3());
                patches.vertex_object.push(primitive.object);
                patches.positions.len() as u32 - 1
            })
        });
        if welded[0] == welded[1] || welded[1] == welded[2] || welded[2] == welded[0] {
            continue;
        }
        let (place, turned) = oriented(welded);
        match triangle_at.entry(place) {
            // Modelled a second time: facing the same way it adds nothing, turned round it makes the surface two-sided.
            Entry::Occupied(first) => {
                let (first, first_turned) = *first.get();
                patches.triangle_two_sided[first as usize] |= turned != first_turned;
                patches.twins.push((first, t as u32));
            }
            Entry::Vacant(free) => {
                free.insert((patches.triangles.len() as u32, turned));
                patches.triangles.push(welded);
                patches.triangle_source.push(t as u32);
                patches.triangle_two_sided.push(scene.materials[primitive.material as usize].two_sided);
            }
        }
    }
    patches.twins.sort_unstable();
    patches
}

/// The vertices in ascending order, and whether that turned the triangle round.
fn oriented(mut v: [u32; 3]) -> ([u32; 3], bool) {
    let turned = (v[0] > v[1]) ^ (v[1] > v[2]) ^ (v[0] > v[2]);
    v.sort_unstable();
    (v, turned)
}

/// Joins triangles into islands (across every shared edge) and regions (likest neighbours first; across shared edges
/// within a primitive, where the albedo has no hard step or one of the two is too small to be a light of its own).
fn group(patches: &mut Patches, scene: &Scene, surfaces: &[Surface], least_area: f64) {
    let count = patches.triangles.len();
    let mut islands = UnionFind::<u32>::new(count);
    let mut regions = UnionFind::<u32>::new(count);
    let mut area: Vec<f64> = (0..count).map(|t| patches.area(t)).collect();
    let uses = edge_uses(&patches.triangles);
    let mut joints: Vec<(f32, u32, u32)> = Vec::with_capacity(count * 3 / 2);
    for edge in edges(&uses) {
        for pair in edge.windows(2) {
            let (a, b) = (pair[0].triangle, pair[1].triangle);
            islands.union(a, b);
            let source = [a, b].map(|t| patches.triangle_source[t as usize] as usize);
            let two_sided = [a, b].map(|t| patches.triangle_two_sided[t as usize]);
            let one_primitive = scene.triangle_primitive[source[0]] == scene.triangle_primitive[source[1]];
            if one_primitive && two_sided[0] == two_sided[1] {
                let brightness = brightness(scene, source[0]);
                joints.push((step(&surfaces[source[0]], &surfaces[source[1]], brightness), a, b));
            }
        }
    }
    joints.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    for (step, a, b) in joints {
        let (a, b) = (regions.find_mut(a), regions.find_mut(b));
        let small = area[a as usize].min(area[b as usize]) < least_area;
        if a != b && (step < HARD_STEP || (small && step.is_finite())) {
            let joined = area[a as usize] + area[b as usize];
            regions.union(a, b);
            area[regions.find_mut(a) as usize] = joined;
        }
    }
    number(patches, scene, &mut islands, &mut regions);
}

/// The power of two nearest to the factor of a triangle's material.
fn brightness(scene: &Scene, triangle: usize) -> f32 {
    let factor = scene.material_of(triangle).map_or(0.0, |material| material.base_color.max_element());
    factor.log2().round().exp2()
}

/// How far apart two mean surfaces of one material look; infinite between an emitter and anything unlike it.
fn step(a: &Surface, b: &Surface, brightness: f32) -> f32 {
    let reflectance = |s: &Surface| s.painted * s.coverage * brightness;
    let root = |s: &Surface| Vec3::from_array(reflectance(s).max(Vec3::ZERO).to_array().map(f32::sqrt));
    let emission = (a.emission - b.emission).abs().max_element();
    if emission > 0.1 * a.emission.max(b.emission).max_element() {
        return f32::INFINITY;
    }
    (root(a) - root(b)).abs().max_element()
}

/// Numbers islands and regions in the order in which their first triangles come.
fn number(patches: &mut Patches, scene: &Scene, islands: &mut UnionFind<u32>, regions: &mut UnionFind<u32>) {
    let mut island_of: FxHashMap<u32, u32> = FxHashMap::default();
    let mut region_of: FxHashMap<u32, u32> = FxHashMap::default();
    for t in 0..patches.triangles.len() as u32 {
        let next_island = island_of.len() as u32;
        let island = *island_of.entry(islands.find_mut(t)).or_insert(next_island);
        let next_region = region_of.len() as u32;
        let region = *region_of.entry(regions.find_mut(t)).or_insert(next_region);
        if region == next_region {
            let primitive = scene.triangle_primitive[patches.triangle_source[t as usize] as usize];
            let two_sided = patches.triangle_two_sided[t as usize];
            patches.regions.push(Region { primitive, island, two_sided });
        }
        patches.triangle_region.push(region);
    }
    patches.islands = island_of.len() as u32;
}

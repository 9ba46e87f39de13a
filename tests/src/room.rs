//! A room with as many triangles as are asked for, to measure how cost grows with them.
//!
//! Rough walls, two rough columns, three bumpy balls and two smooth blocks, of eight colours. The shape is the same for any
//! number of triangles: smooth bumps down to some 20 cm. So what is more finely divided holds more that decimation can take
//! away, as scanned and sculpted meshes do, and flat blocks hold coplanar triangles. Every body is closed: sides share
//! the positions on their common edges bit by bit.

use glam::{UVec3, Vec3, Vec3Swizzles};
use serde_json::json;

use crate::glb::Glb;

/// Half the room's size, metres: 10 x 4 x 8 m.
const ROOM: Vec3 = Vec3::new(5.0, 2.0, 4.0);

/// Depth of the roughness of walls and columns, metres.
const ROUGH: f32 = 0.02;

/// Bumps of the balls over their radius.
const BUMPY: f32 = 0.08;

/// Albedo of each material, linear.
const COLOURS: [[f32; 3]; 8] = [
    [0.63, 0.06, 0.05],
    [0.15, 0.48, 0.09],
    [0.45, 0.30, 0.18],
    [0.75, 0.75, 0.72],
    [0.60, 0.60, 0.62],
    [0.30, 0.40, 0.60],
    [0.70, 0.55, 0.20],
    [0.55, 0.50, 0.50],
];

/// Materials of the room's sides: x, y, z, low and high of each.
const WALLS: [usize; 6] = [0, 1, 2, 3, 4, 4];

/// Triangles of one material of one body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Part {
    /// Number of the body.
    pub body: usize,
    /// Number of the material.
    pub material: usize,
    /// Metres.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals.
    pub normals: Vec<[f32; 3]>,
    /// Three per triangle, counter-clockwise seen from the front.
    pub indices: Vec<u32>,
}

#[derive(Clone, Copy)]
enum Shape {
    /// Seen from inside.
    Room,
    Column,
    Block,
    Ball,
}

#[derive(Clone, Copy)]
struct Body {
    shape: Shape,
    centre: Vec3,
    half: Vec3,
    material: usize,
}

const fn body(shape: Shape, centre: [f32; 3], half: [f32; 3], material: usize) -> Body {
    Body { shape, centre: Vec3::from_array(centre), half: Vec3::from_array(half), material }
}

const BODIES: [Body; 8] = [
    body(Shape::Room, [0.0, 2.0, 0.0], ROOM.to_array(), 0),
    body(Shape::Column, [-2.5, 1.9, -1.0], [0.3, 1.8, 0.3], 7),
    body(Shape::Column, [2.5, 1.9, -1.0], [0.3, 1.8, 0.3], 7),
    body(Shape::Ball, [0.0, 1.2, 0.5], [1.0; 3], 5),
    body(Shape::Ball, [-3.4, 0.8, 2.2], [0.6; 3], 6),
    body(Shape::Ball, [3.3, 0.9, 2.0], [0.7; 3], 3),
    body(Shape::Block, [-0.9, 0.6, -2.6], [0.7, 0.5, 0.5], 6),
    body(Shape::Block, [1.2, 0.9, -2.4], [0.4, 0.8, 0.6], 0),
];

/// The triangles of a room of about `triangles` triangles: within 10 % from a thousand on, 3 % from ten thousand on.
#[must_use]
pub fn parts(triangles: u64) -> Vec<Part> {
    let density = density_for(triangles);
    BODIES.iter().enumerate().flat_map(|(number, body)| body.parts(number, body.cells(density))).collect()
}

/// The corners of the triangles of some parts.
pub fn corners(parts: &[Part]) -> impl Iterator<Item = [Vec3; 3]> + '_ {
    let corner = |part: &Part, i: u32| Vec3::from_array(part.positions[i as usize]);
    parts
        .iter()
        .flat_map(move |part| part.indices.as_chunks::<3>().0.iter().map(move |t| t.map(|i| corner(part, i))))
}

/// The room as a glTF file, a node for each body.
#[must_use]
pub fn glb(triangles: u64) -> Vec<u8> {
    let material = |colour: &[f32; 3]| {
        let [r, g, b] = *colour;
        json!({ "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0 } })
    };
    let mut glb = Glb::new(json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": (0..BODIES.len()).collect::<Vec<_>>() }],
        "nodes": (0..BODIES.len()).map(|mesh| json!({ "mesh": mesh })).collect::<Vec<_>>(),
        "materials": COLOURS.iter().map(material).collect::<Vec<_>>(),
    }));
    let mut primitives = vec![Vec::new(); BODIES.len()];
    for part in parts(triangles) {
        let stored = glb.large_primitive(&part.positions, &part.normals, &part.indices, part.material);
        primitives[part.body].push(stored);
    }
    let meshes = primitives.into_iter().map(|primitives| json!({ "primitives": primitives }));
    glb.json["meshes"] = meshes.collect();
    glb.finish()
}

/// Cells per metre with which the room comes nearest to that many triangles.
fn density_for(triangles: u64) -> f32 {
    let total = |density: f32| BODIES.iter().map(|b| triangles_of(b.cells(density))).sum::<u64>();
    let (mut low, mut high) = (1e-2f32, 1e4f32);
    for _ in 0..64 {
        let middle = (low * high).sqrt();
        *(if total(middle) < triangles { &mut low } else { &mut high }) = middle;
    }
    if triangles.abs_diff(total(low)) < triangles.abs_diff(total(high)) { low } else { high }
}

/// Two for each quad of the six sides.
fn triangles_of(cells: UVec3) -> u64 {
    let [x, y, z] = cells.to_array().map(u64::from);
    4 * (x * y + y * z + z * x)
}

impl Body {
    /// Quads along each axis.
    fn cells(&self, density: f32) -> UVec3 {
        let size = match self.shape {
            // A quarter of a great circle.
            Shape::Ball => self.half * std::f32::consts::FRAC_PI_2,
            _ => 2.0 * self.half,
        };
        (size * density).round().as_uvec3().max(UVec3::ONE)
    }

    fn material_of(&self, side: usize) -> usize {
        if matches!(self.shape, Shape::Room) { WALLS[side] } else { self.material }
    }

    fn parts(&self, number: usize, cells: UVec3) -> Vec<Part> {
        let mut parts: Vec<Part> = Vec::new();
        for side in 0..6 {
            let material = self.material_of(side);
            if parts.last().is_none_or(|part| part.material != material) {
                parts.push(Part { body: number, material, ..Part::default() });
            }
            if let Some(part) = parts.last_mut() {
                self.push_side(part, side, cells);
            }
        }
        parts
    }

    /// Side 2a is the low one of axis a, 2a + 1 the high one.
    fn push_side(&self, part: &mut Part, side: usize, cells: UVec3) {
        let (axis, high) = (side / 2, side % 2 == 1);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let first = part.positions.len() as u32;
        let row = cells[u] + 1;
        let place = |i: u32| {
            let mut lattice = UVec3::ZERO;
            lattice[axis] = if high { cells[axis] } else { 0 };
            lattice[u] = i % row;
            lattice[v] = i / row;
            self.place(2.0 * lattice.as_vec3() / cells.as_vec3() - 1.0)
        };
        let positions: Vec<Vec3> = (0..row * (cells[v] + 1)).map(place).collect();
        // u x v points to the high side; the room is seen from inside.
        let flip = high == matches!(self.shape, Shape::Room);
        let quads = (0..cells[v]).flat_map(|j| (0..cells[u]).map(move |i| i + j * row));
        let triangles = quads.flat_map(|q| {
            let (a, b, c, d) = (q, q + 1, q + 1 + row, q + row);
            if flip { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] }
        });
        let triangles: Vec<[u32; 3]> = triangles.collect();
        part.normals.extend(normals(&positions, &triangles).map(|n| n.to_array()));
        part.positions.extend(positions.iter().map(Vec3::to_array));
        part.indices.extend(triangles.into_iter().flatten().map(|i| first + i));
    }

    /// Where a point of the surface of the cube -1..1 lies, metres. A function of the place alone, so that sides meet.
    fn place(&self, cube: Vec3) -> Vec3 {
        match self.shape {
            Shape::Block => self.centre + cube * self.half,
            Shape::Room | Shape::Column => {
                let p = self.centre + cube * self.half;
                p + ROUGH * Vec3::new(bumps(p), bumps(p.yzx() + 7.0), bumps(p.zxy() + 13.0))
            }
            Shape::Ball => {
                let direction = cube.normalize_or_zero();
                self.centre + direction * self.half * (1.0 + BUMPY * bumps(2.0 * direction + self.centre))
            }
        }
    }
}

/// Smooth bumps between -1 and 1: waves of 3 m, 1 m and 30 cm, each half as deep as the one before.
fn bumps(p: Vec3) -> f32 {
    let wave = |scale: f32| {
        let p = scale * p;
        libm::sinf(p.x + 0.3 * p.y) * libm::sinf(p.y - 0.2 * p.z) * libm::sinf(p.z + 0.4 * p.x + 1.0)
    };
    (wave(2.1) + 0.5 * wave(6.3) + 0.25 * wave(20.0)) / 1.75
}

/// Vertex normals: the mean of the triangles around, by area.
fn normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> impl Iterator<Item = Vec3> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| positions[i as usize]);
        let normal = (b - a).cross(c - a);
        triangle.iter().for_each(|&i| sums[i as usize] += normal);
    }
    sums.into_iter().map(Vec3::normalize_or_zero)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn count(parts: &[Part]) -> u64 {
        parts.iter().map(|part| part.indices.len() as u64 / 3).sum()
    }

    #[test]
    fn the_number_of_triangles_is_about_what_was_asked() {
        for (asked, tolerance) in [(1_000, 0.1), (10_000, 0.03), (100_000, 0.03), (300_000, 0.03)] {
            let made = count(&parts(asked)) as f64;
            assert!((made / asked as f64 - 1.0).abs() < tolerance, "{asked}: {made}");
        }
    }

    /// Directed edges by the bits of their ends: on a closed body each has its opposite exactly once.
    fn open_edges(corners: impl Iterator<Item = [Vec3; 3]>) -> usize {
        let bits = |p: Vec3| p.to_array().map(f32::to_bits);
        let mut edges = BTreeMap::new();
        for triangle in corners {
            for i in 0..3 {
                *edges.entry((bits(triangle[i]), bits(triangle[(i + 1) % 3]))).or_insert(0) += 1;
            }
        }
        let closed =
            |&(&(a, b), &n): &(&([u32; 3], [u32; 3]), &i32)| n == 1 && edges.get(&(b, a)) == Some(&1);
        edges.len() - edges.iter().filter(closed).count()
    }

    #[test]
    fn bodies_are_closed() {
        let parts = parts(5_000);
        assert_eq!(open_edges(corners(&parts)), 0);
        assert!(open_edges(corners(&parts).skip(1)) > 0, "the negative control");
    }

    /// Signed volume, by the divergence theorem; above 0 where fronts face outward.
    fn volume(body: usize, parts: &[Part]) -> f32 {
        let of: Vec<Part> = parts.iter().filter(|part| part.body == body).cloned().collect();
        corners(&of).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    #[test]
    fn the_room_is_seen_from_inside_and_everything_else_from_outside() {
        let parts = parts(20_000);
        let room = volume(0, &parts);
        assert!((room / -320.0 - 1.0).abs() < 0.02, "{room}");
        assert!((1..BODIES.len()).all(|body| volume(body, &parts) > 0.1));
        let block = volume(7, &parts);
        assert!((block - 8.0 * 0.4 * 0.8 * 0.6).abs() < 1e-3, "{block}");
    }

    #[test]
    fn normals_are_of_length_1_and_agree_with_their_triangles() {
        for part in parts(5_000) {
            for triangle in part.indices.as_chunks::<3>().0 {
                let [a, b, c] = triangle.map(|i| Vec3::from_array(part.positions[i as usize]));
                let flat = (b - a).cross(c - a).normalize_or_zero();
                for i in triangle {
                    let normal = Vec3::from_array(part.normals[*i as usize]);
                    assert!((normal.length() - 1.0).abs() < 1e-5 && normal.dot(flat) > 0.3);
                }
            }
        }
    }
}

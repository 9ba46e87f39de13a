//! The Cornell box, as Cornell University's Program of Computer Graphics measured it (1998), in metres.
//!
//! A hundredth of the published millimetre-scale numbers, so that the room is 5.5 m wide: a real room's size. The
//! measured corners differ by up to 6 mm from a right angle; here the walls are straight (552.8 x 548.8 x 559.2).
//! The room is centred on x = 0, its floor is y = 0, its open front z = 0, and it reaches to z = -5.592, so that a glTF
//! camera without rotation looks in. Measured x grows to the left seen from there, hence the flips.

use crate::glb::{Glb, Mesh, unit};
use serde_json::{Value, json};
use std::collections::BTreeMap;

const HALF_WIDTH: f32 = 2.764;
const HEIGHT: f32 = 5.488;
const DEPTH: f32 = 5.592;

/// Index of each material of [`document`].
const WHITE: usize = 0;
const RED: usize = 1;
const GREEN: usize = 2;

/// Footprints in the published coordinates: clockwise seen from above in their left-handed picture, which is
/// counter-clockwise seen from above in ours.
const SHORT_BLOCK: [[f32; 2]; 4] = [[130.0, 65.0], [82.0, 225.0], [240.0, 272.0], [290.0, 114.0]];
const TALL_BLOCK: [[f32; 2]; 4] = [[423.0, 247.0], [265.0, 296.0], [314.0, 456.0], [472.0, 406.0]];

/// Every scene that this project makes itself: file name and content.
#[must_use]
pub fn all() -> [(&'static str, Vec<u8>); 2] {
    [("cornell.glb", cornell()), ("cornell_sphere.glb", cornell_sphere())]
}

/// The classic room with two blocks, a point light below the ceiling and the classic camera.
#[must_use]
pub fn cornell() -> Vec<u8> {
    let lamp = json!({ "name": "lamp", "type": "point", "color": [1.0, 1.0, 1.0], "intensity": 100.0 });
    let lamp_node = json!({
        "name": "lamp",
        "translation": [0.0, 4.2, -2.796],
        "extensions": { "KHR_lights_punctual": { "light": 0 } },
    });
    room_with(("short block", block(SHORT_BLOCK, 1.65)), lamp, lamp_node)
}

/// A sphere in place of the short block, lit by a spot light from the upper back right corner.
#[must_use]
pub fn cornell_sphere() -> Vec<u8> {
    let spot = json!({
        "name": "spot",
        "type": "spot",
        "color": [1.0, 1.0, 1.0],
        "intensity": 400.0,
        "spot": { "innerConeAngle": 0.35, "outerConeAngle": 0.5 },
    });
    let position = [2.5, 5.2, -5.3];
    // Between the sphere and the middle of the floor: both are lit, and little leaves through the open front.
    let target = [-0.7, 0.0, -2.9];
    let spot_node = json!({
        "name": "spot",
        "translation": position,
        "rotation": rotation_to(std::array::from_fn(|k| target[k] - position[k])),
        "extensions": { "KHR_lights_punctual": { "light": 0 } },
    });
    room_with(("sphere", sphere([0.9, 0.9, -1.7], 0.9, 4)), spot, spot_node)
}

fn room_with((name, object): (&str, Mesh), light: Value, light_node: Value) -> Vec<u8> {
    let mut glb = Glb::new(document());
    let room = json!([
        glb.primitive(&floor_ceiling_back(), WHITE),
        glb.primitive(&side_wall(-HALF_WIDTH), RED),
        glb.primitive(&side_wall(HALF_WIDTH), GREEN),
    ]);
    let tall = json!([glb.primitive(&block(TALL_BLOCK, 3.3), WHITE)]);
    let object = json!([glb.primitive(&object, WHITE)]);
    glb.json["meshes"] = json!([
        { "name": "room", "primitives": room },
        { "name": "tall block", "primitives": tall },
        { "name": name, "primitives": object },
    ]);
    glb.json["nodes"] = json!([
        { "name": "room", "mesh": 0 },
        { "name": "tall block", "mesh": 1 },
        { "name": name, "mesh": 2 },
        light_node,
        { "name": "camera", "translation": [0.0, 2.73, 8.0], "camera": 0 },
    ]);
    glb.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [light] } });
    glb.finish()
}

/// The document without geometry. The classic vertical field of view: 25 mm of film behind 35 mm, 2 atan(12.5 / 35).
fn document() -> Value {
    let material = |name: &str, [r, g, b]: [f64; 3]| {
        json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0,
            },
        })
    };
    json!({
        "asset": { "version": "2.0", "generator": "make-assets" },
        "extensionsUsed": ["KHR_lights_punctual"],
        "scene": 0,
        "scenes": [{ "name": "Cornell box", "nodes": [0, 1, 2, 3, 4] }],
        "cameras": [{
            "name": "camera",
            "type": "perspective",
            "perspective": { "yfov": 0.686_135, "aspectRatio": 1.0, "znear": 0.1, "zfar": 100.0 },
        }],
        "materials": [
            material("white", [0.725, 0.71, 0.68]),
            material("red", [0.63, 0.065, 0.05]),
            material("green", [0.14, 0.45, 0.091]),
        ],
    })
}

fn floor_ceiling_back() -> Mesh {
    let (w, h, d) = (HALF_WIDTH, HEIGHT, DEPTH);
    let mut mesh = Mesh::default();
    mesh.push_quad([[-w, 0.0, 0.0], [w, 0.0, 0.0], [w, 0.0, -d], [-w, 0.0, -d]]);
    mesh.push_quad([[-w, h, -d], [w, h, -d], [w, h, 0.0], [-w, h, 0.0]]);
    mesh.push_quad([[-w, 0.0, -d], [w, 0.0, -d], [w, h, -d], [-w, h, -d]]);
    mesh
}

/// The wall at `x`, facing inward.
fn side_wall(x: f32) -> Mesh {
    let (back, front) = if x < 0.0 { (-DEPTH, 0.0) } else { (0.0, -DEPTH) };
    let mut mesh = Mesh::default();
    mesh.push_quad([[x, 0.0, front], [x, 0.0, back], [x, HEIGHT, back], [x, HEIGHT, front]]);
    mesh
}

/// A closed block of `height` metres on the floor.
fn block(footprint: [[f32; 2]; 4], height: f32) -> Mesh {
    let corner = |i: usize, y: f32| {
        let [x, z] = footprint[i % 4];
        [(276.4 - x) / 100.0, y, -z / 100.0]
    };
    let mut mesh = Mesh::default();
    mesh.push_quad([0, 1, 2, 3].map(|i| corner(i, height)));
    mesh.push_quad([3, 2, 1, 0].map(|i| corner(i, 0.0)));
    for i in 0..4 {
        mesh.push_quad([corner(i, 0.0), corner(i + 1, 0.0), corner(i + 1, height), corner(i, height)]);
    }
    mesh
}

/// An icosahedron whose triangles are split in four `levels` times, pushed out onto the sphere; smooth normals.
fn sphere(centre: [f64; 3], radius: f64, levels: u32) -> Mesh {
    let (mut directions, mut triangles) = icosahedron();
    for _ in 0..levels {
        triangles = split(&mut directions, &triangles);
    }
    let position = |d: &[f32; 3]| std::array::from_fn(|k| (centre[k] + radius * f64::from(d[k])) as f32);
    Mesh {
        positions: directions.iter().map(position).collect(),
        indices: triangles.into_iter().flatten().collect(),
        normals: directions,
    }
}

/// Corners of three golden rectangles, and the faces between them.
fn icosahedron() -> (Vec<[f32; 3]>, Vec<[u16; 3]>) {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut directions = Vec::with_capacity(12);
    for axis in 0..3 {
        for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
            let mut corner = [0.0; 3];
            corner[(axis + 1) % 3] = a;
            corner[(axis + 2) % 3] = b;
            directions.push(unit(corner));
        }
    }
    (directions.clone(), icosahedron_faces(&directions))
}

/// Every triple of neighbours, counter-clockwise seen from outside.
fn icosahedron_faces(directions: &[[f32; 3]]) -> Vec<[u16; 3]> {
    // Neighbours have an angle with cosine 1/sqrt(5) = 0.447, all others at most -0.447.
    let near = |i: usize, j: usize| dot(directions[i], directions[j]) > 0.4;
    let mut faces = Vec::with_capacity(20);
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(i, k) {
                    let outward = determinant(directions[i], directions[j], directions[k]) > 0.0;
                    let (j, k) = if outward { (j, k) } else { (k, j) };
                    faces.push([i as u16, j as u16, k as u16]);
                }
            }
        }
    }
    faces
}

fn split(directions: &mut Vec<[f32; 3]>, triangles: &[[u16; 3]]) -> Vec<[u16; 3]> {
    let mut middles = BTreeMap::new();
    let mut middle = |a: u16, b: u16| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            let (p, q) = (directions[usize::from(a)], directions[usize::from(b)]);
            directions.push(unit(std::array::from_fn(|k| f64::from(p[k]) + f64::from(q[k]))));
            (directions.len() - 1) as u16
        })
    };
    let mut parts = Vec::with_capacity(4 * triangles.len());
    for &[a, b, c] in triangles {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        parts.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    parts
}

/// The quaternion (x, y, z, w) that turns -z into `direction`.
fn rotation_to(direction: [f64; 3]) -> [f32; 4] {
    let [x, y, z] = unit(direction).map(f64::from);
    // Half way between two unit vectors: (from x to, 1 + from . to), with from = -z.
    let [qx, qy, qz, qw] = [y, -x, 0.0, 1.0 - z];
    let length = (qx * qx + qy * qy + qw * qw).sqrt();
    [qx, qy, qz, qw].map(|q| (q / length) as f32)
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn determinant(a: [f32; 3], b: [f32; 3], c: [f32; 3]) -> f32 {
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

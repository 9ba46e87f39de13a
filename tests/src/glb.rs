//! A tiny GLB writer: enough for the scenes that this project makes itself, and for tests.

use serde_json::{Value, json};

/// Collects accessors into one buffer; [`Glb::finish`] writes the container.
pub struct Glb {
    /// The document; everything but `buffers`, `bufferViews` and `accessors` is the caller's.
    pub json: Value,
    bin: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

/// One attribute-complete run of triangles.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertices in metres.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, as long as `positions`.
    pub normals: Vec<[f32; 3]>,
    /// Three per triangle, counter-clockwise seen from the front.
    pub indices: Vec<u16>,
}

impl Mesh {
    /// Adds a flat quad of two triangles; corners counter-clockwise seen from its front.
    pub fn push_quad(&mut self, corners: [[f32; 3]; 4]) {
        let edge = |i: usize| std::array::from_fn(|k| f64::from(corners[i][k]) - f64::from(corners[0][k]));
        let normal = unit(cross(edge(1), edge(2)));
        let first = self.positions.len() as u16;
        self.positions.extend(corners);
        self.normals.extend([normal; 4]);
        self.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
    }
}

impl Glb {
    /// Starts from a document without buffers.
    #[must_use]
    pub fn new(json: Value) -> Self {
        Self { json, bin: Vec::new(), views: Vec::new(), accessors: Vec::new() }
    }

    /// Stores a mesh's arrays and returns its glTF primitive.
    pub fn primitive(&mut self, mesh: &Mesh, material: usize) -> Value {
        let bytes: Vec<u8> = mesh.indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        self.primitive_of((&mesh.positions, &mesh.normals), (5123, mesh.indices.len(), &bytes), material)
    }

    /// As [`Glb::primitive`], for more than 65,536 vertices.
    #[must_use]
    pub fn large_primitive(
        &mut self,
        positions: &[[f32; 3]],
        normals: &[[f32; 3]],
        indices: &[u32],
        material: usize,
    ) -> Value {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        self.primitive_of((positions, normals), (5125, indices.len(), &bytes), material)
    }

    /// Indices by their component type, their number and their bytes.
    fn primitive_of(
        &mut self,
        (positions, normals): (&[[f32; 3]], &[[f32; 3]]),
        (component, count, indices): (u32, usize, &[u8]),
        material: usize,
    ) -> Value {
        let position = self.push_vec3(positions, true);
        let normal = self.push_vec3(normals, false);
        let indices = self.push_indices(component, count, indices);
        json!({
            "attributes": { "POSITION": position, "NORMAL": normal },
            "indices": indices,
            "material": material,
        })
    }

    /// The finished container, its chunks padded to four bytes.
    #[must_use]
    pub fn finish(mut self) -> Vec<u8> {
        self.json["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        self.json["bufferViews"] = Value::Array(self.views);
        self.json["accessors"] = Value::Array(self.accessors);
        container(&self.json, &self.bin)
    }

    fn push_vec3(&mut self, values: &[[f32; 3]], bounds: bool) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let mut accessor = json!({
            "bufferView": self.push_view(&bytes, 34962),
            "componentType": 5126,
            "count": values.len(),
            "type": "VEC3",
        });
        if bounds {
            let extreme = |pick: fn(f32, f32) -> f32, start: f32| -> [f32; 3] {
                std::array::from_fn(|k| values.iter().fold(start, |best, value| pick(best, value[k])))
            };
            accessor["min"] = json!(extreme(f32::min, f32::INFINITY));
            accessor["max"] = json!(extreme(f32::max, f32::NEG_INFINITY));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn push_indices(&mut self, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.push_view(bytes, 34963);
        self.accessors.push(json!({
            "bufferView": view,
            "componentType": component,
            "count": count,
            "type": "SCALAR",
        }));
        self.accessors.len() - 1
    }

    fn push_view(&mut self, bytes: &[u8], target: u32) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.views.push(json!({
            "buffer": 0,
            "byteOffset": self.bin.len(),
            "byteLength": bytes.len(),
            "target": target,
        }));
        self.bin.extend(bytes);
        self.views.len() - 1
    }
}

/// A GLB of these two chunks, padded to four bytes.
#[must_use]
pub fn container(json: &Value, bin: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let padded = bin.len().next_multiple_of(4);

    let total = 12 + 8 + text.len() + 8 + padded;
    let mut glb = Vec::with_capacity(total);
    glb.extend(b"glTF");
    push_u32(&mut glb, 2);
    push_u32(&mut glb, total);
    push_u32(&mut glb, text.len());
    glb.extend(b"JSON");
    glb.extend(text);
    push_u32(&mut glb, padded);
    glb.extend(b"BIN\0");
    glb.extend(bin);
    glb.resize(total, 0);
    glb
}

fn push_u32(bytes: &mut Vec<u8>, value: usize) {
    bytes.extend((value as u32).to_le_bytes());
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The unit vector along `v`, which must not be 0.
#[must_use]
pub fn unit(v: [f64; 3]) -> [f32; 3] {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    v.map(|x| (x / length) as f32)
}

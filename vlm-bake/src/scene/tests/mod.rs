//! Small scenes with known answers.

mod geometry;
mod material;
mod punctual;
mod authored;
mod defaults;

use super::{Error, LoadOptions, Scene, load};
use image::{ImageFormat, RgbaImage};
use serde_json::{Value, json};
use std::io::Cursor;
use vlm_format::GltfFile;

/// The right-angled triangle (0,0,0), (1,0,0), (0,1,0): its front faces +z.
const CORNERS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// A document whose accessors, views and binary chunk grow call by call.
struct Builder {
    json: Value,
    bin: Vec<u8>,
}

impl Builder {
    /// One mesh of one primitive (a list without indices) on one node; tests overwrite what they need.
    fn new(positions: &[[f32; 3]]) -> Self {
        let mut builder = Self {
            json: json!({
                "asset": { "version": "2.0" },
                "scene": 0,
                "scenes": [{ "nodes": [0] }],
                "nodes": [{ "mesh": 0 }],
                "meshes": [{ "primitives": [{ "attributes": {} }] }],
                "accessors": [],
                "bufferViews": [],
            }),
            bin: Vec::new(),
        };
        let accessor = builder.floats(positions);
        builder.primitive()["attributes"]["POSITION"] = accessor;
        builder
    }

    fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    fn node(&mut self) -> &mut Value {
        &mut self.json["nodes"][0]
    }

    /// Adds an accessor of vectors and returns its index.
    fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> Value {
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4", "MAT4"][if N == 16 { 4 } else { N - 1 }];
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(&bytes, values.len(), kind, 5126)
    }

    fn indices(&mut self, values: &[u16]) -> Value {
        let bytes: Vec<u8> = values.iter().flat_map(|i| i.to_le_bytes()).collect();
        self.accessor(&bytes, values.len(), "SCALAR", 5123)
    }

    fn accessor(&mut self, bytes: &[u8], count: usize, kind: &str, component: u32) -> Value {
        let view = self.view(bytes);
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors
            .push(json!({ "bufferView": view, "componentType": component, "count": count, "type": kind }));
        json!(accessors.len() - 1)
    }

    fn view(&mut self, bytes: &[u8]) -> Value {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len() }));
        self.bin.extend(bytes);
        json!(views.len() - 1)
    }

    /// Gives the primitive a material with a texture of these texels and texture coordinates.
    fn texture(&mut self, size: u32, texel: impl Fn(u32, u32) -> [u8; 4], uvs: &[[f32; 2]]) -> &mut Value {
        let image = RgbaImage::from_fn(size, size, |x, y| image::Rgba(texel(x, y)));
        let mut png = Cursor::new(Vec::new());
        image.write_to(&mut png, ImageFormat::Png).unwrap();
        let view = self.view(png.get_ref());
        self.json["images"] = json!([{ "bufferView": view, "mimeType": "image/png" }]);
        self.json["textures"] = json!([{ "source": 0 }]);
        let accessor = self.floats(uvs);
        self.primitive()["attributes"]["TEXCOORD_0"] = accessor;
        self.material(json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }))
    }

    #[expect(clippy::needless_pass_by_value, reason = "callers hand over literals")]
    fn material(&mut self, material: Value) -> &mut Value {
        self.primitive()["material"] = json!(0);
        self.json["materials"] = json!([material]);
        &mut self.json["materials"][0]
    }

    fn load(mut self) -> Result<Scene, Error> {
        self.json["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        let mut text = self.json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut glb = b"glTF".to_vec();
        let total = 28 + text.len() + self.bin.len();
        for (number, chunk) in [(2, &[][..]), (total, &[]), (text.len(), b"JSON")] {
            glb.extend((number as u32).to_le_bytes());
            glb.extend(chunk);
        }
        glb.extend(text);
        glb.extend((self.bin.len() as u32).to_le_bytes());
        glb.extend(b"BIN\0");
        glb.extend(self.bin);
        load(&GltfFile::from_slice(&glb, "test.glb", None)?, &LoadOptions::default())
    }
}

//! Running the program, and small scenes to run it on.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use base64::Engine;
use serde_json::{Value, json};
use tempfile::TempDir;
use vlm_format::{GltfFile, VlmAsset, read_vlm};

/// `vlm` with arguments.
pub fn vlm<'a>(arguments: impl IntoIterator<Item = &'a str>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vlm"));
    command.args(arguments).stdin(Stdio::null());
    command
}

/// Runs `vlm` to its end.
pub fn run<'a>(arguments: impl IntoIterator<Item = &'a str>) -> Output {
    vlm(arguments).output().unwrap()
}

/// Runs `vlm` with bytes on standard input.
pub fn run_with_input(arguments: &[&str], input: &[u8]) -> Output {
    let mut command = vlm(arguments.iter().copied());
    let mut child =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut pipe = child.stdin.take().unwrap();
    let input = input.to_vec();
    let writer = std::thread::spawn(move || pipe.write_all(&input));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap().unwrap();
    output
}

pub fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// A path of the repository.
pub fn repository(path: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path).display().to_string()
}

/// A folder for inputs and one for outputs.
pub struct Folders {
    root: TempDir,
}

impl Folders {
    pub fn new() -> Self {
        let root = tempfile::tempdir().unwrap();
        std::fs::create_dir(root.path().join("out")).unwrap();
        Self { root }
    }

    /// Writes an input and returns its path.
    pub fn input(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        let path = self.root.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path.display().to_string()
    }

    /// A path in the output folder.
    pub fn output(&self, name: &str) -> String {
        self.root.path().join("out").join(name).display().to_string()
    }

    /// Everything in the output folder.
    pub fn outputs(&self) -> Vec<PathBuf> {
        std::fs::read_dir(self.root.path().join("out")).unwrap().map(|entry| entry.unwrap().path()).collect()
    }

    /// Bakes a document with extra flags, and reads what came out. Panics with the program's message if it fails.
    pub fn bake(&self, document: &Document, flags: &[&str]) -> VlmAsset {
        let (input, output) = (self.input("in.gltf", document.to_string()), self.output("out.glb"));
        let arguments = ["bake", &input, "-o", &output].into_iter().chain(flags.iter().copied());
        let result = run(arguments);
        assert!(result.status.success(), "{}", text(&result.stderr));
        read(&output)
    }
}

/// The asset of a baked file.
pub fn read(path: &str) -> VlmAsset {
    read_vlm(&GltfFile::open(Path::new(path)).unwrap()).unwrap().unwrap()
}

/// A glTF document of flat quads, all its data in one data URI.
#[derive(Clone)]
pub struct Document {
    pub json: Value,
    bytes: Vec<u8>,
}

impl Document {
    /// Without nodes; material 0 is white (albedo 0.8), 1 red, 2 black and emissive.
    pub fn new() -> Self {
        let colored = |rgb: [f64; 3]| {
            json!({ "pbrMetallicRoughness": {
                "baseColorFactor": [rgb[0], rgb[1], rgb[2], 1.0], "metallicFactor": 0.0,
            } })
        };
        let mut lamp = colored([0.0, 0.0, 0.0]);
        lamp["emissiveFactor"] = json!([1.0, 0.5, 0.25]);
        Self {
            json: json!({
                "asset": { "version": "2.0" },
                "scene": 0,
                "scenes": [{ "nodes": [] }],
                "nodes": [], "meshes": [], "accessors": [], "bufferViews": [],
                "materials": [colored([0.8, 0.8, 0.8]), colored([0.8, 0.1, 0.1]), lamp],
            }),
            bytes: Vec::new(),
        }
    }

    /// The six walls of a closed room, 4 m wide, seen from inside.
    pub fn room() -> Self {
        let mut document = Self::new();
        let (a, b) = (-2.0, 2.0);
        let walls = [
            [[a, a, b], [b, a, b], [b, a, a], [a, a, a]],
            [[a, b, a], [b, b, a], [b, b, b], [a, b, b]],
            [[a, a, a], [b, a, a], [b, b, a], [a, b, a]],
            [[b, a, b], [a, a, b], [a, b, b], [b, b, b]],
            [[a, a, b], [a, a, a], [a, b, a], [a, b, b]],
            [[b, a, a], [b, a, b], [b, b, b], [b, b, a]],
        ];
        document.push("room", &walls, Some(0));
        document
    }

    /// Adds a node with a mesh of quads (counter-clockwise seen from the front) and returns it.
    pub fn push(&mut self, name: &str, quads: &[[[f32; 3]; 4]], material: Option<u32>) -> &mut Value {
        let indices: Vec<u32> =
            (0..quads.len() as u32).flat_map(|q| [0, 1, 2, 0, 2, 3].map(|i| 4 * q + i)).collect();
        let positions = self.accessor(quads.as_flattened().as_flattened(), 3, "VEC3", 5126);
        let indices = self.accessor(&indices, 1, "SCALAR", 5125);
        let mut primitive = json!({ "attributes": { "POSITION": positions }, "indices": indices });
        if let Some(material) = material {
            primitive["material"] = json!(material);
        }
        let mesh = count(&self.json["meshes"]);
        list(&mut self.json["meshes"]).push(json!({ "primitives": [primitive] }));
        let node = count(&self.json["nodes"]);
        list(&mut self.json["scenes"][0]["nodes"]).push(json!(node));
        list(&mut self.json["nodes"]).push(json!({ "name": name, "mesh": mesh }));
        &mut self.json["nodes"][node]
    }

    fn accessor<T: bytemuck::Pod>(
        &mut self,
        values: &[T],
        width: usize,
        kind: &str,
        component: u32,
    ) -> usize {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        let view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        self.bytes.extend(bytes);
        let index = count(&self.json["accessors"]);
        let mut accessor = json!({
            "bufferView": index, "componentType": component, "type": kind, "count": values.len() / width,
        });
        if width == 3 {
            let numbers: &[f32] = bytemuck::cast_slice(values);
            let of = |k: usize| numbers.iter().skip(k).step_by(3).copied().filter(|x| x.is_finite());
            accessor["min"] = json!([0, 1, 2].map(|k| of(k).fold(f32::INFINITY, f32::min)));
            accessor["max"] = json!([0, 1, 2].map(|k| of(k).fold(f32::NEG_INFINITY, f32::max)));
        }
        list(&mut self.json["bufferViews"]).push(view);
        list(&mut self.json["accessors"]).push(accessor);
        index
    }
}

impl std::fmt::Display for Document {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut json = self.json.clone();
        if json.get("buffers").is_none() {
            let data = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
            let uri = format!("data:application/octet-stream;base64,{data}");
            json["buffers"] = json!([{ "byteLength": self.bytes.len(), "uri": uri }]);
        }
        json.fmt(f)
    }
}

fn list(value: &mut Value) -> &mut Vec<Value> {
    value.as_array_mut().unwrap()
}

fn count(value: &Value) -> usize {
    value.as_array().unwrap().len()
}

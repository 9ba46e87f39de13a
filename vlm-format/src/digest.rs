//! Digests of what a Virtual Light Mesh was made from, so that a reader sees when it no longer fits.
//!
//! All are BLAKE3 cut to 128 bits, in hexadecimal. They cover *decoded* content, resolved through all indices, so that a
//! tool that renumbers, reorders or repacks without changing anything leaves them as they are.

use std::collections::HashMap;

use glam::DMat4;
use serde_json::Value;

use crate::check::{array, index};
use crate::container::GltfFile;
use crate::error::Error;

/// Accumulates typed values; every variable-length value is preceded by its length.
#[derive(Default)]
pub(crate) struct Hasher(blake3::Hasher);

impl Hasher {
    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    fn number(&mut self, number: u64) {
        self.0.update(&number.to_le_bytes());
    }

    fn floats(&mut self, floats: &[f32]) {
        self.number(floats.len() as u64);
        for float in floats {
            self.0.update(&float.to_le_bytes());
        }
    }

    fn matrix(&mut self, matrix: &DMat4) {
        for number in matrix.to_cols_array() {
            // Adding 0 makes -0 and 0 the same.
            self.0.update(&(number + 0.0).to_le_bytes());
        }
    }

    /// 32 hexadecimal digits.
    pub(crate) fn finish(&self) -> String {
        let mut hex = self.0.finalize().to_hex().to_string();
        hex.truncate(32);
        hex
    }
}

/// The digest of one array of elements, given as little-endian bytes.
pub(crate) fn of_array(kind: &str, bytes: &[u8]) -> String {
    let mut hasher = Hasher::default();
    hasher.bytes(kind.as_bytes());
    hasher.bytes(bytes);
    hasher.finish()
}

/// Finds the digests of a file's nodes; images and meshes that several nodes share are read once.
pub(crate) struct Source<'a> {
    file: &'a GltfFile,
    world_from_nodes: Vec<DMat4>,
    meshes: HashMap<usize, String>,
    images: HashMap<usize, String>,
}

impl<'a> Source<'a> {
    pub(crate) fn new(file: &'a GltfFile) -> Self {
        let world_from_nodes = file.world_from_nodes();
        Self { file, world_from_nodes, meshes: HashMap::new(), images: HashMap::new() }
    }

    /// Geometry and colours of a node's mesh, in node space, morphed and skinned as at rest.
    pub(crate) fn geometry(&mut self, node: usize) -> Result<String, Error> {
        let mut hasher = Hasher::default();
        let node = self.file.document().nodes().nth(node);
        if let Some((node, mesh)) = node.and_then(|node| Some((node.clone(), node.mesh()?))) {
            hasher.bytes(self.mesh(&mesh)?.as_bytes());
            hasher.floats(node.weights().or(mesh.weights()).unwrap_or_default());
            if let Some(skin) = node.skin() {
                self.skin(&skin, &mut hasher)?;
            }
        }
        Ok(hasher.finish())
    }

    fn mesh(&mut self, mesh: &gltf::Mesh<'_>) -> Result<String, Error> {
        if let Some(known) = self.meshes.get(&mesh.index()) {
            return Ok(known.clone());
        }
        let mut hasher = Hasher::default();
        for primitive in mesh.primitives() {
            self.primitive(&primitive, &mut hasher)?;
        }
        let digest = hasher.finish();
        self.meshes.insert(mesh.index(), digest.clone());
        Ok(digest)
    }

    /// Where the joints stand, in world space as a skin is.
    fn skin(&self, skin: &gltf::Skin<'_>, hasher: &mut Hasher) -> Result<(), Error> {
        for joint in skin.joints() {
            hasher.matrix(&self.world_from_nodes.get(joint.index()).copied().unwrap_or_default());
        }
        self.accessor(skin.inverse_bind_matrices(), hasher)
    }

    /// The global transform of a node, and its instances.
    pub(crate) fn transform(&self, node: usize) -> Result<String, Error> {
        let mut hasher = Hasher::default();
        hasher.matrix(&self.world_from_nodes.get(node).copied().unwrap_or_default());
        let nodes = array(self.file.json(), "/nodes");
        let instances =
            nodes.get(node).and_then(|node| node.pointer("/extensions/EXT_mesh_gpu_instancing/attributes"));
        for key in ["TRANSLATION", "ROTATION", "SCALE"] {
            if let Some(accessor) = instances.and_then(|attributes| index(attributes, key)) {
                hasher.bytes(key.as_bytes());
                hasher.floats(&self.file.read_floats(accessor)?);
            }
        }
        Ok(hasher.finish())
    }

    /// All that a grid in world space depends on: every mesh of the file, where it stands, in the order of the nodes.
    pub(crate) fn scene(&mut self) -> Result<String, Error> {
        let mut hasher = Hasher::default();
        for (node, json) in array(self.file.json(), "/nodes").iter().enumerate() {
            if json.get("mesh").is_some() {
                hasher.bytes(self.transform(node)?.as_bytes());
                hasher.bytes(self.geometry(node)?.as_bytes());
            }
        }
        Ok(hasher.finish())
    }

    fn primitive(&mut self, primitive: &gltf::Primitive<'_>, hasher: &mut Hasher) -> Result<(), Error> {
        hasher.number(u64::from(primitive.mode().as_gl_enum()));
        let vertices = [
            gltf::Semantic::Positions,
            gltf::Semantic::Colors(0),
            gltf::Semantic::Joints(0),
            gltf::Semantic::Weights(0),
        ];
        for semantic in vertices {
            self.accessor(primitive.get(&semantic), hasher)?;
        }
        for target in primitive.morph_targets() {
            self.accessor(target.positions(), hasher)?;
        }
        let indices = primitive.indices().map(|accessor| self.file.read_u32(accessor.index())).transpose()?;
        let indices: Vec<u8> = indices.unwrap_or_default().into_iter().flat_map(u32::to_le_bytes).collect();
        hasher.bytes(&indices);
        self.material(primitive, hasher)
    }

    fn accessor(&self, accessor: Option<gltf::Accessor<'_>>, hasher: &mut Hasher) -> Result<(), Error> {
        let floats = accessor.map(|accessor| self.file.read_floats(accessor.index())).transpose()?;
        hasher.floats(&floats.unwrap_or_default());
        Ok(())
    }

    /// What decides a surface's diffuse colour and emission.
    fn material(&mut self, primitive: &gltf::Primitive<'_>, hasher: &mut Hasher) -> Result<(), Error> {
        let material = primitive.material();
        let pbr = material.pbr_metallic_roughness();
        hasher.floats(&pbr.base_color_factor());
        hasher.floats(&material.emissive_factor());
        let transmission =
            material.transmission().map_or(0.0, |transmission| transmission.transmission_factor());
        let cutoff = material.alpha_cutoff().unwrap_or(0.5);
        hasher.floats(&[material.emissive_strength().unwrap_or(1.0), transmission, cutoff]);
        hasher.number(material.alpha_mode() as u64);
        hasher.number(u64::from(material.double_sided()));
        for info in [pbr.base_color_texture(), material.emissive_texture()].into_iter().flatten() {
            self.texture(primitive, &info, hasher)?;
        }
        Ok(())
    }

    fn texture(
        &mut self,
        primitive: &gltf::Primitive<'_>,
        info: &gltf::texture::Info<'_>,
        hasher: &mut Hasher,
    ) -> Result<(), Error> {
        let mut set = info.tex_coord();
        if let Some(transform) = info.texture_transform() {
            hasher.floats(&transform.offset());
            hasher.floats(&transform.scale());
            hasher.floats(&[transform.rotation()]);
            set = transform.tex_coord().unwrap_or(set);
        }
        self.accessor(primitive.get(&gltf::Semantic::TexCoords(set)), hasher)?;
        let sampler = info.texture().sampler();
        hasher.number(u64::from(sampler.wrap_s().as_gl_enum()));
        hasher.number(u64::from(sampler.wrap_t().as_gl_enum()));
        if let Some(image) = info.texture().source() {
            hasher.bytes(self.image(image.index()).as_bytes());
        }
        Ok(())
    }

    /// An image that cannot be read counts as empty: whether that matters is for the reader of colours to say.
    fn image(&mut self, image: usize) -> &str {
        let file = self.file;
        self.images
            .entry(image)
            .or_insert_with(|| of_array("image", &file.image_bytes(image).unwrap_or_default()))
    }
}

/// A digest property as text; empty if absent.
pub(crate) fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value.get(key).and_then(Value::as_str).unwrap_or_default()
}

//! Small meshes on which baking is hard, and a checker of bakes that shares no code with the baker.
//!
//! Builders give a [`HardMesh`]: objects of pieces of triangles, written as glTF by [`HardMesh::glb`]. Corners that should weld
//! are computed by the same expression, so that they agree bit by bit.

pub mod shapes;
pub mod sheets;
pub mod solids;
pub mod random;
pub mod checker;

use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use vlm_bake::scene::{self, LoadOptions, Scene};
use vlm_format::{Error, GltfFile};

use crate::glb::Glb;

/// Corners in metres, counter-clockwise seen from the front.
pub type Triangle = [DVec3; 3];

/// Triangles of one material: one glTF primitive.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Linear albedo, 0 to 1.
    pub albedo: [f32; 3],
    /// The material says that both sides reflect.
    pub two_sided: bool,
    /// At least one.
    pub triangles: Vec<Triangle>,
}

/// Objects by name, each a glTF node of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HardMesh {
    /// Name and pieces.
    pub objects: Vec<(String, Vec<Piece>)>,
}

/// The albedo of everything that needs no colour of its own.
const GREY: [f32; 3] = [0.6, 0.5, 0.4];

impl Piece {
    /// Grey, its fronts alone reflect.
    #[must_use]
    pub fn new(triangles: Vec<Triangle>) -> Self {
        Self { albedo: GREY, two_sided: false, triangles }
    }

    /// The same with both sides reflecting.
    #[must_use]
    pub fn two_sided(self) -> Self {
        Self { two_sided: true, ..self }
    }

    /// The same in another albedo.
    #[must_use]
    pub fn of_albedo(self, albedo: [f32; 3]) -> Self {
        Self { albedo, ..self }
    }
}

impl HardMesh {
    /// One object of one grey piece.
    #[must_use]
    pub fn of(triangles: Vec<Triangle>) -> Self {
        Self::of_piece(Piece::new(triangles))
    }

    /// One object of one piece.
    #[must_use]
    pub fn of_piece(piece: Piece) -> Self {
        Self::default().with("mesh", vec![piece])
    }

    /// Adds an object.
    #[must_use]
    pub fn with(mut self, name: &str, pieces: Vec<Piece>) -> Self {
        self.objects.push((name.to_owned(), pieces));
        self
    }

    /// Every corner multiplied by `factor`.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        self.map(|p| p * factor)
    }

    /// Every corner moved by `by` metres.
    #[must_use]
    pub fn moved(self, by: DVec3) -> Self {
        self.map(|p| p + by)
    }

    fn map(mut self, place: impl Fn(DVec3) -> DVec3) -> Self {
        let pieces = self.objects.iter_mut().flat_map(|(_, pieces)| pieces);
        let corners = pieces.flat_map(|piece| piece.triangles.iter_mut().flatten());
        corners.for_each(|corner| *corner = place(*corner));
        self
    }

    /// The mesh as a glTF file.
    #[must_use]
    pub fn glb(&self) -> Vec<u8> {
        let pieces = || self.objects.iter().flat_map(|(_, pieces)| pieces);
        let mut glb = Glb::new(json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": (0..self.objects.len()).collect::<Vec<_>>() }],
            "nodes": self.objects.iter().enumerate().map(|(i, (name, _))| json!({ "name": name, "mesh": i })).collect::<Vec<_>>(),
            "materials": pieces().map(material).collect::<Vec<_>>(),
        }));
        let mut number = 0;
        let mut meshes = Vec::new();
        for (_, pieces) in &self.objects {
            let first = number;
            number += pieces.len();
            let primitives = pieces.iter().zip(first..).map(|(piece, m)| primitive(&mut glb, piece, m));
            meshes.push(json!({ "primitives": primitives.collect::<Vec<_>>() }));
        }
        glb.json["meshes"] = Value::Array(meshes);
        glb.finish()
    }

    /// The mesh as the baker reads it.
    ///
    /// # Errors
    /// If the file is refused.
    pub fn scene(&self) -> Result<Scene, SceneError> {
        let file = GltfFile::from_slice(&self.glb(), "hard_mesh.glb", None)?;
        Ok(scene::load(&file, &LoadOptions::default())?)
    }
}

/// Why a mesh could not be read back.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file is no glTF.
    #[error(transparent)]
    Format(#[from] Error),
    /// The file holds no scene.
    #[error(transparent)]
    Scene(#[from] scene::Error),
}

fn material(piece: &Piece) -> Value {
    let [r, g, b] = piece.albedo;
    json!({
        "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0 },
        "doubleSided": piece.two_sided,
    })
}

/// Three vertices a triangle, with its own normal: welding is the baker's work.
fn primitive(glb: &mut Glb, piece: &Piece, material: usize) -> Value {
    let positions: Vec<[f32; 3]> = piece.triangles.iter().flatten().map(|p| p.as_vec3().to_array()).collect();
    let normal = |[a, b, c]: &Triangle| {
        let normal = (*b - *a).cross(*c - *a).try_normalize();
        normal.map_or(Vec3::Z, |n| n.as_vec3()).to_array()
    };
    let normals: Vec<[f32; 3]> = piece.triangles.iter().flat_map(|t| [normal(t); 3]).collect();
    let indices: Vec<u32> = (0..positions.len() as u32).collect();
    glb.large_primitive(&positions, &normals, &indices, material)
}

//! glTF in, scene out.

use super::deform;
use super::geometry::{self, LocalMesh, Placement};
use super::material::{self, MaterialTable, TextureRequest};
use super::node::{self, PlacedNode};
use super::volume::Boxes;
use super::{Object, Scene, authored, camera, decode, light, steering};
use glam::DMat4;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use vlm_format::GltfFile;

/// How a scene is read.
#[derive(Clone, Copy)]
pub struct LoadOptions<'a> {
    /// Textures with a longer side are halved until they fit, texels. A light stands for far more than a texel, so this
    /// changes pictures taken from close by and nothing else. Higher values cost memory: 2048 takes up to 27 MiB a
    /// texture, 4096 four times that.
    pub max_texture_side: u32,
    /// Scenes with more vertices, every instance counted, are refused. A vertex takes about 64 bytes here and several times that in a
    /// bake.
    pub max_vertices: usize,
    /// Called from any thread when a texture is done: how many are, and of how many.
    pub on_texture: Option<&'a (dyn Fn(usize, usize) + Sync)>,
}

impl Default for LoadOptions<'_> {
    fn default() -> Self {
        Self { max_texture_side: 2048, max_vertices: geometry::MAX_VERTICES, on_texture: None }
    }
}

impl LoadOptions<'_> {
    pub(super) fn report_texture(&self, done: usize, total: usize) {
        if let Some(on_texture) = self.on_texture {
            on_texture(done, total);
        }
    }
}

/// Why a scene could not be made of a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file could not be read.
    #[error(transparent)]
    File(#[from] vlm_format::Error),
    /// Nothing is drawn that light could fall on.
    #[error("{file}: no triangles to light: {reason}")]
    NoTriangles {
        /// Name of the file.
        file: String,
        /// What there is instead, and what to do.
        reason: &'static str,
    },
    /// A vertex is too far away to compute with.
    #[error(
        "{file}: {pointer}: a vertex lies farther than {} m from the origin in world space; correct the mesh, or the transforms, skin or \
         instances of the nodes that use it",
        geometry::FARTHEST
    )]
    TooFar {
        /// Name of the file.
        file: String,
        /// JSON pointer of the primitive.
        pointer: String,
    },
    /// The scene is too small to compute with.
    #[error(
        "{file}: the whole scene is only {extent_m:e} m wide, less than {} m; scale it: glTF's unit is the metre",
        geometry::NARROWEST
    )]
    TooSmall {
        /// Name of the file.
        file: String,
        /// The longest side of the box around all that is drawn, metres.
        extent_m: f64,
    },
    /// The scene does not fit into the arrays.
    #[error(
        "{file}: the scene has more than {limit} vertices once every instance is placed; bake it in parts, or allow more where there \
         is memory for them (--max-vertices)"
    )]
    TooLarge {
        /// Name of the file.
        file: String,
        /// Most vertices that are possible.
        limit: usize,
    },
    /// An artist's setting has the wrong type or range.
    #[error("{file}: {pointer}: found {found}, expected {expected}")]
    Steering {
        /// Name of the file.
        file: String,
        /// JSON pointer of the value.
        pointer: String,
        /// The value, abbreviated.
        found: String,
        /// What may stand there.
        expected: &'static str,
    },
}

/// Reads the default scene of a file (else its first, else all its nodes).
///
/// Skins and morph targets keep the pose that the file's nodes and weights hold. Points, lines and triangles without
/// area are left out, with a note.
///
/// # Errors
/// [`Error`] says which.
pub fn load(file: &GltfFile, options: &LoadOptions) -> Result<Scene, Error> {
    let nodes = node::drawn_nodes(file);
    let mut loader = Loader::new(file, &nodes, options.max_vertices);
    for (index, placed) in nodes.iter().enumerate() {
        if let Some(mesh) = placed.node.mesh() {
            loader.add_object(index, placed, &mesh)?;
        }
    }
    let (mut scene, requests, drafts) = loader.finish()?;
    scene.textures = decode::textures(file, &requests, options, &mut scene.notes);
    scene.authored = authored::finish(&mut scene, drafts);
    scene.lights = light::punctual_lights(&nodes);
    scene.cameras = camera::cameras(&nodes);
    Ok(scene)
}

/// Gathers the geometry of one object after the other.
struct Loader<'a> {
    file: &'a GltfFile,
    nodes: &'a [PlacedNode<'a>],
    max_vertices: usize,
    table: MaterialTable,
    /// Primitives read so far, by mesh and primitive: nodes share them. `None` for those without triangles.
    local_meshes: BTreeMap<(usize, usize), Option<Rc<LocalMesh>>>,
    scene: Scene,
    drafts: Vec<authored::Draft>,
    /// Primitives without triangles.
    pointless: BTreeSet<(usize, usize)>,
    skinned: usize,
}

impl<'a> Loader<'a> {
    fn new(file: &'a GltfFile, nodes: &'a [PlacedNode<'a>], max_vertices: usize) -> Self {
        let mut scene = Scene::default();
        let document = file.document();
        let used = used_materials(document, nodes);
        let table = material::read(document, file.json(), &used, &mut scene.notes);
        let (local_meshes, drafts, pointless) = Default::default();
        Self { file, nodes, max_vertices, table, local_meshes, scene, drafts, pointless, skinned: 0 }
    }

    fn add_object(&mut self, index: usize, placed: &PlacedNode, mesh: &gltf::Mesh) -> Result<(), Error> {
        let node = &placed.node;
        let request = steering::read(
            self.file.name(),
            self.file.json(),
            node.index(),
            mesh.index(),
            &mut self.scene.notes,
        )?;
        let mut parts = Vec::new();
        for primitive in mesh.primitives() {
            match self.local_mesh(mesh, &primitive)? {
                Some(local) => parts.push((primitive, local)),
                None => _ = self.pointless.insert((mesh.index(), primitive.index())),
            }
        }
        if parts.is_empty() {
            return Ok(());
        }
        if request.volume {
            return self.add_volume(placed, mesh, parts);
        }
        let object = self.scene.objects.len() as u32;
        self.scene.objects.push(Object {
            node: node.index() as u32,
            path: node::path(self.nodes, index),
            world_from_node: placed.world_from_node,
            steering: request.steering,
        });
        let mut draft = request.authored.map(|mode| authored::Draft::new(object, mode));
        for (primitive, local) in parts {
            self.add_part(placed, mesh, &primitive, local, object, draft.as_mut())?;
        }
        self.drafts.extend(draft);
        Ok(())
    }

    /// A mesh that marks a volume: only its boxes stay.
    fn add_volume(
        &mut self,
        placed: &PlacedNode,
        mesh: &gltf::Mesh,
        parts: Vec<(gltf::Primitive, Rc<LocalMesh>)>,
    ) -> Result<(), Error> {
        let mut boxes = Boxes::default();
        for (primitive, local) in parts {
            let (local, skinned) = self.posed(placed, &primitive, local)?;
            let instances = deform::instances(self.file, &placed.node)?;
            for (instance, node_from_instance) in instances.into_iter().enumerate() {
                let world_from_local = placed.world_from_node * node_from_instance;
                let placement = Placement {
                    world_from_local: if skinned { DMat4::IDENTITY } else { world_from_local },
                    mirrored: false,
                    object: 0,
                    mesh: mesh.index() as u32,
                    primitive: primitive.index() as u32,
                    material: 0,
                };
                boxes.add(instance, &geometry::world_positions(&local, &placement, self.file.name())?);
            }
        }
        self.scene.volumes.extend(boxes.finish());
        Ok(())
    }

    /// A primitive in the pose that the file holds, and whether that is in world space already, by a skin.
    fn posed(
        &self,
        placed: &PlacedNode,
        primitive: &gltf::Primitive,
        mut local: Rc<LocalMesh>,
    ) -> Result<(Rc<LocalMesh>, bool), Error> {
        if primitive.morph_targets().len() > 0 {
            deform::morph(self.file, &placed.node, primitive, Rc::make_mut(&mut local))?;
        }
        let skinned = placed.node.skin().is_some()
            && deform::skin(self.file, self.nodes, &placed.node, primitive, Rc::make_mut(&mut local))?;
        Ok((local, skinned))
    }

    fn add_part(
        &mut self,
        placed: &PlacedNode,
        mesh: &gltf::Mesh,
        primitive: &gltf::Primitive,
        local: Rc<LocalMesh>,
        object: u32,
        draft: Option<&mut authored::Draft>,
    ) -> Result<(), Error> {
        let (local, skinned) = self.posed(placed, primitive, local)?;
        self.skinned += usize::from(skinned);

        let last = self.table.materials.len() - 1;
        let material = primitive.material().index().unwrap_or(last) as u32;
        let target = match draft {
            Some(draft) => draft.geometry_for(primitive),
            None => &mut self.scene,
        };
        for node_from_instance in deform::instances(self.file, &placed.node)? {
            let world_from_local = placed.world_from_node * node_from_instance;
            let placement = Placement {
                world_from_local: if skinned { DMat4::IDENTITY } else { world_from_local },
                mirrored: geometry::is_mirrored(world_from_local),
                object,
                mesh: mesh.index() as u32,
                primitive: primitive.index() as u32,
                material,
            };
            let degenerate =
                geometry::place(target, &local, &placement, self.max_vertices, self.file.name())?;
            target.degenerate_triangles += degenerate;
        }
        Ok(())
    }

    /// The primitive in its mesh's space, read when first asked for.
    fn local_mesh(
        &mut self,
        mesh: &gltf::Mesh,
        primitive: &gltf::Primitive,
    ) -> Result<Option<Rc<LocalMesh>>, Error> {
        let key = (mesh.index(), primitive.index());
        if let Some(known) = self.local_meshes.get(&key) {
            return Ok(known.clone());
        }
        let uvs = primitive.material().index().and_then(|index| self.table.uvs.get(index)).copied();
        let local = geometry::read(self.file, primitive, &uvs.unwrap_or_default())?.map(Rc::new);
        self.local_meshes.insert(key, local.clone());
        Ok(local)
    }

    /// The scene without textures, what to decode for it, and the authored meshes.
    fn finish(mut self) -> Result<(Scene, Vec<TextureRequest>, Vec<authored::Draft>), Error> {
        if self.scene.triangles.is_empty() {
            return Err(Error::NoTriangles { file: self.file.name().to_owned(), reason: self.why_empty() });
        }
        let extent_m = self.scene.bounds().map_or(0.0, |[low, high]| (high - low).max_element());
        if extent_m < geometry::NARROWEST {
            return Err(Error::TooSmall { file: self.file.name().to_owned(), extent_m });
        }
        self.add_notes();
        self.scene.materials = self.table.materials;
        Ok((self.scene, self.table.requests, self.drafts))
    }

    fn why_empty(&self) -> &'static str {
        if self.scene.degenerate_triangles > 0 {
            "none of its triangles has an area; check its positions, and the scale of its nodes"
        } else if !self.scene.volumes.is_empty() {
            "all its meshes are volumes for moving objects or authored VLMs; export the visible surfaces along with them"
        } else if !self.drafts.is_empty() {
            "all its meshes are named as authored VLMs; export the visible surfaces along with them"
        } else if !self.pointless.is_empty() {
            "it draws points or lines only, or meshes without positions; convert them to surfaces"
        } else if self.file.document().meshes().len() == 0 {
            "it holds no mesh; check what was exported"
        } else if self.file.document().nodes().all(|node| node.mesh().is_none()) {
            "no node places any of its meshes; check what was exported"
        } else {
            "none of its meshes is in the scene that is drawn; check which scene is the file's default, and which nodes are hidden"
        }
    }

    fn add_notes(&mut self) {
        let notes = &mut self.scene.notes;
        let document = self.file.document();
        if document.scenes().len() > 1 {
            let drawn = document.default_scene().map_or(0, |scene| scene.index());
            notes.push(format!(
                "/scenes/{drawn}: drawn; the file's {} other scenes are not",
                document.scenes().len() - 1
            ));
        }
        for (mesh, primitive) in &self.pointless {
            notes.push(format!("/meshes/{mesh}/primitives/{primitive}: points or lines; left out"));
        }
        if self.skinned > 0 {
            notes.push(format!(
                "{} skinned primitives keep the pose that their joints hold in the file",
                self.skinned
            ));
        }
        if self.scene.degenerate_triangles > 0 {
            notes.push(format!("{} triangles without area left out", self.scene.degenerate_triangles));
        }
    }
}

/// For each of the file's materials, whether a drawn node has it.
fn used_materials(document: &gltf::Document, nodes: &[PlacedNode]) -> Vec<bool> {
    let mut used = vec![false; document.materials().len()];
    for primitive in nodes.iter().filter_map(|placed| placed.node.mesh()).flat_map(|mesh| mesh.primitives()) {
        if let Some(used) = primitive.material().index().and_then(|index| used.get_mut(index)) {
            *used = true;
        }
    }
    used
}

//! Meshes that artists made to be VLMs: their lights' colour, and the space that they take lights away from.

use super::{AuthoredMesh, AuthoredMode, Scene};
use glam::{DVec3, Vec3};
use std::collections::BTreeMap;
use std::f32::consts::PI;
use std::f64::consts::TAU;

/// An authored mesh before the textures are decoded.
pub(super) struct Draft {
    object: u32,
    mode: AuthoredMode,
    /// Only its geometry is filled in.
    geometry: Scene,
    has_material: bool,
}

impl Draft {
    pub fn new(object: u32, mode: AuthoredMode) -> Self {
        Self { object, mode, geometry: Scene::default(), has_material: false }
    }

    /// Where to put this primitive's triangles.
    pub fn geometry_for(&mut self, primitive: &gltf::Primitive) -> &mut Scene {
        self.has_material |= primitive.material().index().is_some();
        &mut self.geometry
    }
}

/// Colours the drafts with the scene's materials and textures.
pub(super) fn finish(scene: &mut Scene, drafts: Vec<Draft>) -> Vec<AuthoredMesh> {
    drafts.into_iter().map(|draft| color(scene, draft)).collect()
}

fn color(scene: &mut Scene, mut draft: Draft) -> AuthoredMesh {
    // Lent, not copied: textures are large.
    draft.geometry.materials = std::mem::take(&mut scene.materials);
    draft.geometry.textures = std::mem::take(&mut scene.textures);
    let surfaces = draft.geometry.triangle_surfaces();
    scene.materials = std::mem::take(&mut draft.geometry.materials);
    scene.textures = std::mem::take(&mut draft.geometry.textures);

    let albedo = draft.has_material.then(|| surfaces.iter().map(|surface| surface.reflectance()).collect());
    AuthoredMesh {
        object: draft.object,
        mode: draft.mode,
        positions: draft.geometry.positions,
        triangles: draft.geometry.triangles,
        albedo,
        // Radiosity of a Lambertian emitter: pi times its radiance.
        emission: surfaces.iter().map(|surface| PI * surface.emission * surface.coverage).collect(),
    }
}

/// The space that an authored mesh takes lights away from: its inside if it is closed, else its bounding box.
#[derive(Clone, Debug)]
pub struct Volume {
    minimum: DVec3,
    maximum: DVec3,
    /// Empty for an open mesh.
    closed: Vec<[DVec3; 3]>,
}

impl Volume {
    /// The space of a mesh; empty if it has no triangle.
    #[must_use]
    pub fn of(mesh: &AuthoredMesh) -> Self {
        let corner = |v: u32| mesh.positions.get(v as usize).copied().unwrap_or_default();
        let triangles: Vec<[Vec3; 3]> = mesh.triangles.iter().map(|triangle| triangle.map(corner)).collect();
        let corners = || triangles.iter().flatten();
        Self {
            minimum: corners().fold(Vec3::INFINITY, |least, &p| least.min(p)).as_dvec3(),
            maximum: corners().fold(Vec3::NEG_INFINITY, |most, &p| most.max(p)).as_dvec3(),
            closed: if is_closed(&triangles) {
                triangles.iter().map(|triangle| triangle.map(|p| p.as_dvec3())).collect()
            } else {
                Vec::new()
            },
        }
    }

    /// True if the point (world space, metres) lies inside.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        let point = point.as_dvec3();
        let in_box = point.cmpge(self.minimum).all() && point.cmple(self.maximum).all();
        in_box && (self.closed.is_empty() || self.winding_number(point).abs() > 0.5)
    }

    /// How often the mesh winds around a point: the solid angles of its triangles (van Oosterom and Strackee, "The solid
    /// angle of a plane triangle", 1983, equation 8), summed and divided by those of a whole sphere.
    fn winding_number(&self, point: DVec3) -> f64 {
        let half_angle = |corners: &[DVec3; 3]| {
            let [a, b, c] = corners.map(|corner| corner - point);
            let [la, lb, lc] = [a, b, c].map(|r| r.length());
            let numerator = a.dot(b.cross(c));
            let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            numerator.atan2(denominator)
        };
        self.closed.iter().map(half_angle).sum::<f64>() / TAU
    }
}

/// Every edge is used as often in one direction as in the other; vertices are the same where their positions are.
fn is_closed(triangles: &[[Vec3; 3]]) -> bool {
    // Adding 0 turns -0 into 0.
    let key = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut balance: BTreeMap<_, i32> = BTreeMap::new();
    for &[a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)].map(|(p, q)| (key(p), key(q))) {
            *balance.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
        }
    }
    !balance.is_empty() && balance.values().all(|&uses| uses == 0)
}

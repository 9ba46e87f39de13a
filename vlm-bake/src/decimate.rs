//! Stage 3: few triangles that follow the surface, one budget for the whole scene.
//!
//! This work is based on: Michael Garland, Paul Heckbert, "Surface simplification using quadric error metrics" (1997), as
//! implemented by meshoptimizer. Coplanar triangles are then merged and triangulated again (`planar`), so that a flat wall costs
//! few, well-shaped lights.

use glam::DVec3;
use meshopt::SimplifyOptions;
use rustc_hash::FxHashMap;

use crate::correspondence::Light;
use crate::options::BakeOptions;
use crate::patches::Patches;
use crate::planar::merge_coplanar;
use crate::slivers::remove_slivers;
use crate::topology::{area, cross_of};

/// Decimation takes more faces than its share of the budget rather than exceed this error (a share of the extent): lights on a
/// surface that is no longer there come out of thin objects. Higher values keep more of the budget for dividing large lights.
const COSTLY_ERROR: f32 = 2e-3;

/// The share of the budget that decimation may take then.
const MOST_SHARE: f64 = 0.85;

/// A triangle mesh between decimation and the final lights, in world space.
#[derive(Clone, Debug, Default)]
pub struct LightMesh {
    /// Vertices in metres; shared by the faces of one object that meet there.
    pub positions: Vec<DVec3>,
    /// The triangles.
    pub faces: Vec<Face>,
}

/// A triangle of a [`LightMesh`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// Indices into the mesh's positions, counter-clockwise seen from the emitting side.
    pub vertices: [u32; 3],
    /// Index into [`Patches::regions`].
    pub region: u32,
    /// The back of a two-sided surface.
    pub back: bool,
    /// The face of the decimated mesh of which this is a part: itself until it is refined.
    pub coarse: u32,
}

impl LightMesh {
    /// The corners of a face.
    #[must_use]
    pub fn corners(&self, face: usize) -> [DVec3; 3] {
        self.faces[face].vertices.map(|v| self.positions[v as usize])
    }

    /// The faces as lights.
    #[must_use]
    pub fn lights(&self) -> Vec<Light> {
        let light = |(f, face): (usize, &Face)| Light {
            corners: self.corners(f),
            region: face.region,
            back: face.back,
        };
        self.faces.iter().enumerate().map(light).collect()
    }

    /// Area of a face in square metres.
    #[must_use]
    pub fn area(&self, face: usize) -> f64 {
        area(self.corners(face))
    }

    /// Unit normal of a face on its emitting side; zero for a face without area.
    #[must_use]
    pub fn normal(&self, face: usize) -> DVec3 {
        cross_of(self.corners(face)).normalize_or_zero()
    }
}

/// What decimation reached.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Decimation {
    /// Faces asked for; both sides of two-sided surfaces count.
    pub asked: usize,
    /// Faces after merging, likewise.
    pub reached: usize,
    /// The simplifier's error (root of the mean squared distance at the worst collapse) in metres.
    pub error_m: f64,
}

/// Decimates the patches to at most the surface's share of the budget, where topology allows it.
#[must_use]
pub fn decimate(patches: &Patches, options: &BakeOptions) -> (LightMesh, Decimation) {
    let asked = (f64::from(options.lights) * options.surface_share) as usize;
    let most = (f64::from(options.lights) * MOST_SHARE) as usize;
    let input = SimplifierInput::new(patches);
    let doubled = patches.triangles.len()
        + (0..patches.triangles.len()).filter(|&t| patches.region(t).two_sided).count();
    let fronts = |faces: usize| faces * patches.triangles.len() / doubled.max(1);
    let (indices, error_m) = input.simplify(fronts(asked), fronts(most), options.free_error as f32);
    let mut mesh = merge_coplanar(input.mesh(patches, &indices));
    remove_slivers(&mut mesh);
    add_backs(&mut mesh, patches);
    let reached = mesh.faces.len();
    (mesh, Decimation { asked, reached, error_m })
}

/// The patches as the simplifier wants them: one vertex per place *and region*, so that borders of regions are seams to it.
struct SimplifierInput {
    positions: Vec<[f32; 3]>,
    indices: Vec<u32>,
    vertex_welded: Vec<u32>,
    vertex_region: Vec<u32>,
}

impl SimplifierInput {
    fn new(patches: &Patches) -> Self {
        // Relative to the first vertex, so that f32 keeps its digits in scenes far from the origin; and each object at a
        // distance of its own, since the simplifier takes equal positions for one vertex, and objects that touch (kits of
        // tiles) would lock each other's borders.
        let origin = patches.positions.first().copied().unwrap_or_default();
        let extent = patches.positions.iter().fold(0.0f64, |e, p| e.max((p - origin).abs().max_element()));
        let mut input = Self {
            positions: Vec::new(),
            indices: Vec::with_capacity(patches.triangles.len() * 3),
            vertex_welded: Vec::new(),
            vertex_region: Vec::new(),
        };
        let mut vertex_of: FxHashMap<(u32, u32), u32> = FxHashMap::default();
        for (corners, &region) in patches.triangles.iter().zip(&patches.triangle_region) {
            for &welded in corners {
                let vertex = *vertex_of.entry((welded, region)).or_insert_with(|| {
                    let place = patches.positions[welded as usize] - origin
                        + apart(patches.vertex_object[welded as usize], extent);
                    input.positions.push(place.as_vec3().to_array());
                    input.vertex_welded.push(welded);
                    input.vertex_region.push(region);
                    input.positions.len() as u32 - 1
                });
                input.indices.push(vertex);
            }
        }
        input
    }

    /// Indices of about `target` triangles: fewer where that costs no more than `free_error` (a share of the extent), more where
    /// fewer would cost more than [`COSTLY_ERROR`], but at most `most` if topology allows; with the error in metres.
    fn simplify(&self, target: usize, most: usize, free_error: f32) -> (Vec<u32>, f64) {
        if self.indices.is_empty() {
            return (Vec::new(), 0.0);
        }
        let scale = f64::from(meshopt::simplify_scale_decoder(&self.positions));
        let run = |indices: &[u32], target: usize, limit: f32, options: SimplifyOptions| {
            let mut error = 0.0;
            let target = (target * 3).min(indices.len());
            let shorter =
                meshopt::simplify_decoder(indices, &self.positions, target, limit, options, Some(&mut error));
            (shorter, error)
        };
        let (mut indices, mut error) = run(&self.indices, 0, free_error, SimplifyOptions::RegularizeLight);
        let pruning = SimplifyOptions::RegularizeLight | SimplifyOptions::Prune;
        for (target, limit, options) in [
            (target, COSTLY_ERROR, pruning),
            (most, 8.0 * COSTLY_ERROR, pruning),
            (most, f32::MAX, SimplifyOptions::RegularizeLight),
        ] {
            if indices.len() > target * 3 {
                let (shorter, further) = run(&indices, target, limit, options);
                (indices, error) = (shorter, error.max(further));
            }
        }
        // Only a budget that the topology does not allow removes large islands, and only while enough of the surface stays.
        if indices.len() > most * 3 + most / 8 {
            let (shorter, further) = run(&indices, most, f32::MAX, pruning);
            if 2 * shorter.len() > most * 3 {
                (indices, error) = (shorter, error.max(further));
            }
        }
        (indices, f64::from(error) * scale)
    }

    /// The welded mesh of a list of the simplifier's indices.
    fn mesh(&self, patches: &Patches, indices: &[u32]) -> LightMesh {
        let faces = indices
            .chunks_exact(3)
            .map(|corners| Face {
                vertices: [0, 1, 2].map(|i| self.vertex_welded[corners[i] as usize]),
                region: self.vertex_region[corners[0] as usize],
                back: false,
                coarse: 0,
            })
            .filter(|f| {
                f.vertices[0] != f.vertices[1]
                    && f.vertices[1] != f.vertices[2]
                    && f.vertices[2] != f.vertices[0]
            })
            .collect();
        LightMesh { positions: patches.positions.clone(), faces }
    }
}

/// A shift for an object, different for each and unlikely to make places of two objects meet, at most as long as the scene.
fn apart(object: u32, extent: f64) -> DVec3 {
    DVec3::new(0.754_877_666, 0.569_840_290, 0.430_159_709)
        .map(|step| (f64::from(object) * step).fract() * extent)
}

/// Gives two-sided surfaces a second sheet of faces with vertices of its own, turned round.
fn add_backs(mesh: &mut LightMesh, patches: &Patches) {
    let mut back_of: FxHashMap<u32, u32> = FxHashMap::default();
    for f in 0..mesh.faces.len() {
        let face = mesh.faces[f];
        if patches.regions[face.region as usize].two_sided {
            let [a, b, c] = face.vertices.map(|v| {
                *back_of.entry(v).or_insert_with(|| {
                    mesh.positions.push(mesh.positions[v as usize]);
                    mesh.positions.len() as u32 - 1
                })
            });
            mesh.faces.push(Face { vertices: [a, c, b], back: true, ..face });
        }
    }
}

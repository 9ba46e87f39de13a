//! On which side of its own island a point lies, and how far from it.
//!
//! The sign is that of the angle-weighted pseudonormal at the nearest feature, face, edge or vertex (J. Andreas Baerentzen, Henrik
//! Aanaes, "Signed distance computation using the angle weighted pseudonormal", 2005): a face's own normal misjudges
//! points that lie nearest to an edge.

use std::f64::consts::PI;

use glam::DVec3;

use crate::grouped_bvh::GroupedBvh;
use crate::patches::Patches;
use crate::surface::SurfacePoint;
use crate::topology::{barycentric, cross_of, edge_uses, edges};

/// A nearest point belongs to an edge or vertex if its barycentric weights come this close to it. Higher values take
/// points beside an edge for points on it, which costs accuracy only where the two faces differ much.
const ON_FEATURE: f64 = 1e-4;

/// Signed distances to the islands of the visible surface.
pub struct IslandDistance<'a> {
    patches: &'a Patches,
    islands: GroupedBvh,
    normals: Vec<DVec3>,
    vertex_normals: Vec<DVec3>,
    edge_normals: Vec<[DVec3; 3]>,
}

/// The nearest place of an island.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedNear {
    /// Metres; negative behind the surface.
    pub signed: f64,
    /// Unit pseudonormal of the nearest feature.
    pub normal: DVec3,
    /// The triangle on which it lies, an index into the patches'.
    pub triangle: u32,
}

impl<'a> IslandDistance<'a> {
    /// Prepares the queries.
    #[must_use]
    pub fn new(patches: &'a Patches) -> Self {
        let island = |t: usize| patches.region(t).island;
        let islands =
            GroupedBvh::new(&patches.positions, &patches.triangles, island, patches.islands as usize);
        let normals: Vec<DVec3> =
            (0..patches.triangles.len()).map(|t| cross_of(patches.corners(t)).normalize_or_zero()).collect();
        let vertex_normals = vertex_normals(patches, &normals);
        let edge_normals = edge_normals(patches, &normals);
        Self { patches, islands, normals, vertex_normals, edge_normals }
    }

    /// The nearest place of an island to `p`; `None` if the island has no triangle.
    #[must_use]
    pub fn at(&self, p: DVec3, island: u32) -> Option<SignedNear> {
        let local = p - self.islands.origin();
        let near = self.islands.closest(island, p, f64::INFINITY, |_| true)?;
        let nearest = near.point.as_dvec3();
        let normal = self.normal_at(near.triangle, nearest)?;
        let away = local - nearest;
        // On the surface itself, where rounding hides the side, the height over the plane is the distance.
        let height = away.dot(normal);
        Some(SignedNear { signed: away.length().copysign(height), normal, triangle: near.triangle })
    }

    /// The point of an island nearest to `p` on a triangle whose normal is within that cosine of `normal`.
    #[must_use]
    pub fn alike(&self, p: DVec3, island: u32, normal: DVec3, cosine: f64) -> Option<SurfacePoint> {
        let alike = |t: u32| self.normals[t as usize].dot(normal) > cosine;
        let near = self.islands.closest(island, p, f64::INFINITY, alike)?;
        let corners = self.patches.corners(near.triangle as usize);
        let position = near.point.as_dvec3() + self.islands.origin();
        Some(SurfacePoint {
            position,
            inner: position,
            normal: self.normals[near.triangle as usize],
            triangle: near.triangle,
            barycentric: barycentric(corners, position).as_vec3(),
            area: 0.0,
            back: false,
        })
    }

    /// The pseudonormal of the feature of a triangle on which a point lies.
    fn normal_at(&self, triangle: u32, local: DVec3) -> Option<DVec3> {
        let t = triangle as usize;
        let [a, b, c] = self.patches.corners(t).map(|p| p - self.islands.origin());
        let n = (b - a).cross(c - a);
        let beside = |from: DVec3, to: DVec3| {
            (to - from).cross(local - from).dot(n) <= ON_FEATURE * n.length_squared()
        };
        // Zero weight of corner 0 means: on the edge opposite to it, and so on.
        let zero = [beside(b, c), beside(c, a), beside(a, b)];
        let feature = match zero {
            [_, true, true] => self.vertex_normals[self.patches.triangles[t][0] as usize],
            [true, _, true] => self.vertex_normals[self.patches.triangles[t][1] as usize],
            [true, true, _] => self.vertex_normals[self.patches.triangles[t][2] as usize],
            [false, false, true] => self.edge_normals[t][0],
            [true, false, false] => self.edge_normals[t][1],
            [false, true, false] => self.edge_normals[t][2],
            _ => n,
        };
        feature.try_normalize().or_else(|| n.try_normalize())
    }
}

/// Sum of the normals at each vertex, weighted by the faces' angles.
fn vertex_normals(patches: &Patches, normals: &[DVec3]) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; patches.positions.len()];
    for (t, v) in patches.triangles.iter().enumerate() {
        let p = patches.corners(t);
        for i in 0..3 {
            let (to_next, to_last) = (p[(i + 1) % 3] - p[i], p[(i + 2) % 3] - p[i]);
            let scale = (to_next.length_squared() * to_last.length_squared()).sqrt();
            let cosine = if scale > 0.0 { to_next.dot(to_last) / scale } else { 1.0 };
            sums[v[i] as usize] += normals[t] * cosine.clamp(-1.0, 1.0).acos() / PI;
        }
    }
    sums
}

/// Sum of the normals at each side of each triangle.
fn edge_normals(patches: &Patches, normals: &[DVec3]) -> Vec<[DVec3; 3]> {
    let mut sums = vec![[DVec3::ZERO; 3]; patches.triangles.len()];
    for edge in edges(&edge_uses(&patches.triangles)) {
        let sum = edge.iter().map(|u| normals[u.triangle as usize]).sum();
        for u in edge {
            sums[u.triangle as usize][usize::from(u.side)] = sum;
        }
    }
    sums
}

//! Rays against four triangles at a time.
//!
//! Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", 2013: the space is sheared so that the ray runs along
//! one axis; three 2D edge functions then tell whether it passes inside. The edge function of an edge is exactly the
//! negative of that of the edge run backward, so a ray never slips through the edge that two triangles share. Instead
//! of the paper's fallback to double precision, an edge function of zero counts as inside for both.

use glam::{BVec4A, Vec3, Vec4};

/// Triangles in a pack.
pub const LANES: usize = 4;

/// Four triangles by coordinate: `corners[corner][axis]` holds one lane per triangle, metres.
#[derive(Clone, Copy, Debug)]
pub struct TrianglePack {
    corners: [[Vec4; 3]; 3],
}

/// A ray, with the shear that lays its direction along the axis in which it is longest.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    origin: [f32; 3],
    /// Axes in the order in which the sheared space calls them x, y, z; z is the longest, handedness is kept.
    axes: [usize; 3],
    shear: [f32; 3],
}

/// Where a ray meets the triangles of a pack. Lanes without a hit hold numbers without meaning.
#[derive(Clone, Copy, Debug)]
pub struct PackHit {
    /// Lanes that are hit in front of the origin.
    pub mask: BVec4A,
    /// In multiples of the ray's direction.
    pub distance: Vec4,
    /// Positive on the counter-clockwise side.
    pub determinant: Vec4,
    /// Weights of the three corners, times the determinant.
    pub weights: [Vec4; 3],
}

impl TrianglePack {
    /// Packs up to [`LANES`] triangles; lanes left over are triangles without area, which nothing hits.
    #[must_use]
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        let lane = |i: usize, corner: usize, axis: usize| triangles.get(i).map_or(0.0, |t| t[corner][axis]);
        let coordinates = |corner, axis| Vec4::from_array(std::array::from_fn(|i| lane(i, corner, axis)));
        Self { corners: std::array::from_fn(|corner| std::array::from_fn(|axis| coordinates(corner, axis))) }
    }

    /// Tests all four triangles, whichever side they show.
    #[must_use]
    #[inline]
    pub fn intersect(&self, ray: &ShearedRay) -> PackHit {
        let [a, b, c] = &self.corners;
        let (a, b, c) = (ray.to_sheared(a), ray.to_sheared(b), ray.to_sheared(c));
        let u = c.x * b.y - c.y * b.x;
        let v = a.x * c.y - a.y * c.x;
        let w = b.x * a.y - b.y * a.x;
        let determinant = u + v + w;
        let outside = (u.min(v).min(w)).cmplt(Vec4::ZERO) & (u.max(v).max(w)).cmpgt(Vec4::ZERO);
        let distance = (u * a.z + v * b.z + w * c.z) / determinant;
        // Zero determinants make the distance NaN or infinite, and so fail a comparison.
        let ahead = distance.cmpgt(Vec4::ZERO) & distance.cmplt(Vec4::INFINITY);
        PackHit { mask: ahead & !outside, distance, determinant, weights: [u, v, w] }
    }
}

/// One corner of each triangle of a pack, relative to the ray.
#[derive(Clone, Copy)]
struct Sheared {
    x: Vec4,
    y: Vec4,
    /// Distance along the ray, in multiples of its direction.
    z: Vec4,
}

impl ShearedRay {
    /// `direction` must not be zero.
    #[must_use]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let z = direction.abs().max_position();
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let axes = if direction[z] < 0.0 { [y, x, z] } else { [x, y, z] };
        let along = direction[z];
        let shear = [direction[axes[0]] / along, direction[axes[1]] / along, 1.0 / along];
        Self { origin: origin.to_array(), axes, shear }
    }

    #[inline]
    fn to_sheared(&self, corner: &[Vec4; 3]) -> Sheared {
        let [x, y, z] = self.axes;
        let (x, y, z) = (corner[x] - self.origin[x], corner[y] - self.origin[y], corner[z] - self.origin[z]);
        let [shear_x, shear_y, shear_z] = self.shear;
        Sheared { x: x - shear_x * z, y: y - shear_y * z, z: shear_z * z }
    }
}

impl PackHit {
    /// Weights of the corners of one lane's hit; they sum to 1.
    #[must_use]
    pub fn barycentric(&self, lane: usize) -> Vec3 {
        Vec3::from_array(self.weights.map(|weight| weight[lane])) / self.determinant[lane]
    }
}

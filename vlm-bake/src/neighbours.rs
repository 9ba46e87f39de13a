//! The surface around a triangle.

use crate::patches::Patches;
use crate::topology::{cross_of, edge_uses, edges};

/// Neighbours whose normals differ by less than this cosine go on in the same plane, nearly.
const SMOOTH_COSINE: f64 = 0.9;

/// Which triangles go on smoothly into which others.
pub struct SmoothNeighbours {
    /// Pairs of triangles, ascending; each pair both ways.
    pairs: Vec<(u32, u32)>,
}

impl SmoothNeighbours {
    /// Looks at every edge that triangles share.
    #[must_use]
    pub fn new(patches: &Patches) -> Self {
        let normal = |t: u32| cross_of(patches.corners(t as usize)).normalize_or_zero();
        let mut pairs = Vec::new();
        for edge in edges(&edge_uses(&patches.triangles)) {
            for pair in edge.windows(2) {
                let (a, b) = (pair[0].triangle, pair[1].triangle);
                if normal(a).dot(normal(b)).abs() > SMOOTH_COSINE {
                    pairs.extend([(a, b), (b, a)]);
                }
            }
        }
        pairs.sort_unstable();
        Self { pairs }
    }

    /// Adds the smooth neighbours of triangles. A light in the plane of its surface lies in theirs too, where rounding decides whether it
    /// lights them.
    pub fn widen(&self, triangles: &mut Vec<u32>) {
        let own = triangles.len();
        for i in 0..own {
            let t = triangles[i];
            let first = self.pairs.partition_point(|&(a, _)| a < t);
            triangles.extend(self.pairs[first..].iter().take_while(|&&(a, _)| a == t).map(|&(_, b)| b));
        }
        triangles.sort_unstable();
        triangles.dedup();
    }
}

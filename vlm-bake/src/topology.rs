//! Who shares an edge with whom.

use rayon::prelude::*;

/// One use of an edge by a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct EdgeUse {
    /// The lower vertex of the edge.
    pub low: u32,
    /// The higher vertex of the edge.
    pub high: u32,
    /// The triangle.
    pub triangle: u32,
    /// Which of its edges: 0 is `[v0, v1]`, 1 is `[v1, v2]`, 2 is `[v2, v0]`.
    pub side: u8,
}

/// All uses of edges, sorted so that the uses of one edge stand together.
#[must_use]
pub fn edge_uses(triangles: &[[u32; 3]]) -> Vec<EdgeUse> {
    let mut uses: Vec<EdgeUse> = triangles
        .par_iter()
        .enumerate()
        .flat_map_iter(|(triangle, v)| {
            (0..3u8).map(move |side| {
                let (a, b) = (v[usize::from(side)], v[(usize::from(side) + 1) % 3]);
                EdgeUse { low: a.min(b), high: a.max(b), triangle: triangle as u32, side }
            })
        })
        .collect();
    uses.par_sort_unstable();
    uses
}

/// The uses of each edge in turn.
pub fn edges(uses: &[EdgeUse]) -> impl Iterator<Item = &[EdgeUse]> {
    uses.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high))
}

/// Twice the area of a triangle, as the vector along its normal.
#[must_use]
pub fn cross_of(p: [glam::DVec3; 3]) -> glam::DVec3 {
    (p[1] - p[0]).cross(p[2] - p[0])
}

/// Area of a triangle.
#[must_use]
pub fn area(p: [glam::DVec3; 3]) -> f64 {
    0.5 * cross_of(p).length()
}

/// Length of the longest edge of a triangle.
#[must_use]
pub fn longest_edge(p: [glam::DVec3; 3]) -> f64 {
    (0..3).map(|i| p[i].distance_squared(p[(i + 1) % 3])).fold(0.0, f64::max).sqrt()
}

/// Longest edge over the height that stands on it; infinite for a triangle without area.
#[must_use]
pub fn aspect_ratio(p: [glam::DVec3; 3]) -> f64 {
    let longest = (0..3).map(|i| p[i].distance_squared(p[(i + 1) % 3])).fold(0.0, f64::max);
    let doubled_area = cross_of(p).length();
    if doubled_area > 0.0 { longest / doubled_area } else { f64::INFINITY }
}

/// Lists of numbers, one after the other in one array: counted, then filled.
#[derive(Clone, Debug, Default)]
pub struct Lists {
    /// One more than there are lists: where each begins in `items`, and the end of the last.
    pub starts: Vec<u32>,
    /// The lists.
    pub items: Vec<u32>,
}

impl Lists {
    /// Puts the item of each `(list, item)` into its list, below `count`; items keep their order.
    #[must_use]
    pub fn new(count: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let mut starts = vec![0u32; count + 1];
        for (list, _) in pairs.clone() {
            starts[list as usize + 1] += 1;
        }
        for list in 0..count {
            starts[list + 1] += starts[list];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts[count] as usize];
        for (list, item) in pairs {
            let slot = &mut next[list as usize];
            items[*slot as usize] = item;
            *slot += 1;
        }
        Self { starts, items }
    }

    /// One of the lists.
    #[must_use]
    pub fn of(&self, list: usize) -> &[u32] {
        &self.items[self.starts[list] as usize..self.starts[list + 1] as usize]
    }
}

/// Barycentric weights of a point in the plane of a triangle; a third each where it has no area.
#[must_use]
pub fn barycentric([a, b, c]: [glam::DVec3; 3], p: glam::DVec3) -> glam::DVec3 {
    let normal = (b - a).cross(c - a);
    let weigh = |from: glam::DVec3, to: glam::DVec3| {
        (to - from).cross(p - from).dot(normal) / normal.length_squared()
    };
    let weights = glam::DVec3::new(weigh(b, c), weigh(c, a), weigh(a, b));
    if weights.is_finite() { weights } else { glam::DVec3::splat(1.0 / 3.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn a_quad_has_one_shared_edge() {
        let uses = edge_uses(&[[0, 1, 2], [0, 2, 3]]);
        let shared: Vec<_> = edges(&uses).filter(|uses| uses.len() == 2).collect();
        assert_eq!(shared.len(), 1);
        assert_eq!((shared[0][0].low, shared[0][0].high), (0, 2));
        assert_eq!(edges(&uses).count(), 5);
    }

    #[test]
    fn items_keep_their_order_within_their_lists() {
        let lists = Lists::new(3, [(2, 7), (0, 8), (2, 5)].into_iter());
        assert_eq!([0, 1, 2].map(|list| lists.of(list).to_vec()), [vec![8], vec![], vec![7, 5]]);
    }

    #[test]
    fn aspect_of_known_triangles() {
        let right = [dvec3(0.0, 0.0, 0.0), dvec3(1.0, 0.0, 0.0), dvec3(0.0, 1.0, 0.0)];
        assert!((aspect_ratio(right) - 2.0).abs() < 1e-12);
        let needle = [dvec3(0.0, 0.0, 0.0), dvec3(10.0, 0.0, 0.0), dvec3(5.0, 0.1, 0.0)];
        assert!((aspect_ratio(needle) - 100.0).abs() < 1e-9);
        assert_eq!(aspect_ratio([dvec3(0.0, 0.0, 0.0); 3]), f64::INFINITY);
    }
}

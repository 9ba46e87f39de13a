//! One small tree per group of triangles, for nearest-point queries within a group.
//!
//! One tree over everything with a filter would do, but slowly: where a point is nearer to thousands of foreign triangles than
//! to its own group (a column among ornaments), each of them would be looked at and turned down.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::bvh::{Bvh, Hit, Nearest};

/// Trees over the triangles of each group, relative to a common origin, so that single precision keeps its digits far from
/// the world's.
pub struct GroupedBvh {
    origin: DVec3,
    groups: Vec<(Bvh, Vec<u32>)>,
}

impl GroupedBvh {
    /// Builds the trees. `group_of` tells the group of each triangle, below `group_count`.
    #[must_use]
    pub fn new(
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        group_of: impl Fn(usize) -> u32,
        group_count: usize,
    ) -> Self {
        let origin = positions.first().copied().unwrap_or_default();
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); group_count];
        for t in 0..triangles.len() {
            members[group_of(t) as usize].push(t as u32);
        }
        let tree = |members: Vec<u32>| {
            // Only the group's own vertices: a tree's precision and cost follow what it is given.
            let corners = members.iter().flat_map(|&t| triangles[t as usize]);
            let local: Vec<Vec3> = corners.map(|v| (positions[v as usize] - origin).as_vec3()).collect();
            let indices: Vec<[u32; 3]> =
                (0..members.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            (Bvh::new(&local, &indices), members)
        };
        Self { origin, groups: members.into_par_iter().map(tree).collect() }
    }

    /// The point nearest to `p` on the triangles of a group that `accept` lets through, within `max_distance` metres. The
    /// answer's point is relative to [`GroupedBvh::origin`].
    #[must_use]
    pub fn closest(
        &self,
        group: u32,
        p: DVec3,
        max_distance: f64,
        accept: impl Fn(u32) -> bool,
    ) -> Option<Nearest> {
        let (bvh, members) = self.groups.get(group as usize)?;
        let local = (p - self.origin).as_vec3();
        let near = bvh.closest(local, max_distance as f32, |i| accept(members[i as usize]))?;
        Some(Nearest { triangle: members[near.triangle as usize], ..near })
    }

    /// The triangle of a group that a ray from `p` along `direction` (unit) meets first, among those that `accept` lets through, within
    /// `max_distance` metres; with the distance.
    #[must_use]
    pub fn hit(
        &self,
        group: u32,
        p: DVec3,
        direction: DVec3,
        max_distance: f64,
        accept: impl Fn(u32) -> bool,
    ) -> Option<(u32, f64)> {
        let (bvh, members) = self.groups.get(group as usize)?;
        let local = (p - self.origin).as_vec3();
        let accept = |hit: &Hit| accept(members[hit.triangle as usize]);
        let hit = bvh.hit_where(local, direction.as_vec3(), max_distance as f32, accept)?;
        Some((members[hit.triangle as usize], f64::from(hit.distance)))
    }

    /// What the points of answers are relative to.
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }
}

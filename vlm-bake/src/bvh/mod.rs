//! Ray and nearest-point queries on a set of triangles.
//!
//! The tree is obvhs' binary BVH: parallel locally-ordered clustering (Meister and Bittner 2018), improved by parallel
//! reinsertion (Meister and Bittner 2018).
//! Answers do not depend on the tree's shape, and so not on the number of threads that built it: ties go to the
//! triangle of the lowest index, and the boxes are padded so that rounding never culls a hit.

pub mod pack;
pub mod nearest;

use glam::{Vec3, Vec3A};
use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, leaf_collapser::collapse, node::Bvh2Node, reinsertion::ReinsertionOptimizer},
    fast_stack,
    faststack::FastStack,
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
    ray::{Ray, RayHit},
};

use pack::{LANES, ShearedRay, TrianglePack};

/// Boxes grow by this share of the largest coordinate, 4 ulp: slab tests err by less.
const BOX_PADDING: f32 = 4.0 * f32::EPSILON;

/// Rays leave a surface from this share of the largest coordinate (64 ulp) in front of it. Smaller values let rays
/// hit the surface that they start on; larger ones let them skip what lies closer to it (8 um at 1 m).
const LEAVE_SURFACE: f32 = 64.0 * f32::EPSILON;

/// A bounding volume hierarchy over triangles.
#[derive(Clone, Default)]
pub struct Bvh {
    tree: Bvh2,
    /// The triangles of each leaf, by fours: a leaf's packs are `meta1..meta1 + meta2` of its node.
    packs: Vec<TrianglePack>,
    /// Corners of the triangles in the order of the tree's leaves.
    corners: Vec<[Vec3A; 3]>,
    /// The caller's index of each triangle, in the same order.
    triangle_of_slot: Vec<u32>,
    /// Distance by which rays leave a surface, metres.
    leave_distance: f32,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index into the triangles that the tree was built from.
    pub triangle: u32,
    /// In multiples of the ray's direction: metres if that is a unit vector.
    pub distance: f32,
    /// Weights of the three corners; they sum to 1.
    pub barycentric: Vec3,
    /// True if the ray meets the counter-clockwise side.
    pub front: bool,
}

/// The point of a triangle set that is nearest to a query point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Index into the triangles that the tree was built from.
    pub triangle: u32,
    /// The nearest point, on the triangle.
    pub point: Vec3,
    /// Metres.
    pub distance: f32,
}

/// A tree for other devices to walk without a stack: a node is followed by what is in it, and knows what follows that.
#[derive(Clone, Debug, Default)]
pub struct FlatBvh {
    /// Inner nodes and leaves, depth first.
    pub nodes: Vec<FlatNode>,
    /// Corners of the triangles in the order in which leaves count them, metres.
    pub corners: Vec<[Vec3; 3]>,
    /// As [`Bvh::leave_distance`].
    pub leave_distance: f32,
}

/// A node of a [`FlatBvh`]. 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FlatNode {
    /// Least corner of the box around it, metres.
    pub least: Vec3,
    /// Triangles of a leaf; 0 for an inner node.
    pub count: u32,
    /// Largest corner.
    pub most: Vec3,
    /// A leaf's first triangle; for an inner node the number of the node after all that is in it.
    pub first: u32,
}

impl Bvh {
    /// The tree without what only this processor's queries need.
    #[must_use]
    pub fn flat(&self) -> FlatBvh {
        let mut nodes: Vec<FlatNode> = Vec::with_capacity(self.tree.nodes.len());
        let mut steps = if self.corners.is_empty() { Vec::new() } else { vec![Step::Enter(0)] };
        while let Some(step) = steps.pop() {
            let place = nodes.len() as u32;
            match step {
                Step::Leave(inner) => {
                    if let Some(node) = nodes.get_mut(inner as usize) {
                        node.first = place;
                    }
                }
                Step::Enter(index) => {
                    let Some(node) = self.tree.nodes.get(index as usize) else { continue };
                    let Aabb { min, max, .. } = *node.aabb();
                    let (count, first) = (node.prim_count, node.first_index);
                    nodes.push(FlatNode { least: min.into(), count, most: max.into(), first });
                    if !node.is_leaf() {
                        steps.extend([Step::Leave(place), Step::Enter(first + 1), Step::Enter(first)]);
                    }
                }
            }
        }
        let corners = self.corners.iter().map(|corners| corners.map(Vec3::from)).collect();
        FlatBvh { nodes, corners, leave_distance: self.leave_distance }
    }

    /// Builds the tree. Triangles with indices out of range or coordinates that are not finite are left out.
    #[must_use]
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let (triangle_of_slot, corners) = finite_triangles(positions, triangles);
        let largest = corners.iter().flatten().map(|p| p.abs().max_element()).fold(0.0, f32::max);
        let padding = Vec3A::splat(largest * BOX_PADDING);
        let boxes: Vec<Aabb> = corners
            .iter()
            .map(|c| Aabb::from_points(c))
            .map(|b| Aabb::new(b.min - padding, b.max + padding))
            .collect();
        let mut tree = build_tree(&boxes);
        // Queries then read the corners of a leaf without indirection.
        let slots = &tree.primitive_indices;
        let corners: Vec<[Vec3A; 3]> = slots.iter().map(|&i| corners[i as usize]).collect();
        let triangle_of_slot = slots.iter().map(|&i| triangle_of_slot[i as usize]).collect();
        let packs = pack_leaves(&mut tree, &corners);
        Self { tree, packs, corners, triangle_of_slot, leave_distance: largest * LEAVE_SURFACE }
    }

    /// Where a ray should start that leaves the surface at `point` (on or near a triangle) toward the side of `normal`
    /// (unit), so that it does not meet that surface again.
    #[must_use]
    pub fn leave(&self, point: Vec3, normal: Vec3) -> Vec3 {
        point + normal * self.leave_distance
    }

    /// The distance by which [`Bvh::leave`] moves a point, metres: 64 ulp of the scene's largest coordinate.
    #[must_use]
    pub fn leave_distance(&self) -> f32 {
        self.leave_distance
    }

    /// The nearest hit nearer than `max_distance` (in multiples of `direction`).
    #[must_use]
    pub fn hit(&self, origin: Vec3, direction: Vec3, max_distance: f32) -> Option<Hit> {
        self.hit_where(origin, direction, max_distance, |_| true)
    }

    /// The nearest hit among those that `accept` lets through. `accept` is asked only about hits that would be the
    /// nearest so far.
    #[must_use]
    pub fn hit_where(
        &self,
        origin: Vec3,
        direction: Vec3,
        max_distance: f32,
        accept: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        let ray = ray(origin, direction, max_distance)?;
        let sheared = ShearedRay::new(origin, direction);
        let mut best: Option<Hit> = None;
        fast_stack!(u32, (96, 192), self.tree.max_depth, stack, {
            self.tree.ray_traverse_dynamic(&mut stack, ray, &mut RayHit::none(), |node, ray, _| {
                self.for_each_hit(node, &sheared, |hit| {
                    if is_nearer(&hit, best.as_ref(), max_distance) && accept(&hit) {
                        best = Some(hit);
                        // A little longer, so that a tie is not culled and the lowest index wins it.
                        ray.tmax = hit.distance * (1.0 + 8.0 * f32::EPSILON);
                    }
                });
                true
            });
        });
        best
    }

    /// True if anything lies on the ray nearer than `max_distance` (in multiples of `direction`).
    #[must_use]
    pub fn occluded(&self, origin: Vec3, direction: Vec3, max_distance: f32) -> bool {
        self.occluded_where(origin, direction, max_distance, |_| true)
    }

    /// True if a hit that `blocks` lies on the ray nearer than `max_distance`, whichever side it shows.
    #[must_use]
    pub fn occluded_where(
        &self,
        origin: Vec3,
        direction: Vec3,
        max_distance: f32,
        blocks: impl Fn(&Hit) -> bool,
    ) -> bool {
        let Some(ray) = ray(origin, direction, max_distance) else { return false };
        let sheared = ShearedRay::new(origin, direction);
        let mut occluded = false;
        fast_stack!(u32, (96, 192), self.tree.max_depth, stack, {
            self.tree.ray_traverse_dynamic(&mut stack, ray, &mut RayHit::none(), |node, _, _| {
                self.for_each_hit(node, &sheared, |hit| {
                    occluded = occluded || (hit.distance < max_distance && blocks(&hit));
                });
                !occluded
            });
        });
        occluded
    }

    /// The point nearest to `p` on the triangles that `accept` lets through, if one lies within `max_distance` (metres;
    /// infinity is allowed). `accept` is asked only about triangles that would be the nearest so far.
    #[must_use]
    pub fn closest(&self, p: Vec3, max_distance: f32, accept: impl Fn(u32) -> bool) -> Option<Nearest> {
        let root = self.tree.nodes.first()?;
        let p = Vec3A::from(p);
        let mut limit = max_distance * max_distance;
        let mut best: Option<Nearest> = None;
        fast_stack!((u32, f32), (96, 192), self.tree.max_depth, stack, {
            let mut next = Some((0_u32, squared_distance_to_box(p, root.aabb())));
            while let Some((index, box_distance)) = next {
                next = None;
                // Ties stay in the search; a NaN point prunes everything.
                if box_distance <= limit {
                    let node = &self.tree.nodes[index as usize];
                    if node.is_leaf() {
                        for slot in node.first_index..node.first_index + node.prim_count {
                            self.visit_nearest(slot, p, &mut limit, &mut best, &accept);
                        }
                    } else {
                        let mut near = self.with_distance(node.first_index, p);
                        let mut far = self.with_distance(node.first_index + 1, p);
                        if far.1 < near.1 {
                            std::mem::swap(&mut near, &mut far);
                        }
                        stack.push(far);
                        next = Some(near);
                    }
                }
                if next.is_none() {
                    next = stack.pop();
                }
            }
        });
        best
    }

    fn with_distance(&self, node: u32, p: Vec3A) -> (u32, f32) {
        (node, squared_distance_to_box(p, self.tree.nodes[node as usize].aabb()))
    }

    fn visit_nearest(
        &self,
        slot: u32,
        p: Vec3A,
        limit: &mut f32,
        best: &mut Option<Nearest>,
        accept: impl Fn(u32) -> bool,
    ) {
        let point = nearest::closest_point(&self.corners[slot as usize], p);
        let squared = p.distance_squared(point);
        let triangle = self.triangle_of_slot[slot as usize];
        let nearer =
            squared < *limit || (squared == *limit && best.is_none_or(|best| triangle < best.triangle));
        if nearer && accept(triangle) {
            *limit = squared;
            *best = Some(Nearest { triangle, point: point.into(), distance: squared.sqrt() });
        }
    }

    /// Calls `visit` with every hit among the triangles of a leaf.
    #[inline]
    fn for_each_hit(&self, leaf: &Bvh2Node, ray: &ShearedRay, mut visit: impl FnMut(Hit)) {
        let packs = &self.packs[leaf.meta1 as usize..(leaf.meta1 + leaf.meta2) as usize];
        for (pack, first) in packs.iter().zip((leaf.first_index as usize..).step_by(LANES)) {
            let hits = pack.intersect(ray);
            let mut mask = hits.mask.bitmask();
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                visit(Hit {
                    triangle: self.triangle_of_slot[first + lane],
                    distance: hits.distance[lane],
                    barycentric: hits.barycentric(lane),
                    front: hits.determinant[lane] > 0.0,
                });
            }
        }
    }
}

/// On the way through all nodes.
enum Step {
    Enter(u32),
    Leave(u32),
}

fn is_nearer(hit: &Hit, best: Option<&Hit>, max_distance: f32) -> bool {
    match best {
        None => hit.distance < max_distance,
        Some(best) => (hit.distance, hit.triangle) < (best.distance, best.triangle),
    }
}

fn finite_triangles(positions: &[Vec3], triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<[Vec3A; 3]>) {
    let corner = |i: u32| positions.get(i as usize).filter(|p| p.is_finite()).map(|&p| Vec3A::from(p));
    let all = triangles.iter().zip(0_u32..).filter_map(|(&[a, b, c], index)| {
        let corners = [corner(a)?, corner(b)?, corner(c)?];
        Some((index, corners))
    });
    all.unzip()
}

/// As obvhs' preset for fast builds, without its debug validation, which panics on scenes with large coordinates.
fn build_tree(boxes: &[Aabb]) -> Bvh2 {
    let indices = (0..boxes.len() as u32).collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Low,
        boxes,
        indices,
        SortPrecision::U64,
        2,
    );
    ReinsertionOptimizer::default().run(&mut tree, 0.02, None);
    collapse(&mut tree, LANES as u32, 3.0);
    // The stacks of queries must hold one entry per level; reinsertion may have made the tree deeper.
    tree.max_depth = depth(&tree) + 1;
    tree
}

/// Packs the triangles of each leaf, and notes in the leaf where its packs are.
fn pack_leaves(tree: &mut Bvh2, corners: &[[Vec3A; 3]]) -> Vec<TrianglePack> {
    let mut packs = Vec::with_capacity(corners.len().div_ceil(2));
    for leaf in tree.nodes.iter_mut().filter(|node| node.is_leaf()) {
        leaf.meta1 = packs.len() as u32;
        let first = leaf.first_index as usize;
        let triangles = corners.get(first..first + leaf.prim_count as usize).unwrap_or(&[]);
        packs.extend(triangles.chunks(LANES).map(|chunk| {
            let chunk: Vec<[Vec3; 3]> = chunk.iter().map(|t| t.map(Vec3::from)).collect();
            TrianglePack::new(&chunk)
        }));
        leaf.meta2 = packs.len() as u32 - leaf.meta1;
    }
    packs
}

fn depth(tree: &Bvh2) -> usize {
    let mut deepest = 0;
    let mut stack = vec![(0_u32, 1_usize)];
    while let Some((index, depth)) = stack.pop() {
        let Some(node) = tree.nodes.get(index as usize) else { continue };
        deepest = deepest.max(depth);
        if !node.is_leaf() {
            stack.push((node.first_index, depth + 1));
            stack.push((node.first_index + 1, depth + 1));
        }
    }
    deepest
}

/// `None` for rays that cannot hit anything or would poison the traversal.
fn ray(origin: Vec3, direction: Vec3, max_distance: f32) -> Option<Ray> {
    let valid = origin.is_finite() && direction.is_finite() && direction != Vec3::ZERO && max_distance > 0.0;
    valid.then(|| Ray::new(origin.into(), direction.into(), 0.0, max_distance))
}

fn squared_distance_to_box(p: Vec3A, aabb: &Aabb) -> f32 {
    p.distance_squared(p.clamp(aabb.min, aabb.max))
}

#[cfg(test)]
mod tests;

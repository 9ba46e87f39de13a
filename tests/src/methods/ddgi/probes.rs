//! Where probes stand.

use glam::{UVec3, Vec3};
use rayon::prelude::*;
use vlm_bake::shade::TraceScene;

use crate::random::fibonacci_direction;

/// A probe that sees backs of surfaces along more than this share of its rays is inside something (Majercik et al. 2021).
const INSIDE_SHARE: f32 = 0.25;

/// Rays that classify a probe.
const CLASSIFYING_RAYS: u32 = 64;

/// Probes keep this share of the spacing away from surfaces where they can: on a surface they see half of the scene.
const KEEP_AWAY: f32 = 0.2;

/// Probes move by at most this share of the spacing, so that they stay in the order of the grid.
const FARTHEST: f32 = 0.45;

/// Attempts to move a probe away from what is nearest.
const ATTEMPTS: u32 = 4;

/// Probes at the corners of a cubic grid over the scene.
pub struct ProbeGrid {
    /// The first corner, metres.
    pub origin: Vec3,
    /// Between neighbouring corners, metres.
    pub spacing: f32,
    /// Corners along each axis, at least 2.
    pub corners: UVec3,
    /// Where the probe of each corner stands, x fastest; `None` where it is switched off.
    pub positions: Vec<Option<Vec3>>,
}

impl ProbeGrid {
    /// Places probes over the box `low..high`, moves those that stand inside or next to surfaces, and switches off those
    /// that no move frees.
    #[must_use]
    pub fn place(scene: &TraceScene<'_>, (low, high): (Vec3, Vec3), spacing: f32) -> Self {
        let spacing = spacing.max(f32::MIN_POSITIVE);
        let origin = low - 1e-3 * spacing;
        let corners = ((high - origin) / spacing).floor().as_uvec3() + 2;
        let mut grid = Self { origin, spacing, corners, positions: Vec::new() };
        let count = corners.x * corners.y * corners.z;
        grid.positions = (0..count).into_par_iter().map(|i| freed(scene, grid.corner(i), spacing)).collect();
        grid
    }

    /// Where the grid has its corner `index`, metres.
    #[must_use]
    pub fn corner(&self, index: u32) -> Vec3 {
        let [nx, ny] = [self.corners.x, self.corners.y];
        let corner = UVec3::new(index % nx, index / nx % ny, index / nx / ny);
        self.origin + corner.as_vec3() * self.spacing
    }

    /// Index of a corner.
    #[must_use]
    pub fn index(&self, corner: UVec3) -> usize {
        (corner.x + self.corners.x * (corner.y + self.corners.y * corner.z)) as usize
    }

    /// Probes that are switched on.
    #[must_use]
    pub fn active(&self) -> usize {
        self.positions.iter().flatten().count()
    }
}

/// The corner itself if it stands free, else a free place near it.
fn freed(scene: &TraceScene<'_>, corner: Vec3, spacing: f32) -> Option<Vec3> {
    let (away, farthest) = (KEEP_AWAY * spacing, FARTHEST * spacing);
    let mut position = corner;
    for _ in 0..ATTEMPTS {
        let Some(near) = scene.bvh.closest(position, f32::INFINITY, |_| true) else { break };
        let front = front_of(scene, near.triangle)?;
        let from_surface = position - near.point;
        let is_behind = from_surface.dot(front) < 0.0;
        if !is_behind && near.distance >= away {
            break;
        }
        let direction =
            if is_behind || near.distance < 0.01 * away { front } else { from_surface / near.distance };
        position = near.point + direction * away;
        position = corner + (position - corner).clamp_length_max(farthest);
    }
    [position, corner].into_iter().find(|&p| !is_inside(scene, p))
}

fn front_of(scene: &TraceScene<'_>, triangle: u32) -> Option<Vec3> {
    let [a, b, c] = scene.scene.corners(triangle as usize)?;
    (b - a).cross(c - a).try_normalize()
}

fn is_inside(scene: &TraceScene<'_>, position: Vec3) -> bool {
    let sees_back = |i: &u32| {
        let hit = scene.path_hit(position, fibonacci_direction(*i, CLASSIFYING_RAYS));
        hit.is_some_and(|hit| !scene.is_lit_side(&hit))
    };
    let backs = (0..CLASSIFYING_RAYS).filter(sees_back).count();
    backs as f32 > INSIDE_SHARE * CLASSIFYING_RAYS as f32
}

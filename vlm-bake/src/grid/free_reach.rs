//! How far a probe in free space counts: a box that holds no wall.

use glam::Vec3;
use vlm_format::Probe;

use crate::reference::directions_around;
use crate::shade::TraceScene;

/// Rays that look for walls. More of them find thinner posts.
const LOOKS: u32 = 512;

/// A reach is never below this share of what it would be in the open.
const LEAST: f32 = 0.02;

/// The box ends this share before a wall, so that rounding leaves no light behind a thin one.
const SHY: f32 = 1e-3;

/// A probe whose reach ends `reach` away along each axis, or where walls begin; its row is still empty.
#[must_use]
pub fn probe(trace: &TraceScene, position: Vec3, reach: f32) -> Probe {
    let [low, high] = free_box(walls(trace, position, reach), reach);
    let least = LEAST * reach;
    let [low, high] = [-low, high].map(|side| (side * (1.0 - SHY)).max(Vec3::splat(least)));
    Probe {
        position,
        row_scale: 0.0,
        normal: Vec3::Z,
        reach_up: high.z,
        tangent: Vec3::X,
        reach_down: low.z,
        reach: [low.x, high.x, low.y, high.y],
    }
}

/// Where rays meet walls, from the probe, nearest first.
fn walls(trace: &TraceScene, position: Vec3, reach: f32) -> Vec<Vec3> {
    let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let most = reach * 3.0_f32.sqrt();
    let met = |direction: Vec3| {
        trace.path_hit_within(position, direction, most).map(|hit| direction * hit.distance)
    };
    let mut walls: Vec<Vec3> = axes.into_iter().chain(directions_around(LOOKS, 0)).filter_map(met).collect();
    walls.sort_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    walls
}

/// Least and largest corner of a box around 0 that holds none of these points, nearest first: each cuts the side on whose axis it is
/// farthest.
fn free_box(walls: impl IntoIterator<Item = Vec3>, reach: f32) -> [Vec3; 2] {
    let (mut low, mut high) = (Vec3::splat(-reach), Vec3::splat(reach));
    for wall in walls {
        if (wall.cmpgt(low) & wall.cmplt(high)).all() {
            let axis = wall.abs().max_position();
            if wall[axis] < 0.0 {
                low[axis] = wall[axis];
            } else {
                high[axis] = wall[axis];
            }
        }
    }
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_cuts_one_side() {
        let wall = (0..100).map(|i| Vec3::new(0.3, 0.01 * i as f32, 0.005 * i as f32));
        let [low, high] = free_box(wall, 1.0);
        assert_eq!((low, high), (Vec3::NEG_ONE, Vec3::new(0.3, 1.0, 1.0)));
    }

    #[test]
    fn a_slanted_wall_leaves_a_cube() {
        let mut wall: Vec<Vec3> =
            (-60..=60).map(|i| Vec3::new(0.3 + 0.01 * i as f32, 0.3 - 0.01 * i as f32, 0.0)).collect();
        wall.sort_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        let [_, high] = free_box(wall, 1.0);
        assert!(high.x >= 0.29 && high.y >= 0.29, "{high}");
        assert!(high.x + high.y < 0.64, "{high}");
    }
}

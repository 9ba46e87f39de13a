//! Meshes drawn at random: each depends on its parameters alone.

use std::f64::consts::TAU;

use glam::{DVec3, dvec3};

use super::HardMesh;
use super::shapes::{ball, cuboid, posed, prism, tetrahedron};
use crate::random::{rotation, unit};

/// A ball of radius 1 m, its surface in and out by smooth noise of that amplitude in metres (0 to 0.3).
#[must_use]
pub fn noisy_ball(seed: u64, amplitude: f64) -> HardMesh {
    // Waves along random axes, of 0.8 m to 4 m.
    let waves: Vec<(DVec3, f64)> = (0..6)
        .map(|w| {
            let draw = |k: u64| f64::from(unit(seed, 8 * w + k));
            let axis = rotation([0, 1, 2].map(|k| unit(seed, 8 * w + k))) * glam::Vec3::X;
            (axis.as_dvec3() * (1.5 + 6.5 * draw(3)), TAU * draw(4))
        })
        .collect();
    let noise =
        move |p: DVec3| waves.iter().map(|(wave, phase)| libm::sin(wave.dot(p) + phase)).sum::<f64>() / 6.0;
    HardMesh::of(ball(DVec3::ZERO, 8, move |direction| 1.0 + amplitude * noise(direction)))
}

/// A prism over a star-shaped polygon of that many corners; radii between `least` and 1 m, convex and concave corners alike.
#[must_use]
pub fn random_prism(seed: u64, corners: u32, least: f64, height: f64) -> HardMesh {
    let outline = (0..corners).map(|i| {
        let draw = |k: u64| f64::from(unit(seed, 2 * u64::from(i) + k));
        // At most half a step off: angles ascend, and no two are farther apart than half a turn.
        let angle = TAU * (f64::from(i) + 0.5 * draw(0)) / f64::from(corners);
        let radius = least + (1.0 - least) * draw(1);
        (radius * libm::cos(angle), radius * libm::sin(angle))
    });
    HardMesh::of(prism(&outline.collect::<Vec<_>>(), height))
}

/// Boxes and tetrahedra of 0.2 m to 1 m that overlap as they may, all in one object.
#[must_use]
pub fn soup(seed: u64, bodies: u32) -> HardMesh {
    let body = |b: u32| {
        let draw = |k: u64| unit(seed, 16 * u64::from(b) + k);
        let between = |k, low: f64, high: f64| low + (high - low) * f64::from(draw(k));
        let form = if draw(0) < 0.6 {
            let half = 0.5 * dvec3(between(1, 0.2, 1.0), between(2, 0.2, 1.0), between(3, 0.2, 1.0));
            cuboid(-half, half, 1)
        } else {
            posed(tetrahedron(), between(1, 0.2, 0.7), glam::DQuat::IDENTITY, DVec3::ZERO)
        };
        let turn = rotation([draw(4), draw(5), draw(6)]).as_dquat();
        let place = dvec3(between(7, -0.7, 0.7), between(8, -0.7, 0.7), between(9, -0.7, 0.7));
        posed(form, 1.0, turn.normalize(), place)
    };
    HardMesh::of((0..bodies).flat_map(body).collect())
}

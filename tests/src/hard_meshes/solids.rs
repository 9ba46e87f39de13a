//! Closed surfaces, thick and thin, and rooms.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec3, dvec3};

use super::shapes::{ball, box_sides, cuboid, plane, quad, revolved, turned};
use super::{HardMesh, Piece, Triangle};

/// A bowl 3 cm thick, of radius 1 m: concave inside, convex outside, with a rim.
/// ```text
///    ||        ||
///     \\      //
///       ======
/// ```
#[must_use]
pub fn bowl() -> HardMesh {
    let arc = |radius: f64, i: u32| {
        let (sin, cos) = (FRAC_PI_2 * f64::from(i) / 8.0).sin_cos();
        (radius * sin, -radius * cos)
    };
    // Outward along the outside, back along the inside; the first and last point lie on the axis.
    let outside = (1..=8).map(|i| arc(1.0, i));
    let inside = (1..=8).rev().map(|i| arc(0.97, i));
    let profile: Vec<(f64, f64)> =
        [(1e-3, -1.0)].into_iter().chain(outside).chain(inside).chain([(1e-3, -0.97)]).collect();
    HardMesh::of(revolved(&profile, 24))
}

/// A band 4 cm thick rolled up twice; the gap between its turns is 6 cm.
/// ```text
///      ========
///    //  ____  \\
///    || ||  ||
///    ||  \\=====     seen from above; closed above and below and at both ends
/// ```
#[must_use]
pub fn spiral_band() -> HardMesh {
    const STEPS: u32 = 64;
    const THICK: f64 = 0.04;
    let at = |i: u32, depth: f64, z: f64| {
        let turns = 2.0 * f64::from(i) / f64::from(STEPS);
        let (sin, cos) = (TAU * turns).sin_cos();
        let radius = 0.2 + 0.1 * turns - depth;
        dvec3(radius * cos, radius * sin, z)
    };
    let [low, high] = [0.0, 0.4];
    let mut triangles = Vec::new();
    for i in 0..STEPS {
        let j = i + 1;
        triangles.extend(quad([at(i, 0.0, low), at(j, 0.0, low), at(j, 0.0, high), at(i, 0.0, high)]));
        triangles.extend(quad([
            at(j, THICK, low),
            at(i, THICK, low),
            at(i, THICK, high),
            at(j, THICK, high),
        ]));
        triangles.extend(quad([at(i, 0.0, high), at(j, 0.0, high), at(j, THICK, high), at(i, THICK, high)]));
        triangles.extend(quad([at(i, THICK, low), at(j, THICK, low), at(j, 0.0, low), at(i, 0.0, low)]));
    }
    for (i, first) in [(0, true), (STEPS, false)] {
        let end = quad([at(i, THICK, low), at(i, 0.0, low), at(i, 0.0, high), at(i, THICK, high)]);
        triangles.extend(if first { end } else { turned(&end) });
    }
    HardMesh::of(triangles)
}

/// A ball of radius 0.8 m inside a ball of 1 m, both seen from outside, in one object.
/// ```text
///     ____
///    / __ \
///   | |  | |
///    \____/
/// ```
#[must_use]
pub fn ball_in_a_ball() -> HardMesh {
    HardMesh::of([ball(DVec3::ZERO, 8, |_| 1.0), ball(DVec3::ZERO, 6, |_| 0.8)].concat())
}

/// A cube without its top: what lies behind its sides is seen through the hole.
/// ```text
///    |      |
///    |      |
///    +------+
/// ```
#[must_use]
pub fn cube_without_a_face() -> HardMesh {
    let [a, b, c, d, e, _] = box_sides(DVec3::ZERO, DVec3::ONE, 3);
    HardMesh::of([a, b, c, d, e].concat())
}

/// A closed plate of 2 m x 2 m and of that thickness in metres.
/// ```text
///    +----------------+
///    +----------------+
/// ```
#[must_use]
pub fn closed_plate(thickness: f64) -> HardMesh {
    HardMesh::of(cuboid(DVec3::ZERO, dvec3(2.0, 2.0, thickness), 3))
}

/// A pipe 1 m long, of radius 10 cm, with walls 1 cm thick.
/// ```text
///    ===========
///    -----------
///    ===========
/// ```
#[must_use]
pub fn tube() -> HardMesh {
    HardMesh::of(revolved(&[(0.09, 0.0), (0.1, 0.0), (0.1, 0.5), (0.1, 1.0), (0.09, 1.0), (0.09, 0.5)], 24))
}

/// A box on a floor, each an object of its own; the box's bottom lies in the floor's plane.
/// ```text
///         +--+
///    _____|__|_____
/// ```
#[must_use]
pub fn box_on_a_floor() -> HardMesh {
    let floor = plane(dvec3(-2.0, -2.0, 0.0), 4.0 * DVec3::X, 4.0 * DVec3::Y, [2, 2]);
    let block = cuboid(dvec3(-0.5, -0.5, 0.0), dvec3(0.5, 0.5, 1.0), 2);
    HardMesh::default()
        .with("floor", vec![Piece::new(floor)])
        .with("box", vec![Piece::new(block).of_albedo([0.7, 0.2, 0.1])])
}

/// Two rooms with a wall of 1 cm between them: as one object, or one for each room.
/// ```text
///    +------++------+
///    |      ||      |
///    +------++------+
/// ```
#[must_use]
pub fn two_rooms(one_object: bool) -> HardMesh {
    let room = |x: f64| turned(&cuboid(dvec3(x, 0.0, 0.0), dvec3(x + 3.0, 3.0, 2.5), 3));
    let (left, right) = (room(0.0), room(3.01));
    if one_object {
        HardMesh::of([left, right].concat())
    } else {
        let red = Piece::new(right).of_albedo([0.7, 0.1, 0.1]);
        HardMesh::default().with("left", vec![Piece::new(left)]).with("right", vec![red])
    }
}

/// A cube with two fins on an edge: four and more triangles meet there.
/// ```text
///        \ /   fins, fronts to the right
///    +----+
///    |    |
///    +----+
/// ```
#[must_use]
pub fn fins() -> HardMesh {
    let cube = cuboid(DVec3::ZERO, DVec3::ONE, 2);
    let fin = |out: DVec3| {
        plane(dvec3(1.0, 0.0, 1.0), DVec3::Y, out, [2, 1]).into_iter().collect::<Vec<Triangle>>()
    };
    HardMesh::of([cube, fin(dvec3(0.5, 0.0, 0.5)), fin(dvec3(-0.2, 0.0, 0.6))].concat())
}

/// A cube among triangles without area: a corner twice, a corner three times, three corners in a line.
/// ```text
///    +--+--+
///    |  | /|    a = a, a = a = a, a-b-c
///    +--+--+
/// ```
#[must_use]
pub fn zero_area_triangles() -> HardMesh {
    let mut triangles = cuboid(DVec3::ZERO, DVec3::ONE, 2);
    let (a, b) = (DVec3::ZERO, DVec3::X);
    triangles.extend([[a, a, b], [a, a, a], [a, 0.5 * b, b], [b, 0.5 * b, a]]);
    HardMesh::of(triangles)
}

/// A room with a block and a two-sided plate in it: nothing is curved, so that rounding decides nothing in its bake.
/// ```text
///    +-----------+
///    |           |
///    |     [] -- |
///    +-----------+
/// ```
#[must_use]
pub fn flat_room() -> HardMesh {
    let room = turned(&cuboid(DVec3::ZERO, dvec3(4.0, 3.0, 2.5), 3));
    let block = cuboid(dvec3(2.0, 1.0, 0.0), dvec3(2.6, 1.7, 0.8), 2);
    let plate = plane(dvec3(3.0, 1.0, 0.7), 0.6 * DVec3::X, 0.9 * DVec3::Y, [2, 2]);
    HardMesh::default()
        .with("room", vec![Piece::new(room)])
        .with("block", vec![Piece::new(block).of_albedo([0.7, 0.1, 0.1])])
        .with("plate", vec![Piece::new(plate).two_sided()])
}

/// The same with a bumpy ball: something of everything.
/// ```text
///    +-----------+
///    |  o        |
///    |     [] -- |
///    +-----------+
/// ```
#[must_use]
pub fn furnished_room() -> HardMesh {
    let bumpy = ball(dvec3(1.0, 1.5, 1.0), 8, |d| {
        0.5 + 0.02 * libm::sin(3.1 * d.x + 1.0) + 0.015 * libm::sin(4.7 * d.y + 2.3 * d.z)
    });
    flat_room().with("ball", vec![Piece::new(bumpy).of_albedo([0.2, 0.3, 0.7])])
}

//! Open surfaces: nothing closes them, so nothing but their thinness hides what lies behind.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, dvec3};

use super::shapes::{band, plane, quad, sheet, turned};
use super::{HardMesh, Piece};

/// Two plates, one above the other, 1 mm apart, in one primitive.
/// ```text
///     ________  z = 1 mm, front up
///     ________  z = 0,    front up
/// ```
#[must_use]
pub fn two_plates() -> HardMesh {
    let plate = |z| plane(dvec3(0.0, 0.0, z), DVec3::X, DVec3::Y, [3, 3]);
    HardMesh::of([plate(0.0), plate(1e-3)].concat())
}

/// The same, front to front: each plate's light must not come between them.
/// ```text
///     ________  z = 1 mm, front down
///     ________  z = 0,    front up
/// ```
#[must_use]
pub fn two_plates_face_to_face() -> HardMesh {
    let plate = |z| plane(dvec3(0.0, 0.0, z), DVec3::X, DVec3::Y, [3, 3]);
    HardMesh::of([plate(0.0), turned(&plate(1e-3))].concat())
}

/// A band with half a twist: it has one side, and one row of edges along which fronts meet backs.
/// ```text
///      ___----___
///     /  _----_  \
///    (  (  ><  )  )
///     \__\_--_/__/
/// ```
#[must_use]
pub fn moebius(two_sided: bool) -> HardMesh {
    const AROUND: u32 = 48;
    const ACROSS: u32 = 4;
    let place = |i: u32, j: u32| {
        // After one turn the band arrives upside down.
        let (i, j) = if i == AROUND { (0, ACROSS - j) } else { (i, j) };
        let (sin, cos) = (TAU * f64::from(i) / f64::from(AROUND)).sin_cos();
        let (half_sin, half_cos) = (PI * f64::from(i) / f64::from(AROUND)).sin_cos();
        let across = 0.6 * (f64::from(j) / f64::from(ACROSS) - 0.5);
        let radius = 1.0 + across * half_cos;
        dvec3(radius * cos, radius * sin, across * half_sin)
    };
    let piece = Piece::new(sheet(AROUND, ACROSS, place));
    HardMesh::of_piece(if two_sided { piece.two_sided() } else { piece })
}

/// A sheet that is folded back and touches itself along a line: four triangles meet at each edge there.
/// ```text
///      \         ___
///       \   __---   \
///    ____\_---_______)
///         touches
/// ```
#[must_use]
pub fn folded_sheet() -> HardMesh {
    let line = [
        (0.0, 0.0),
        (0.25, 0.0),
        (0.5, 0.0),
        (0.75, 0.0),
        (1.0, 0.0),
        (1.1, 0.05),
        (1.0, 0.1),
        (0.75, 0.05),
        (0.5, 0.0),
        (0.25, 0.25),
    ];
    HardMesh::of(band(&line, 1.0, 4))
}

/// A sheet rolled up two and a half times, its front outward.
/// ```text
///      ______
///     /  __  \
///    |  /  \  |
///    |  \_    |
///     \______/
/// ```
#[must_use]
pub fn spiral_sheet() -> HardMesh {
    let at = |i: u32| {
        let turns = 2.5 * f64::from(i) / 80.0;
        let (sin, cos) = (TAU * turns).sin_cos();
        let radius = 0.2 + 0.1 * turns;
        (radius * cos, radius * sin)
    };
    HardMesh::of(band(&(0..=80).map(at).collect::<Vec<_>>(), 0.5, 4))
}

/// A saddle, `z = (x^2 - y^2) / 2`: convex along one axis, concave along the other.
/// ```text
///    \      __      /
///     \___--  --___/
/// ```
#[must_use]
pub fn saddle() -> HardMesh {
    let at = |i: u32| f64::from(i) / 8.0 - 1.0;
    HardMesh::of(sheet(16, 16, |i, j| dvec3(at(i), at(j), 0.5 * (at(i) * at(i) - at(j) * at(j)))))
}

/// Where the banner of [`banner`] hangs, metres in front of the wall.
pub const BANNER_DISTANCE: f64 = 0.3;

/// A banner of which both sides reflect in front of a wall, in one primitive.
/// ```text
///    |          wall at z = 0, front to +z, 2 m x 2 m
///    |  |
///    |  |       banner at z = 0.3 m, 1 m x 1 m
///    |
/// ```
/// By the material, the wall is two-sided too; else the banner's triangles are there twice, the second time turned round.
#[must_use]
pub fn banner(by_material: bool) -> HardMesh {
    let wall = plane(dvec3(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y, [4, 4]);
    let front = plane(dvec3(-0.5, -0.5, BANNER_DISTANCE), DVec3::X, DVec3::Y, [2, 2]);
    let back = turned(&front);
    if by_material {
        HardMesh::of_piece(Piece::new([wall, front].concat()).two_sided())
    } else {
        HardMesh::of([wall, front, back].concat())
    }
}

/// Three walls that meet in a corner.
/// ```text
///       |        inner: seen from the room     outer: seen from around the block
///       |
///       o---
///      /
/// ```
#[must_use]
pub fn corner(inner: bool) -> HardMesh {
    let walls = [
        plane(DVec3::ZERO, DVec3::X, DVec3::Y, [4, 4]),
        plane(DVec3::ZERO, DVec3::Y, DVec3::Z, [4, 4]),
        plane(DVec3::ZERO, DVec3::Z, DVec3::X, [4, 4]),
    ]
    .concat();
    HardMesh::of(if inner { walls } else { turned(&walls) })
}

/// 100 km of flat land with a step of 1 cm: far below what single precision can hide there.
/// ```text
///                 ____________  z = 1 cm
///    ____________|              z = 0
/// ```
#[must_use]
pub fn terrain_with_a_step() -> HardMesh {
    const EDGE: f64 = 5e4;
    const STEP: f64 = 0.01;
    let half = |x, z| plane(dvec3(x, -EDGE, z), EDGE * DVec3::X, 2.0 * EDGE * DVec3::Y, [8, 16]);
    let riser = sheet(1, 16, |i, j| dvec3(0.0, EDGE - EDGE / 8.0 * f64::from(j), STEP * f64::from(1 - i)));
    HardMesh::of([half(-EDGE, 0.0), riser, half(0.0, STEP)].concat())
}

/// A floor of two quads and a wall of three along the same line: no vertex of one edge is on the other.
/// ```text
///    |   |  |   |
///    |___|__|___|
///    /     |     \
/// ```
#[must_use]
pub fn t_junctions() -> HardMesh {
    let floor = plane(DVec3::ZERO, DVec3::X, DVec3::Y, [2, 2]);
    let wall = plane(DVec3::Y, DVec3::X, DVec3::Z, [3, 3]);
    HardMesh::of([floor, wall].concat())
}

/// A sheet whose every triangle is there twice, the second time turned round.
/// ```text
///    front up    ________
///    front down  ________  at the same place
/// ```
#[must_use]
pub fn doubled_faces() -> HardMesh {
    let once = plane(DVec3::ZERO, DVec3::X, DVec3::Y, [4, 4]);
    let twice = turned(&once);
    HardMesh::of([once, twice].concat())
}

/// One quad, for planting.
/// ```text
///    +----+
///    |  / |
///    +----+
/// ```
#[must_use]
pub fn two_sided_quad() -> HardMesh {
    let piece = Piece::new(quad([DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y]));
    HardMesh::of_piece(piece.two_sided())
}

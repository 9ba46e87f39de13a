//! The forms of which hard meshes are made.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3, dvec3};

use super::Triangle;

/// A flat quad of two triangles; corners counter-clockwise seen from its front.
#[must_use]
pub fn quad([a, b, c, d]: [DVec3; 4]) -> Vec<Triangle> {
    vec![[a, b, c], [a, c, d]]
}

/// The triangles turned round.
#[must_use]
pub fn turned(triangles: &[Triangle]) -> Vec<Triangle> {
    triangles.iter().map(|&[a, b, c]| [a, c, b]).collect()
}

/// A sheet of `columns` x `rows` quads over a lattice; its front looks along (column direction) x (row direction). `place` gets the
/// lattice point, so that a sheet which closes can give the same place for its first and its last column.
#[must_use]
pub fn sheet(columns: u32, rows: u32, place: impl Fn(u32, u32) -> DVec3) -> Vec<Triangle> {
    let cell = |i, j| quad([place(i, j), place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)]);
    (0..rows).flat_map(|j| (0..columns).flat_map(move |i| [(i, j)])).flat_map(|(i, j)| cell(i, j)).collect()
}

/// A flat parallelogram of `columns` x `rows` quads, its front along `u` x `v`.
#[must_use]
pub fn plane(origin: DVec3, u: DVec3, v: DVec3, [columns, rows]: [u32; 2]) -> Vec<Triangle> {
    sheet(columns, rows, |i, j| {
        origin + u * (f64::from(i) / f64::from(columns)) + v * (f64::from(j) / f64::from(rows))
    })
}

/// The sides of a box as sheets of n x n quads, seen from outside, in the order -x, +x, -y, +y, -z, +z.
#[must_use]
pub fn box_sides(low: DVec3, high: DVec3, n: u32) -> [Vec<Triangle>; 6] {
    std::array::from_fn(|side| {
        let (axis, front) = (side / 2, side % 2 == 1);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        // A lattice point's coordinate depends on its number alone: sides agree on their common edges.
        let at = |k: usize, i: u32| low[k] + (high[k] - low[k]) * (f64::from(i) / f64::from(n));
        let place = |i, j| {
            let mut p = DVec3::ZERO;
            p[axis] = at(axis, if front { n } else { 0 });
            (p[u], p[v]) = (at(u, i), at(v, j));
            p
        };
        let side = sheet(n, n, place);
        if front { side } else { turned(&side) }
    })
}

/// A closed box seen from outside.
#[must_use]
pub fn cuboid(low: DVec3, high: DVec3, n: u32) -> Vec<Triangle> {
    box_sides(low, high, n).concat()
}

/// A closed ball of 6 n^2 quads, a cube blown up; `radius` gives the distance from its centre for each direction.
#[must_use]
pub fn ball(centre: DVec3, n: u32, radius: impl Fn(DVec3) -> f64) -> Vec<Triangle> {
    let blow = |p: DVec3| {
        let direction = p.normalize_or_zero();
        centre + direction * radius(direction)
    };
    cuboid(-DVec3::ONE, DVec3::ONE, n).into_iter().map(|t| t.map(blow)).collect()
}

/// A closed polygon of (radius, z), counter-clockwise in the plane of radius (right) and z (up), turned about the z axis.
#[must_use]
pub fn revolved(profile: &[(f64, f64)], segments: u32) -> Vec<Triangle> {
    let place = |i: u32, j: u32| {
        let (radius, z) = profile[j as usize % profile.len()];
        let (sin, cos) = (TAU * f64::from(i % segments) / f64::from(segments)).sin_cos();
        dvec3(radius * cos, radius * sin, z)
    };
    sheet(segments, profile.len() as u32, place)
}

/// A closed prism over a polygon that is star-shaped about the origin: outline counter-clockwise in x and y, z from 0 to `height`.
#[must_use]
pub fn prism(outline: &[(f64, f64)], height: f64) -> Vec<Triangle> {
    let at = |i: usize, z: f64| {
        let (x, y) = outline[i % outline.len()];
        dvec3(x, y, z)
    };
    let side = |i| {
        let [low, high] = [0.0, height];
        let mut side = quad([at(i, low), at(i + 1, low), at(i + 1, high), at(i, high)]);
        side.push([DVec3::Z * high, at(i, high), at(i + 1, high)]);
        side.push([DVec3::ZERO, at(i + 1, low), at(i, low)]);
        side
    };
    (0..outline.len()).flat_map(side).collect()
}

/// A closed tetrahedron with its corners on the unit sphere, seen from outside.
#[must_use]
pub fn tetrahedron() -> Vec<Triangle> {
    let [a, b, c, d] = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
        .map(|p: [i32; 3]| dvec3(f64::from(p[0]), f64::from(p[1]), f64::from(p[2])) / 3f64.sqrt());
    vec![[a, b, c], [a, c, d], [a, d, b], [b, d, c]]
}

/// The triangles scaled, turned and moved, in that order.
#[must_use]
pub fn posed(triangles: Vec<Triangle>, scale: f64, rotation: DQuat, by: DVec3) -> Vec<Triangle> {
    triangles.into_iter().map(|t| t.map(|p| rotation * (p * scale) + by)).collect()
}

/// An open or closed band along a line in x and y, extruded along z from 0 to `width`; its front lies to the right of the line's
/// direction of travel.
#[must_use]
pub fn band(line: &[(f64, f64)], width: f64, rows: u32) -> Vec<Triangle> {
    let place = |i: u32, j: u32| {
        let (x, y) = line[i as usize];
        dvec3(x, y, width * f64::from(j) / f64::from(rows))
    };
    sheet(line.len().saturating_sub(1) as u32, rows, place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Directed edges without exactly one opposite.
    fn open_edges(triangles: &[Triangle]) -> usize {
        let bits = |p: DVec3| p.as_vec3().to_array().map(|x| (x + 0.0).to_bits());
        let mut edges = BTreeMap::new();
        for t in triangles {
            for i in 0..3 {
                *edges.entry((bits(t[i]), bits(t[(i + 1) % 3]))).or_insert(0) += 1;
            }
        }
        edges.iter().filter(|&(&(a, b), &n)| n != 1 || edges.get(&(b, a)) != Some(&1)).count()
    }

    fn volume(triangles: &[Triangle]) -> f64 {
        triangles.iter().map(|[a, b, c]| a.dot(b.cross(*c)) / 6.0).sum()
    }

    #[test]
    fn closed_forms_are_closed_and_seen_from_outside() {
        let outline: Vec<(f64, f64)> =
            (0..5).map(|i| (TAU * f64::from(i) / 5.0).sin_cos()).map(|(s, c)| (c, s)).collect();
        let forms = [
            ("cuboid", cuboid(dvec3(0.1, 0.2, 0.3), DVec3::ONE, 3)),
            ("ball", ball(DVec3::ONE, 4, |_| 1.0)),
            ("revolved", revolved(&[(1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0)], 12)),
            ("prism", prism(&outline, 0.7)),
            ("tetrahedron", tetrahedron()),
        ];
        for (name, form) in forms {
            assert_eq!(open_edges(&form), 0, "{name}");
            assert!(volume(&form) > 0.1, "{name} {}", volume(&form));
            assert!(open_edges(&form[1..]) > 0, "{name}: the negative control");
        }
    }
}

//! Merges coplanar faces and triangulates the merged polygons again, constrained Delaunay, without the vertices that no corner needs.

use glam::DVec3;
use petgraph::unionfind::UnionFind;
use rustc_hash::FxHashMap;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

use crate::decimate::{Face, LightMesh};
use crate::topology::{EdgeUse, cross_of, edge_uses, edges};

/// Faces whose normals differ by a smaller sine than this are coplanar. Higher values merge gentle curves, which then stand
/// off their surface by up to the sine times the size of the merged polygon; lower values miss walls whose vertices were rounded.
const COPLANAR_SINE: f64 = 1e-3;

/// A boundary vertex goes where the boundary bends by a smaller sine than this.
const STRAIGHT_SINE: f64 = 1e-4;

/// Vertices of a merged polygon are triangulated on a grid of so many steps over its extent: more than single precision rounds
/// away, less than would let close ones fall together.
const GRID: f64 = (1u32 << 20) as f64;

/// A merged polygon must keep its area to this share, else its faces stay as they were.
const AREA_TOLERANCE: f64 = 1e-6;

/// A mesh of the same surface with few, well-shaped faces where it is flat. Faces keep their region; none is a back.
#[must_use]
pub fn merge_coplanar(mesh: LightMesh) -> LightMesh {
    let groups = coplanar_groups(&mesh);
    let needed = needed_vertices(&mesh, &groups);
    let mut faces = Vec::with_capacity(mesh.faces.len());
    for group in members(&groups) {
        match triangulate(&mesh, &group, &needed) {
            Some(merged) => faces.extend(merged),
            None => faces.extend(group.iter().map(|&f| mesh.faces[f as usize])),
        }
    }
    LightMesh { positions: mesh.positions, faces }
}

/// The group of each face: connected, of one region, in one plane. A group's number is its first face.
fn coplanar_groups(mesh: &LightMesh) -> Vec<u32> {
    let triangles: Vec<[u32; 3]> = mesh.faces.iter().map(|f| f.vertices).collect();
    let mut joined = UnionFind::<u32>::new(triangles.len());
    // The plane of the face that began a group, so that small bends do not add up along a curve.
    let mut plane: Vec<DVec3> = (0..triangles.len()).map(|f| mesh.normal(f)).collect();
    for edge in edges(&edge_uses(&triangles)) {
        let [a, b] = edge else { continue };
        let same_region = mesh.faces[a.triangle as usize].region == mesh.faces[b.triangle as usize].region;
        // On a surface that can be oriented, neighbours use their edge in opposite directions.
        let start = |u: &EdgeUse| triangles[u.triangle as usize][usize::from(u.side)];
        let opposed = start(a) != start(b);
        let (a, b) = (joined.find_mut(a.triangle), joined.find_mut(b.triangle));
        let (n, m) = (plane[a as usize], plane[b as usize]);
        if a != b && same_region && opposed && n.dot(m) > 0.0 && n.cross(m).length() < COPLANAR_SINE {
            joined.union(a, b);
            plane[joined.find_mut(a) as usize] = n;
        }
    }
    let mut first: FxHashMap<u32, u32> = FxHashMap::default();
    (0..triangles.len() as u32).map(|f| *first.entry(joined.find_mut(f)).or_insert(f)).collect()
}

/// The faces of each group, groups in the order of their first faces.
fn members(groups: &[u32]) -> Vec<Vec<u32>> {
    let mut order: Vec<u32> = (0..groups.len() as u32).collect();
    order.sort_by_key(|&f| (groups[f as usize], f));
    order.chunk_by(|&a, &b| groups[a as usize] == groups[b as usize]).map(<[u32]>::to_vec).collect()
}

/// True for each vertex that must stay. Only a vertex inside a straight border of exactly two groups (or of one group and
/// nothing), or in the middle of one group, may go; both sides of a border then agree, and no crack opens.
fn needed_vertices(mesh: &LightMesh, groups: &[u32]) -> Vec<bool> {
    // For each vertex: up to two neighbours along borders; more border edges than two mean a junction.
    let mut border: Vec<(u8, [u32; 2])> = vec![(0, [0; 2]); mesh.positions.len()];
    let triangles: Vec<[u32; 3]> = mesh.faces.iter().map(|f| f.vertices).collect();
    for edge in edges(&edge_uses(&triangles)) {
        let first = groups[edge[0].triangle as usize];
        if edge.len() == 2 && edge.iter().all(|u| groups[u.triangle as usize] == first) {
            continue;
        }
        for (v, other) in [(edge[0].low, edge[0].high), (edge[0].high, edge[0].low)] {
            let (count, neighbours) = &mut border[v as usize];
            if let Some(slot) = neighbours.get_mut(usize::from(*count)) {
                *slot = other;
            }
            *count = count.saturating_add(1);
        }
    }
    border
        .iter()
        .enumerate()
        .map(|(v, &(count, [a, b]))| match count {
            0 => false,
            2 => {
                let at = |v: u32| mesh.positions[v as usize];
                let (to_a, to_b) = (at(a) - mesh.positions[v], at(b) - mesh.positions[v]);
                let straight = to_a.cross(to_b).length() <= STRAIGHT_SINE * to_a.length() * to_b.length();
                !(straight && to_a.dot(to_b) < 0.0)
            }
            _ => true,
        })
        .collect()
}

/// A vertex of the plane's triangulation that remembers the mesh's vertex.
struct PlaneVertex {
    position: Point2<f64>,
    vertex: u32,
}

impl HasPosition for PlaneVertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.position
    }
}

/// The group's polygon, triangulated again; `None` where that fails or gains nothing.
fn triangulate(mesh: &LightMesh, group: &[u32], needed: &[bool]) -> Option<Vec<Face>> {
    if group.len() < 2 {
        return None;
    }
    let area: f64 = group.iter().map(|&f| mesh.area(f as usize)).sum();
    let normal = group.iter().map(|&f| cross_of(mesh.corners(f as usize))).sum::<DVec3>().try_normalize()?;
    let outline = outline(mesh, group, needed)?;
    let cdt = constrained(mesh, &outline, normal)?;
    let faces = inside_faces(&cdt, mesh.faces[*group.first()? as usize]);
    let doubled: f64 =
        faces.iter().map(|f| cross_of(f.vertices.map(|v| mesh.positions[v as usize])).dot(normal)).sum();
    let kept = (0.5 * doubled - area).abs() <= AREA_TOLERANCE * area;
    (kept && !faces.is_empty() && faces.len() <= group.len()).then_some(faces)
}

/// The directed boundary edges of the group between needed vertices; `None` where a boundary has fewer than three of them.
fn outline(mesh: &LightMesh, group: &[u32], needed: &[bool]) -> Option<Vec<[u32; 2]>> {
    let triangles: Vec<[u32; 3]> = group.iter().map(|&f| mesh.faces[f as usize].vertices).collect();
    let boundary: Vec<[u32; 2]> = edges(&edge_uses(&triangles))
        .filter(|uses| uses.len() == 1)
        .map(|uses| {
            let v = triangles[uses[0].triangle as usize];
            [v[usize::from(uses[0].side)], v[(usize::from(uses[0].side) + 1) % 3]]
        })
        .collect();
    let next: FxHashMap<u32, u32> =
        boundary.iter().filter(|e| !needed[e[0] as usize]).map(|e| (e[0], e[1])).collect();
    let mut outline = Vec::new();
    for &[from, mut to] in boundary.iter().filter(|e| needed[e[0] as usize]) {
        for _ in 0..=next.len() {
            match next.get(&to) {
                Some(&further) => to = further,
                None => break,
            }
        }
        if to == from || !needed[to as usize] {
            return None;
        }
        outline.push([from, to]);
    }
    (outline.len() >= 3).then_some(outline)
}

/// The constrained Delaunay triangulation of an outline, in the plane with that normal.
fn constrained(
    mesh: &LightMesh,
    outline: &[[u32; 2]],
    normal: DVec3,
) -> Option<ConstrainedDelaunayTriangulation<PlaneVertex>> {
    let mut corners: Vec<u32> = outline.iter().flatten().copied().collect();
    corners.sort_unstable();
    corners.dedup();
    let (u, v) = normal.any_orthonormal_pair();
    let origin = mesh.positions[*corners.first()? as usize];
    // On a grid, so that rounding does not choose between two diagonals that are equally good: the same scene in another scale is
    // triangulated alike.
    let extent = corners
        .iter()
        .map(|&v| (mesh.positions[v as usize] - origin).abs().max_element())
        .fold(0.0, f64::max);
    let grid = |x: f64| (x / extent * GRID).round();
    let vertices: Vec<PlaneVertex> = corners
        .iter()
        .map(|&vertex| {
            let p = mesh.positions[vertex as usize] - origin;
            // any_orthonormal_pair gives u x v = normal, so counter-clockwise stays so.
            let position = spade::mitigate_underflow(Point2::new(grid(p.dot(u)), grid(p.dot(v))));
            PlaneVertex { position, vertex }
        })
        .collect();
    let index = |vertex: &u32| corners.binary_search(vertex).ok();
    let constraints =
        outline.iter().map(|[a, b]| Some([index(a)?, index(b)?])).collect::<Option<Vec<_>>>()?;
    let mut conflicts = 0;
    let cdt = ConstrainedDelaunayTriangulation::try_bulk_load_cdt(vertices, constraints, |_| conflicts += 1)
        .ok()?;
    (conflicts == 0 && cdt.num_vertices() == corners.len()).then_some(cdt)
}

/// The faces inside the outline: those that an odd number of constraints parts from the outside.
fn inside_faces(cdt: &ConstrainedDelaunayTriangulation<PlaneVertex>, like: Face) -> Vec<Face> {
    let mut parity: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    parity[cdt.outer_face().fix().index()] = Some(false);
    let mut front: Vec<_> = cdt.convex_hull().map(|edge| (edge.fix(), false)).collect();
    while let Some((edge, inside)) = front.pop() {
        let edge = cdt.directed_edge(edge);
        let there = edge.rev().face().fix();
        if parity[there.index()].is_some() {
            continue;
        }
        let inside_there = inside != edge.is_constraint_edge();
        parity[there.index()] = Some(inside_there);
        if let Some(face) = edge.rev().face().as_inner() {
            front.extend(face.adjacent_edges().map(|e| (e.fix(), inside_there)));
        }
    }
    cdt.inner_faces()
        .filter(|face| parity[face.fix().index()] == Some(true))
        .map(|face| Face { vertices: face.vertices().map(|v| v.data().vertex), ..like })
        .collect()
}

//! Triangles of one glTF primitive: read in the mesh's space, deformed, and placed in the world.

use super::material::{UvSource, UvSources};
use super::{Error, Scene, ScenePrimitive};
use glam::{DMat3, DMat4, DVec3, Vec2, Vec3, Vec3Swizzles};
use gltf::Semantic;
use gltf::mesh::Mode;
use vlm_format::GltfFile;

/// Most vertices that a scene may have, unless the caller allows others: beyond, its arrays alone take 2 GiB.
pub(super) const MAX_VERTICES: usize = 1 << 25;

/// Coordinates in world space are at most so large, metres: the fourth power of a length, as in squared areas, is then a number in single
/// precision with room to spare.
pub(super) const FARTHEST: f32 = 1e8;

/// The whole scene is at least so wide, metres. Below, areas and their squares vanish in single precision.
pub(super) const NARROWEST: f64 = 1e-6;

/// A primitive as the file has it, in the mesh's space. All arrays but `triangles` are per vertex.
#[derive(Clone, Debug, Default)]
pub(super) struct LocalMesh {
    pub positions: Vec<Vec3>,
    /// `None` asks for flat shading.
    pub normals: Option<Vec<Vec3>>,
    pub uvs: Option<Vec<Vec2>>,
    pub emissive_uvs: Option<Vec<Vec2>>,
    pub colors: Option<Vec<Vec3>>,
    pub triangles: Vec<[u32; 3]>,
}

/// Where a primitive stands, and what it belongs to.
pub(super) struct Placement {
    pub world_from_local: DMat4,
    /// The triangles turn their other side once placed, so their winding must turn, too.
    pub mirrored: bool,
    pub object: u32,
    pub mesh: u32,
    pub primitive: u32,
    pub material: u32,
}

/// Reads a primitive; `None` if it has no triangles (points, lines, no positions).
///
/// # Errors
/// What the file's accessors are refused for.
pub(super) fn read(
    file: &GltfFile,
    primitive: &gltf::Primitive,
    uvs: &UvSources,
) -> Result<Option<LocalMesh>, vlm_format::Error> {
    let Some(positions) = primitive.get(&Semantic::Positions) else { return Ok(None) };
    let positions = file.read_positions(positions.index())?;
    let count = positions.len();
    let corners = match primitive.indices() {
        Some(indices) => file.read_indices(indices.index(), count)?,
        None => (0..count).filter_map(|i| u32::try_from(i).ok()).collect(),
    };
    let Some(triangles) = triangles(primitive.mode(), &corners) else { return Ok(None) };

    let accessor = |semantic| primitive.get(&semantic).map(|accessor| accessor.index());
    let whole = |length: usize| length == count;
    let normals = accessor(Semantic::Normals).map(|a| file.read_vec3(a)).transpose()?;
    let colors = accessor(Semantic::Colors(0)).map(|a| file.read_colors(a)).transpose()?;
    let texture_uvs = |source: Option<UvSource>| -> Result<Option<Vec<Vec2>>, vlm_format::Error> {
        let Some((source, a)) = source.and_then(|s| Some((s, accessor(Semantic::TexCoords(s.set))?))) else {
            return Ok(None);
        };
        let uvs = file.read_vec2(a)?.into_iter().map(|uv| source.texture_from_vertex.transform_point2(uv));
        Ok(Some(uvs.collect::<Vec<_>>()).filter(|uvs| whole(uvs.len())))
    };
    Ok(Some(LocalMesh {
        uvs: texture_uvs(uvs.base_color)?,
        emissive_uvs: texture_uvs(uvs.emissive)?,
        normals: normals.filter(|normals| whole(normals.len())),
        colors: colors.filter(|colors| whole(colors.len())).map(|colors| {
            colors
                .into_iter()
                .map(|color| finite_or(color.truncate(), Vec3::ONE).clamp(Vec3::ZERO, Vec3::ONE))
                .collect()
        }),
        positions,
        triangles,
    }))
}

/// Lists, strips and fans as triangles of one winding; `None` for points and lines. A rest of one or two is dropped.
fn triangles(mode: Mode, corners: &[u32]) -> Option<Vec<[u32; 3]>> {
    let windows = corners.windows(3).filter_map(|w| <[u32; 3]>::try_from(w).ok());
    match mode {
        Mode::Triangles => Some(corners.chunks_exact(3).filter_map(|c| c.try_into().ok()).collect()),
        // Every other triangle of a strip winds the other way.
        Mode::TriangleStrip => Some(
            windows
                .enumerate()
                .map(|(i, [a, b, c])| if i % 2 == 0 { [a, b, c] } else { [a, c, b] })
                .collect(),
        ),
        Mode::TriangleFan => {
            let (&hub, rim) = corners.split_first()?;
            Some(rim.windows(2).filter_map(|w| Some([*w.first()?, *w.get(1)?, hub])).collect())
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => None,
    }
}

/// Appends a primitive to the scene and returns how many of its triangles were left out because they have no area.
///
/// # Errors
/// [`Error::TooFar`] if the transform takes a vertex beyond [`FARTHEST`], [`Error::TooLarge`] if the scene grows
/// beyond so many vertices.
pub(super) fn place(
    scene: &mut Scene,
    local: &LocalMesh,
    placement: &Placement,
    max_vertices: usize,
    file: &str,
) -> Result<usize, Error> {
    let world = world_positions(local, placement, file)?;
    let kept = |(_, triangle): &(u32, &[u32; 3])| has_area(triangle.map(|v| corner(&world, v)));
    let (in_primitive, mut triangles): (Vec<u32>, Vec<[u32; 3]>) =
        (0..).zip(&local.triangles).filter(kept).map(|(number, &triangle)| (number, triangle)).unzip();
    let degenerate = local.triangles.len() - triangles.len();
    if placement.mirrored {
        triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }

    // Flat shading: no vertex is shared, so that each takes its triangle's normal.
    let source: Vec<u32> = match local.normals {
        Some(_) => (0..).take(world.len()).collect(),
        None => triangles.iter().flatten().copied().collect(),
    };
    if local.normals.is_none() {
        triangles =
            (0..).step_by(3).take(triangles.len()).map(|first: u32| [first, first + 1, first + 2]).collect();
    }
    if scene.positions.len() + source.len() > max_vertices {
        return Err(Error::TooLarge { file: file.to_owned(), limit: max_vertices });
    }
    scene.triangle_in_primitive.extend(in_primitive);
    push(scene, local, &world, &source, &triangles, placement);
    Ok(degenerate)
}

/// The vertices in world space.
///
/// # Errors
/// [`Error::TooFar`] if the transform takes one beyond [`FARTHEST`].
pub(super) fn world_positions(
    local: &LocalMesh,
    placement: &Placement,
    file: &str,
) -> Result<Vec<Vec3>, Error> {
    let place = |p: &Vec3| placement.world_from_local.transform_point3(p.as_dvec3()).as_vec3();
    let world: Vec<Vec3> = local.positions.iter().map(place).collect();
    if world.iter().all(|p| p.is_finite() && p.abs().max_element() <= FARTHEST) {
        return Ok(world);
    }
    Err(Error::TooFar {
        file: file.to_owned(),
        pointer: format!("/meshes/{}/primitives/{}", placement.mesh, placement.primitive),
    })
}

fn push(
    scene: &mut Scene,
    local: &LocalMesh,
    world: &[Vec3],
    source: &[u32],
    triangles: &[[u32; 3]],
    placement: &Placement,
) {
    let first_vertex = scene.positions.len() as u32;
    let first_triangle = scene.triangles.len() as u32;
    scene.positions.extend(source.iter().map(|&v| corner(world, v)));
    push_attribute(&mut scene.vertex_uvs, local.uvs.as_deref(), source, Vec2::ZERO);
    push_attribute(&mut scene.vertex_emissive_uvs, local.emissive_uvs.as_deref(), source, Vec2::ZERO);
    push_attribute(&mut scene.vertex_colors, local.colors.as_deref(), source, Vec3::ONE);
    scene.triangles.extend(triangles.iter().map(|triangle| triangle.map(|v| first_vertex + v)));
    scene.triangle_primitive.resize(scene.triangles.len(), scene.primitives.len() as u32);
    scene.primitives.push(ScenePrimitive {
        object: placement.object,
        mesh: placement.mesh,
        primitive: placement.primitive,
        material: placement.material,
        triangles: [first_triangle, triangles.len() as u32],
        drawn_triangles: local.triangles.len() as u32,
    });
    let positions = scene.positions.get(first_vertex as usize..).unwrap_or_default();
    let normals = world_normals(local, placement, source, positions, triangles);
    scene.vertex_normals.extend(normals);
}

fn push_attribute<T: Copy>(target: &mut Vec<T>, values: Option<&[T]>, source: &[u32], default: T) {
    target.extend(
        source.iter().map(|&v| values.and_then(|values| values.get(v as usize)).copied().unwrap_or(default)),
    );
}

/// The file's normals turned into the world; where it has none (or 0, or no number), the mean of the faces around.
fn world_normals(
    local: &LocalMesh,
    placement: &Placement,
    source: &[u32],
    positions: &[Vec3],
    triangles: &[[u32; 3]],
) -> Vec<Vec3> {
    let world_from_local_normal = normal_matrix(placement.world_from_local);
    let turned = |&v: &u32| {
        let normal = local.normals.as_deref().and_then(|normals| normals.get(v as usize))?;
        (world_from_local_normal * normal.as_dvec3()).try_normalize().map(|n| n.as_vec3())
    };
    let turned: Vec<Option<Vec3>> = source.iter().map(turned).collect();
    if turned.iter().all(Option::is_some) {
        return turned.into_iter().flatten().collect();
    }
    let mut faces = vec![DVec3::ZERO; positions.len()];
    for triangle in triangles {
        let normal = area_normal(triangle.map(|v| corner(positions, v)));
        for &v in triangle {
            if let Some(sum) = faces.get_mut(v as usize) {
                *sum += normal;
            }
        }
    }
    let face = |sum: DVec3| sum.try_normalize().unwrap_or(DVec3::Y).as_vec3();
    turned.into_iter().zip(faces).map(|(normal, sum)| normal.unwrap_or_else(|| face(sum))).collect()
}

/// What turns normals: the inverse transpose up to a positive factor, by cofactors, so that a transform which flattens
/// the mesh has one as well.
pub(super) fn normal_matrix(world_from_local: DMat4) -> DMat3 {
    let [x, y, z] =
        [world_from_local.x_axis, world_from_local.y_axis, world_from_local.z_axis].map(|c| c.truncate());
    let sign = if is_mirrored(world_from_local) { -1.0 } else { 1.0 };
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign
}

/// The transform turns left hands into right ones.
pub(super) fn is_mirrored(world_from_local: DMat4) -> bool {
    let [x, y, z] =
        [world_from_local.x_axis, world_from_local.y_axis, world_from_local.z_axis].map(|c| c.truncate());
    x.cross(y).dot(z) < 0.0
}

/// False if the triangle's area is within the rounding of its coordinates: its normal would be noise.
///
/// With edges u and v whose coordinates err by up to d per axis, u x v errs by up to `(|u| + |v|) x d` with every
/// product taken positive.
fn has_area(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    let edges = (b - a).abs() + (c - a).abs();
    let rounding = a.abs().max(b.abs()).max(c.abs()) * f64::from(f32::EPSILON);
    let noise = edges.yzx() * rounding.zxy() + edges.zxy() * rounding.yzx();
    area_normal(corners).length_squared() > noise.length_squared()
}

/// Normal of a counter-clockwise triangle, as long as twice its area.
fn area_normal([a, b, c]: [Vec3; 3]) -> DVec3 {
    let a = a.as_dvec3();
    (b.as_dvec3() - a).cross(c.as_dvec3() - a)
}

fn corner(positions: &[Vec3], vertex: u32) -> Vec3 {
    positions.get(vertex as usize).copied().unwrap_or_default()
}

fn finite_or(value: Vec3, default: Vec3) -> Vec3 {
    if value.is_finite() { value } else { default }
}

//! Small scenes made in code, with the lights that stand exactly for them: for tests with known answers.

use glam::{DMat4, DVec3, Vec2, Vec3};
use vlm_bake::scene::{
    Camera, Material, Object, Projection, PunctualKind, PunctualLight, Scene, ScenePrimitive, Steering,
};
use vlm_format::{Sample, Vlm, VlmAsset};

/// How far exact lights lie behind the surface, metres: far enough that rounding never puts a point behind a light
/// that should light it, or in front of one that should not.
pub const CLEARANCE: f32 = 1e-4;

/// Triangles with their shading normals.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Corners, metres.
    pub positions: Vec<Vec3>,
    /// Unit normals, one per position.
    pub normals: Vec<Vec3>,
    /// Counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Adds the triangles of another mesh.
    pub fn append(&mut self, other: Self) {
        let first = self.positions.len() as u32;
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + first)));
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
    }
}

/// A parallelogram of `cells * cells` quads that spans `u` and `v` from `corner`; it faces `u x v`.
#[must_use]
pub fn quad(corner: Vec3, u: Vec3, v: Vec3, cells: u32) -> Mesh {
    let side = cells + 1;
    let position = |i: u32| {
        let (s, t) = ((i % side) as f32 / cells as f32, (i / side) as f32 / cells as f32);
        corner + u * s + v * t
    };
    let triangles = (0..cells * cells).flat_map(|i| {
        let first = i % cells + i / cells * side;
        [[first, first + 1, first + side + 1], [first, first + side + 1, first + side]]
    });
    Mesh {
        positions: (0..side * side).map(position).collect(),
        normals: vec![u.cross(v).normalize_or_zero(); (side * side) as usize],
        triangles: triangles.collect(),
    }
}

/// The inside of a sphere: an octahedron whose triangles are split in four `levels` times, pushed onto the sphere.
/// With 4 levels (2,048 triangles) facets lie up to 0.4 % of the radius inside of it.
#[must_use]
pub fn inward_sphere(centre: Vec3, radius: f32, levels: u32) -> Mesh {
    let mut corners: Vec<[Vec3; 3]> = Vec::new();
    for i in 0..8 {
        let sign = |bit: i32| if i & bit == 0 { 1.0 } else { -1.0 };
        let (x, y, z) = (Vec3::X * sign(1), Vec3::Y * sign(2), Vec3::Z * sign(4));
        let inward = x.cross(y).dot(z) < 0.0;
        corners.push(if inward { [x, y, z] } else { [x, z, y] });
    }
    for _ in 0..levels {
        corners = corners.iter().flat_map(split).collect();
    }
    let directions = corners.iter().flatten();
    Mesh {
        positions: directions.clone().map(|d| centre + *d * radius).collect(),
        normals: directions.map(|d| -*d).collect(),
        triangles: (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
    }
}

fn split(&[a, b, c]: &[Vec3; 3]) -> [[Vec3; 3]; 4] {
    let middle = |p: Vec3, q: Vec3| (p + q).normalize_or_zero();
    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// An opaque, one-sided material; change what a test needs.
#[must_use]
pub fn matte(albedo: Vec3) -> Material {
    Material {
        name: "matte".to_owned(),
        base_color: albedo,
        base_color_texture: None,
        emission: Vec3::ZERO,
        emissive_texture: None,
        two_sided: false,
        alpha_cutoff: None,
        alpha_factor: 1.0,
        reflects: true,
    }
}

/// A material that emits radiosity 1 lx (radiance 1/pi nt) and reflects nothing.
#[must_use]
pub fn glowing() -> Material {
    Material { emission: Vec3::splat(std::f32::consts::FRAC_1_PI), ..matte(Vec3::ZERO) }
}

/// Adds a mesh as a node, mesh and primitive of its own.
pub fn add(scene: &mut Scene, mesh: &Mesh, material: Material) {
    let number = scene.objects.len() as u32;
    let first = scene.positions.len() as u32;
    let triangles = [scene.triangles.len() as u32, mesh.triangles.len() as u32];
    let corners = mesh.positions.len();
    scene.positions.extend(&mesh.positions);
    scene.vertex_normals.extend(&mesh.normals);
    scene.vertex_uvs.extend(vec![Vec2::ZERO; corners]);
    scene.vertex_emissive_uvs.extend(vec![Vec2::ZERO; corners]);
    scene.vertex_colors.extend(vec![Vec3::ONE; corners]);
    scene.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + first)));
    scene.triangle_primitive.extend(vec![number; mesh.triangles.len()]);
    scene.triangle_in_primitive.extend(0..mesh.triangles.len() as u32);
    scene.primitives.push(ScenePrimitive {
        object: number,
        mesh: number,
        primitive: 0,
        material: number,
        triangles,
        drawn_triangles: mesh.triangles.len() as u32,
    });
    scene.materials.push(material);
    scene.objects.push(Object {
        node: number,
        path: format!("node {number}"),
        world_from_node: DMat4::IDENTITY,
        steering: Steering::default(),
    });
}

/// A point light of `intensity` cd in every channel.
#[must_use]
pub fn point_light(position: Vec3, intensity: f32) -> PunctualLight {
    PunctualLight {
        kind: PunctualKind::Point,
        position,
        direction: -Vec3::Z,
        intensity: Vec3::splat(intensity),
        range: f32::INFINITY,
    }
}

/// A camera that shows exactly the rectangle of half height `half_height` around `target`, from `distance` metres in
/// front of it; `normal` is the rectangle's and one of the axes.
#[must_use]
pub fn camera_facing(target: Vec3, normal: Vec3, half_height: f32, distance: f32) -> Camera {
    let back = normal.as_dvec3();
    let up = if back.y.abs() > 0.5 { DVec3::NEG_Z } else { DVec3::Y };
    let right = up.cross(back);
    let eye = (target + normal * distance).as_dvec3();
    Camera {
        name: "facing".to_owned(),
        world_from_view: DMat4::from_cols(
            right.extend(0.0),
            up.extend(0.0),
            back.extend(0.0),
            eye.extend(1.0),
        ),
        projection: Projection::Orthographic(half_height),
    }
}

/// One light per triangle, [`CLEARANCE`] behind it, with one sample at its centroid: the best that virtual lights can
/// do without any simplification. Material factors only, no textures.
#[must_use]
pub fn exact_lights(scene: &Scene) -> VlmAsset {
    let mut asset = VlmAsset { sample_starts: vec![0], ..VlmAsset::default() };
    for (&triangle, &primitive) in scene.triangles.iter().zip(&scene.triangle_primitive) {
        let material = &scene.materials[scene.primitives[primitive as usize].material as usize];
        let corners = triangle.map(|i| scene.positions[i as usize]);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        let first = asset.positions.len() as u32;
        asset.positions.extend(corners.map(|p| p - normal * CLEARANCE));
        asset.triangles.push([first, first + 1, first + 2]);
        asset.albedo.push(material.base_color);
        asset.emission.push(material.emission * std::f32::consts::PI);
        asset.samples.push(Sample {
            position: corners.iter().sum::<Vec3>() / 3.0,
            normal,
            reflectance: material.base_color,
        });
        asset.sample_starts.push(asset.samples.len() as u32);
    }
    asset.vlms.push(Vlm {
        id: "exact".to_owned(),
        node: 0,
        lights: [0, asset.triangles.len() as u32],
        vertices: [0, asset.positions.len() as u32],
        authored: false,
    });
    asset
}

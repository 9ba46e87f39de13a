// The visible surface of every pixel. Two entry points for fragments, since one pass may write 32 bytes a pixel: `normals`, and `materials`.

struct Camera {
    clip_from_world: mat4x4f,
    eye: vec3f,
    // 1: alpha masks cut holes.
    cuts_holes: u32,
    forward: vec3f,
    is_perspective: u32,
}

// Four rows: position and u, normal and v, colour and emissive u, emissive v.
struct Vertex {
    position_u: vec4f,
    normal_v: vec4f,
    color_u: vec4f,
    v: vec4f,
}

struct Material {
    // w: alpha factor.
    base_color: vec4f,
    // nt; w: alpha cutoff, or -1.
    emission: vec4f,
    // 1: the base colour texture's alpha is coverage.
    is_masked: u32,
    padding: u32,
    padding_2: u32,
    padding_3: u32,
}

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) normal: vec3f,
    @location(1) @interpolate(flat) geometric_normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) emissive_uv: vec2f,
    @location(4) color: vec3f,
    @location(5) @interpolate(flat) tag: u32,
    @location(6) position: vec3f,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;
// Three vertices and the tag of each triangle.
@group(0) @binding(2) var<storage, read> triangles: array<vec4u>;

@group(1) @binding(0) var<uniform> material: Material;
@group(1) @binding(1) var base_color: texture_2d<f32>;
@group(1) @binding(2) var base_color_sampler: sampler;
@group(1) @binding(3) var emissive: texture_2d<f32>;
@group(1) @binding(4) var emissive_sampler: sampler;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Corner {
    let triangle = triangles[index / 3u];
    let corner = vertices[triangle[index % 3u]];
    let a = vertices[triangle.x].position_u.xyz;
    let b = vertices[triangle.y].position_u.xyz;
    let c = vertices[triangle.z].position_u.xyz;
    let position = corner.position_u.xyz;
    return Corner(
        camera.clip_from_world * vec4f(position, 1.0),
        corner.normal_v.xyz,
        unit(cross(b - a, c - a)),
        vec2f(corner.position_u.w, corner.normal_v.w),
        vec2f(corner.color_u.w, corner.v.x),
        corner.color_u.xyz,
        triangle.w,
        position,
    );
}

struct Normals {
    @location(0) normal: vec4f,
    @location(1) geometric_normal: vec4f,
}

@fragment
fn normals(corner: Corner, @builtin(front_facing) is_front: bool) -> Normals {
    let base = look_up(base_color, base_color_sampler, corner.uv, corner.position, corner.geometric_normal);
    if is_hole(base) {
        discard;
    }
    let side = select(-1.0, 1.0, is_front);
    let squared = dot(corner.normal, corner.normal);
    let has_normal = squared > 0.0 && squared < 1e30;
    let normal = select(corner.geometric_normal, corner.normal / sqrt(squared), has_normal);
    return Normals(vec4f(normal * side, 0.0), vec4f(corner.geometric_normal * side, 0.0));
}

struct Materials {
    @location(0) albedo: vec4f,
    // nt
    @location(1) emission: vec4f,
    @location(2) tag: u32,
}

@fragment
fn materials(corner: Corner) -> Materials {
    let base = look_up(base_color, base_color_sampler, corner.uv, corner.position, corner.geometric_normal);
    let glow = look_up(emissive, emissive_sampler, corner.emissive_uv, corner.position, corner.geometric_normal);
    if is_hole(base) {
        discard;
    }
    let albedo = material.base_color.rgb * base.rgb * corner.color;
    return Materials(vec4f(albedo, 1.0), vec4f(material.emission.rgb * glow.rgb, 1.0), corner.tag);
}

fn unit(v: vec3f) -> vec3f {
    let squared = dot(v, v);
    return select(vec3f(0.0), v / sqrt(squared), squared > 0.0);
}

// The mip level is that of the picture's pixel held across the ray, as the processor's look-up has it: slanted surfaces stay sharp.
fn look_up(map: texture_2d<f32>, map_sampler: sampler, uv: vec2f, position: vec3f, normal: vec3f) -> vec4f {
    let texels = vec2f(textureDimensions(map));
    let right = dpdx(uv * texels);
    let down = dpdy(uv * texels);
    let texels_of_pixel = abs(right.x * down.y - right.y * down.x);
    let away = position - camera.eye;
    let slant = select(abs(dot(camera.forward, normal)), abs(dot(away, normal)) / length(away), camera.is_perspective != 0u);
    let area = max(texels_of_pixel * slant, 1.0);
    return textureSampleLevel(map, map_sampler, uv, 0.5 * log2(area));
}

fn is_hole(base: vec4f) -> bool {
    let cutoff = material.emission.w;
    if camera.cuts_holes == 0u || cutoff < 0.0 {
        return false;
    }
    return select(material.base_color.w < cutoff, base.a < 0.5, material.is_masked != 0u);
}

// Direct light of every pixel, by rays to the lights through a tree over the opaque triangles (`FlatBvh`). No stack: private
// arrays are slow on many devices. After shared/view.wgsl and
// shared/punctual.wgsl.

struct Settings {
    view: View,
    // The lights of this dispatch; sums are kept over dispatches, as software devices stop long loops.
    first_light: u32,
    end_light: u32,
    // Rays start so far before the surface, metres.
    leave_distance: f32,
    node_count: u32,
}

struct Node {
    least: vec3f,
    // Triangles of a leaf; 0 for an inner node.
    count: u32,
    most: vec3f,
    // A leaf's first triangle; for an inner node the number of the node after all that is in it.
    first: u32,
}

// No uniform buffer: software devices compile loops anew for every value that they find in one.
@group(0) @binding(0) var<storage, read> settings: Settings;
@group(0) @binding(1) var<storage, read> real_lights: array<PunctualLight>;
@group(0) @binding(2) var<storage, read> nodes: array<Node>;
// Three corners per triangle.
@group(0) @binding(3) var<storage, read> corners: array<vec4f>;
@group(0) @binding(4) var depths: texture_2d<f32>;
@group(0) @binding(5) var normals: texture_2d<f32>;
@group(0) @binding(6) var geometric_normals: texture_2d<f32>;
// lx, row by row.
@group(0) @binding(7) var<storage, read_write> irradiance: array<vec4f>;

@compute @workgroup_size(8, 8)
fn pixel_light(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(normals);
    if any(id.xy >= size) {
        return;
    }
    let at = id.y * size.x + id.x;
    var sum = vec3f(0.0);
    if settings.first_light > 0u {
        sum = irradiance[at].xyz;
    }
    let normal = textureLoad(normals, id.xy, 0).xyz;
    if dot(normal, normal) > 0.0 {
        let depth = textureLoad(depths, id.xy, 0).r;
        let place = position_at(settings.view, id.xy, size, depth);
        let geometric_normal = textureLoad(geometric_normals, id.xy, 0).xyz;
        for (var light = settings.first_light; light < settings.end_light; light++) {
            sum += arriving(real_lights[light], place, normal, geometric_normal);
        }
    }
    irradiance[at] = vec4f(sum, 0.0);
}

fn arriving(light: PunctualLight, place: vec3f, normal: vec3f, geometric_normal: vec3f) -> vec3f {
    let ray = incident(light, place);
    let cosine = dot(normal, ray.direction);
    let is_lit = cosine > 0.0 && dot(geometric_normal, ray.direction) > 0.0 && any(ray.facing_irradiance > vec3f(0.0));
    if !is_lit {
        return vec3f(0.0);
    }
    let origin = place + geometric_normal * settings.leave_distance;
    var way = ray.direction;
    var most = 3.0e38;
    if light.directional == 0u {
        way = light.position - origin;
        most = 1.0;
    }
    if is_occluded(origin, way, most) {
        return vec3f(0.0);
    }
    return ray.facing_irradiance * cosine;
}

fn is_occluded(origin: vec3f, way: vec3f, most: f32) -> bool {
    // A component of 0 would make 0 times infinity.
    let safe = select(way, vec3f(1e-30), abs(way) < vec3f(1e-30));
    let inverse = 1.0 / safe;
    var at = 0u;
    while at < settings.node_count {
        let node = nodes[at];
        at++;
        if !is_met(node, origin, inverse, most) {
            // What follows an inner node's contents; a leaf has none.
            at = select(at, node.first, node.count == 0u);
            continue;
        }
        for (var i = 0u; i < node.count; i++) {
            if blocks(3u * (node.first + i), origin, way, most) {
                return true;
            }
        }
    }
    return false;
}

fn is_met(node: Node, origin: vec3f, inverse: vec3f, most: f32) -> bool {
    let a = (node.least - origin) * inverse;
    let b = (node.most - origin) * inverse;
    let near = min(a, b);
    let far = max(a, b);
    return max(max(near.x, near.y), max(near.z, 0.0)) <= min(min(far.x, far.y), min(far.z, most));
}

// Möller and Trumbore 1997. Borders block, and a little beyond, so that no light passes where triangles meet.
fn blocks(first: u32, origin: vec3f, way: vec3f, most: f32) -> bool {
    let a = corners[first].xyz;
    let e1 = corners[first + 1u].xyz - a;
    let e2 = corners[first + 2u].xyz - a;
    let p = cross(way, e2);
    let determinant = dot(e1, p);
    if determinant == 0.0 {
        return false;
    }
    let t = origin - a;
    let q = cross(t, e1);
    let u = dot(t, p) / determinant;
    let v = dot(way, q) / determinant;
    let distance = dot(e2, q) / determinant;
    return u >= -1e-6 && v >= -1e-6 && u + v <= 1.000001 && distance > 0.0 && distance < most;
}

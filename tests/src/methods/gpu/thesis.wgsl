// Aquotte 2017 on the graphics card: lists of fixed size by testing every cell against every light, then the textbook form factor of each
// pixel's list. Followed by textbook_polygon.wgsl. Mirror: `ThesisGrid` and `gather` in thesis.rs.

struct Params {
    // Minimum corner of the grid, metres.
    low: vec3f,
    // Cells along each axis.
    cells: u32,
    // Size of a cell, metres.
    cell: vec3f,
    // Entries of each cell's list.
    list: u32,
}

struct Light {
    v0: vec3f,
    tag: u32,
    v1: vec3f,
    // Of the active hemisphere, metres.
    radius: f32,
    v2: vec3f,
    padding: f32,
    normal: vec3f,
    padding_2: f32,
    centre: vec3f,
    padding_3: f32,
}

struct Receiver {
    position: vec3f,
    tag: u32,
    normal: vec3f,
    // 0 where nothing is hit.
    is_hit: u32,
}

// Ends a list that is not full.
const END: u32 = 0xffffffffu;

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
// `params.list` ids per cell, x fastest.
@group(0) @binding(2) var<storage, read_write> lists: array<u32>;
@group(0) @binding(3) var<storage, read> radiosities: array<vec4f>;
@group(0) @binding(4) var<storage, read> receivers: array<Receiver>;
// Irradiance, lx; pairs evaluated.
@group(0) @binding(5) var<storage, read_write> results: array<vec4f>;

fn reaches(light: Light, low: vec3f, high: vec3f) -> bool {
    let away = clamp(light.centre, low, high) - light.centre;
    if dot(away, away) > light.radius * light.radius {
        return false;
    }
    let farthest = select(low, high, light.normal >= vec3f(0.0));
    return dot(light.normal, farthest - light.centre) > 0.0;
}

@compute @workgroup_size(64)
fn build(@builtin(global_invocation_id) id: vec3u) {
    let n = params.cells;
    if id.x >= n * n * n {
        return;
    }
    let cell = vec3f(vec3u(id.x % n, id.x / n % n, id.x / n / n));
    let low = params.low + cell * params.cell;
    let high = low + params.cell;
    var count = 0u;
    for (var light = 0u; light < arrayLength(&lights) && count < params.list; light++) {
        if reaches(lights[light], low, high) {
            lists[id.x * params.list + count] = light;
            count++;
        }
    }
    if count < params.list {
        lists[id.x * params.list + count] = END;
    }
}

fn list_at(position: vec3f) -> u32 {
    let cell = vec3u(max((position - params.low) / params.cell, vec3f(0.0)));
    let inside = min(cell, vec3u(params.cells - 1u));
    return (inside.x + params.cells * (inside.y + params.cells * inside.z)) * params.list;
}

fn edge_term(p: vec3f, q: vec3f, n: vec3f) -> f32 {
    let c = cross(p, q);
    let c_length = length(c);
    if !(c_length > 0.0) {
        return 0.0;
    }
    return acos(clamp(dot(p, q), -1.0, 1.0)) / c_length * dot(n, c);
}

fn form_factor(light: Light, receiver: Receiver) -> f32 {
    return textbook(light.v0, light.v1, light.v2, light.normal, receiver.position, receiver.normal);
}

@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&receivers) {
        return;
    }
    let receiver = receivers[id.x];
    var irradiance = vec3f(0.0);
    var pairs = 0u;
    if receiver.is_hit != 0u {
        let first = list_at(receiver.position);
        for (var i = 0u; i < params.list; i++) {
            let light = lists[first + i];
            if light == END {
                break;
            }
            if lights[light].tag != 0u && lights[light].tag == receiver.tag {
                continue;
            }
            irradiance += radiosities[light].rgb * form_factor(lights[light], receiver);
            pairs++;
        }
    }
    results[id.x] = vec4f(irradiance, bitcast<f32>(pairs));
}

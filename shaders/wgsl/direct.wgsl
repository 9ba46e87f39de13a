// Direct light at the points that phase 1 lights; an invocation per span of points. After shared/punctual.wgsl and
// shared/point.wgsl; mirror: src/cpu/direct.rs.

struct DirectHeader {
    light_count: u32,
    point_count: u32,
    span_count: u32,
    // 0: every point sees every light, and `visibility` is not read.
    has_visibility: u32,
}

// Points `first` to `first + count`, without the latter.
struct Span {
    first: u32,
    count: u32,
}

@group(0) @binding(0) var<uniform> direct_header: DirectHeader;
@group(0) @binding(1) var<storage, read> real_lights: array<PunctualLight>;
// World space: the samples, then the pieces of surface without a light.
@group(0) @binding(2) var<storage, read> points: array<Point>;
// The share of a light that a point sees, `light * point_count + point`.
@group(0) @binding(3) var<storage, read> visibility: array<f32>;
// Those whose light changed.
@group(0) @binding(4) var<storage, read> spans: array<Span>;
// lx; w is not used.
@group(0) @binding(5) var<storage, read_write> irradiance: array<vec4f>;

@compute @workgroup_size(64)
fn direct(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= direct_header.span_count {
        return;
    }
    let span = spans[id.x];
    for (var i = 0u; i < span.count; i++) {
        let point = span.first + i;
        if point < direct_header.point_count {
            irradiance[point] = vec4f(direct_irradiance(point), 0.0);
        }
    }
}

fn direct_irradiance(point: u32) -> vec3f {
    let place = points[point];
    var sum = vec3f(0.0);
    for (var light = 0u; light < direct_header.light_count; light++) {
        let seen = visibility_of(light, point);
        if seen > 0.0 {
            sum += punctual_irradiance(real_lights[light], place.position, place.normal) * seen;
        }
    }
    return sum;
}

fn visibility_of(light: u32, point: u32) -> f32 {
    if direct_header.has_visibility == 0u {
        return 1.0;
    }
    return visibility[light * direct_header.point_count + point];
}

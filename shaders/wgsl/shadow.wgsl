// Which share of a light the points of phase 1 see, by one shadow map; an invocation per point. After shared/point.wgsl and
// shared/shadow_map.wgsl; mirror: src/cpu/shadow.rs.
//
// A light with several maps has a dispatch for each, the last map first: where several hold a point, the first of them counts.

@group(0) @binding(0) var<uniform> map: ShadowHeader;
@group(0) @binding(1) var<storage, read> points: array<Point>;
// Of any depth or float format, in red.
@group(0) @binding(2) var depths: texture_2d<f32>;
// `light * point_count + point`, as `direct` reads it.
@group(0) @binding(3) var<storage, read_write> visibility: array<f32>;

@compute @workgroup_size(64)
fn shadow(@builtin(global_invocation_id) id: vec3u) {
    let point = id.x;
    if point >= map.point_count {
        return;
    }
    let place = points[point];
    let seen = seen(map, place.position, place.normal);
    if seen != NOT_COVERED {
        visibility[map.first + point] = seen;
    } else if map.is_first != 0u {
        visibility[map.first + point] = 1.0;
    }
}

// Leaf and weights of each point: what a pass does before it gathers. After shared/grid.wgsl and shared/blend.wgsl.

struct Point {
    position: vec3f,
    normal: vec3f,
}

struct Place {
    leaf: u32,
    first: u32,
    count: u32,
    weights: array<f32, MOST_PROBES>,
}

@group(2) @binding(0) var<storage, read> points: array<Point>;
@group(2) @binding(1) var<storage, read_write> places: array<Place>;

@compute @workgroup_size(64)
fn find_places(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= min(arrayLength(&points), arrayLength(&places)) {
        return;
    }
    let point = points[id.x];
    let leaf = leaf_at(point.position);
    let blend = blend(leaf, point.position, point.normal);
    places[id.x] = Place(leaf, blend.first, blend.count, blend.weights);
}

// One form factor per case: a light and a receiver each. Appended to shared/form_factor.wgsl.

struct Receiver {
    x: vec3f,
    n_x: f32,
    n_yz: vec2f,
    padding: vec2f,
}

@group(0) @binding(0) var<storage, read> lights: array<LightGeometry>;
@group(0) @binding(1) var<storage, read> receivers: array<Receiver>;
@group(0) @binding(2) var<storage, read_write> results: array<f32>;
// Zero for the exact form alone.
@group(0) @binding(3) var<storage, read> bound: ErrorBound;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= arrayLength(&results) {
        return;
    }
    let x = receivers[i].x;
    let n = vec3f(receivers[i].n_x, receivers[i].n_yz);
    if bound.second_moment > 0.0 {
        results[i] = form_factor_within(lights[i], x, n, bound);
    } else {
        results[i] = form_factor(lights[i], x, n);
    }
}

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

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= arrayLength(&results) {
        return;
    }
    let receiver = receivers[i];
    results[i] = form_factor(lights[i], receiver.x, vec3f(receiver.n_x, receiver.n_yz));
}

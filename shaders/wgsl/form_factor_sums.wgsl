// The sum of all lights' form factors at each receiver: the loop of a gather, without its lists. Appended to
// shared/form_factor.wgsl.

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
    let x = receivers[i].x;
    let n = vec3f(receivers[i].n_x, receivers[i].n_yz);
    var sum = 0.0;
    for (var light = 0u; light < arrayLength(&lights); light++) {
        sum += form_factor(lights[light], x, n);
    }
    results[i] = sum;
}

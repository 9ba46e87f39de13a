// The textbook forms of the form factor on the GPU, by the built-in functions: what the kernel is measured against.
// Appended to shared/form_factor.wgsl and shared/receivers.wgsl, followed by textbook_polygon.wgsl.

// `centroid` chooses the edge's form: 0 acos, 1 atan2, 2 the LTC fit.
@group(0) @binding(3) var<storage, read> bound: ErrorBound;

fn edge_term(p: vec3f, q: vec3f, n: vec3f) -> f32 {
    let c = cross(p, q);
    let cosine = dot(p, q);
    let c_length = length(c);
    if bound.centroid > 1.5 {
        let y = abs(cosine);
        let a = 0.8543985 + (0.4965155 + 0.0145206 * y) * y;
        let b = 3.417594 + (4.1616724 + y) * y;
        let v = a / b;
        let beyond = 0.5 * inverseSqrt(max(1.0 - cosine * cosine, 1e-7)) - v;
        return select(beyond, v, cosine > 0.0) * 6.28318531 * dot(n, c);
    }
    if !(c_length > 0.0) {
        return 0.0;
    }
    var theta = acos(clamp(cosine, -1.0, 1.0));
    if bound.centroid > 0.5 {
        theta = atan2(c_length, cosine);
    }
    return theta / c_length * dot(n, c);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= arrayLength(&results) {
        return;
    }
    let light = lights[i];
    results[i] = textbook(light.v0, light.v1, light.v2, light.normal, receivers[i].x, receiver_normal(i));
}

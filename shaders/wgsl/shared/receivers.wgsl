// Lights, points with normals, and a number per point: what shaders that measure form factors bind.

struct Receiver {
    x: vec3f,
    n_x: f32,
    n_yz: vec2f,
    padding: vec2f,
}

@group(0) @binding(0) var<storage, read> lights: array<LightGeometry>;
@group(0) @binding(1) var<storage, read> receivers: array<Receiver>;
@group(0) @binding(2) var<storage, read_write> results: array<f32>;

fn receiver_normal(i: u32) -> vec3f {
    return vec3f(receivers[i].n_x, receivers[i].n_yz);
}

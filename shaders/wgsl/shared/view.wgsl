// From a pixel's depth to its place, and from irradiance to what a texture of halves holds. Mirror: src/cpu/view.rs.

// The largest finite half.
const LARGEST_HALF: f32 = 65504.0;

struct View {
    // Clip space as WebGPU has it: y up, depth 0 to 1.
    world_from_clip: mat4x4f,
    // Factor of the written irradiance.
    exposure: f32,
    // Depth where nothing was drawn.
    empty_depth: f32,
    padding: f32,
    padding_2: f32,
}

fn position_at(view: View, pixel: vec2u, size: vec2u, depth: f32) -> vec3f {
    let uv = (vec2f(pixel) + 0.5) / vec2f(size);
    let clip = vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, depth, 1.0);
    let world = view.world_from_clip * clip;
    return world.xyz / world.w;
}

fn exposed(view: View, irradiance: vec3f) -> vec3f {
    return min(irradiance * view.exposure, vec3f(LARGEST_HALF));
}

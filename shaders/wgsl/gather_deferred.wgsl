// Phase 2 at every pixel of a G-buffer. After shared/view.wgsl, shared/tag_texture.wgsl (or shared/no_tag_texture.wgsl),
// shared/moving_texture.wgsl (or shared/no_moving_texture.wgsl), shared/count.wgsl (or shared/no_count.wgsl) and one of shared/indirect_*.wgsl.

@group(2) @binding(0) var<uniform> view: View;
@group(2) @binding(1) var depths: texture_2d<f32>;
// World space, of any length; 0 where nothing was drawn.
@group(2) @binding(2) var normals: texture_2d<f32>;
@group(2) @binding(3) var geometric_normals: texture_2d<f32>;
@group(2) @binding(4) var irradiances: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(irradiances);
    if any(id.xy >= size) {
        return;
    }
    let gathered = indirect_at(id.xy, size);
    textureStore(irradiances, id.xy, vec4f(exposed(view, gathered.irradiance), 1.0));
    count(gathered.pairs);
}

fn indirect_at(pixel: vec2u, size: vec2u) -> Gathered {
    let depth = textureLoad(depths, pixel, 0).r;
    let normal = textureLoad(normals, pixel, 0).xyz;
    let geometric_normal = textureLoad(geometric_normals, pixel, 0).xyz;
    let squared = vec2f(dot(normal, normal), dot(geometric_normal, geometric_normal));
    if depth == view.empty_depth || !all(squared > vec2f(0.0)) {
        return Gathered();
    }
    let unit = inverse_lengths(squared);
    return indirect_of(pixel, position_at(view, pixel, size, depth), normal * unit.x, geometric_normal * unit.y);
}

// Exact to rounding, which `inverseSqrt` is not.
fn inverse_lengths(squared: vec2f) -> vec2f {
    return 1.0 / sqrt(squared);
}

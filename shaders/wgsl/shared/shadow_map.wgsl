// The share of a light that a point sees by a shadow map. After the texture `depths` is declared (../shadow.wgsl); mirror:
// src/cpu/shadow.rs, with the derivation of the offsets.

// No map holds the point.
const NOT_COVERED: f32 = -1.0;
// Half the width of a map in clip space, a little over 1 so that no point falls between the maps of a cube.
const EDGE: f32 = 1.0001;

struct ShadowHeader {
    // y up, depth 0 to 1.
    clip_from_world: mat4x4f,
    // Place of the light, metres, and 1; or the direction to it and 0.
    light: vec4f,
    // Texels.
    normal_offset: f32,
    // Metres.
    depth_bias: f32,
    // 1: what is nearer has more depth.
    is_reversed: u32,
    // Where the light's row of the visibility begins.
    first: u32,
    point_count: u32,
    // 1: nothing stands in the row yet.
    is_first: u32,
    padding: u32,
    padding_2: u32,
}

// The share of the light that a point sees, or NOT_COVERED.
fn seen(map: ShadowHeader, position: vec3f, normal: vec3f) -> f32 {
    let to_light = direction_to_light(map, position);
    if dot(to_light, normal) <= 0.0 {
        return 0.0;
    }
    let size = vec2f(textureDimensions(depths));
    let clip = map.clip_from_world * vec4f(biased(map, position, normal, to_light, size), 1.0);
    if !is_covered(clip) {
        return NOT_COVERED;
    }
    let place = clip.xyz / clip.w;
    let texel = (vec2f(0.5, -0.5) * place.xy + 0.5) * size - 0.5;
    return filtered(map, texel, place.z);
}

fn direction_to_light(map: ShadowHeader, position: vec3f) -> vec3f {
    let away = map.light.xyz - position * map.light.w;
    let size = length(away);
    if size > 0.0 {
        return away / size;
    }
    return vec3f(0.0);
}

// The point moved off its surface, so that the surface does not shadow itself.
fn biased(map: ShadowHeader, position: vec3f, normal: vec3f, to_light: vec3f, size: vec2f) -> vec3f {
    let cosine = dot(to_light, normal);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let offset = map.normal_offset * texel_size(map, position, size) * sine;
    return position + normal * offset + to_light * map.depth_bias;
}

// Metres that a texel covers where the point is, across the direction to the light.
fn texel_size(map: ShadowHeader, position: vec3f, size: vec2f) -> f32 {
    let m = transpose(map.clip_from_world);
    let w = dot(m[3], vec4f(position, 1.0));
    let per_texel = vec2f(2.0) / (size * vec2f(length(m[0].xyz), length(m[1].xyz)));
    return max(w, 0.0) * max(per_texel.x, per_texel.y);
}

fn is_covered(clip: vec4f) -> bool {
    let edge = EDGE * clip.w;
    return clip.w > 0.0 && abs(clip.x) <= edge && abs(clip.y) <= edge && clip.z >= 0.0 && clip.z <= clip.w;
}

// Three by three bilinear taps around a place in texels, whose centres are whole numbers: four by four texels, so that the share is continuous.
fn filtered(map: ShadowHeader, texel: vec2f, depth: f32) -> f32 {
    let base = floor(texel);
    let part = texel - base;
    let last = vec2i(textureDimensions(depths)) - 1;
    var sum = 0.0;
    for (var y = 0; y < 4; y++) {
        var row = 0.0;
        for (var x = 0; x < 4; x++) {
            let at = clamp(vec2i(base) + vec2i(x, y) - 1, vec2i(0), last);
            row += tap_weight(x, part.x) * lit(map, textureLoad(depths, at, 0).r, depth);
        }
        sum += tap_weight(y, part.y) * row;
    }
    return sum / 9.0;
}

fn tap_weight(tap: i32, part: f32) -> f32 {
    if tap == 0 {
        return 1.0 - part;
    }
    return select(1.0, part, tap == 3);
}

// 1 where nothing lies before this depth.
fn lit(map: ShadowHeader, stored: f32, depth: f32) -> f32 {
    let is_lit = select(depth <= stored, depth >= stored, map.is_reversed != 0u);
    return select(0.0, 1.0, is_lit);
}

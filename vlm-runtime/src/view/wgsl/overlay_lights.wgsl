// The virtual lights themselves, as lines or filled, over the picture. They lie behind the surface that they stand for: shown where that
// surface is the one that the pixel shows, and faintly or not at all elsewhere.

struct Settings {
    clip_from_world: mat4x4f,
    eye: vec3f,
    // Opacity of what is shown.
    opacity: f32,
    forward: vec3f,
    is_perspective: u32,
    // Where the picture begins in the target, pixels.
    origin: vec2f,
    // Distance at which the reversed depth is 1 (perspective), or at which it is 0 (orthographic), metres.
    depth_scale: f32,
    // Lights farther behind the shown surface than this are hidden, metres.
    reach: f32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var depths: texture_2d<f32>;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) color: vec3f,
    // Metres along the view.
    @location(1) distance: f32,
    // Cosine between the light's normal and the way to the eye.
    @location(2) facing: f32,
}

@vertex
fn vertex(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) color: vec3f) -> Corner {
    let away = position - settings.eye;
    let sight = select(settings.forward, away, settings.is_perspective != 0u);
    let clip = settings.clip_from_world * vec4f(position, 1.0);
    return Corner(clip, color, dot(away, settings.forward), -dot(sight, normal) / length(sight));
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4f {
    let depth = textureLoad(depths, vec2u(corner.clip.xy - settings.origin), 0).r;
    let perspective = settings.depth_scale / max(depth, 1e-20);
    let shown = select((1.0 - depth) * settings.depth_scale, perspective, settings.is_perspective != 0u);
    let behind = corner.distance - shown;
    // Seen at a slant, a light lies farther behind.
    if corner.facing <= 0.0 || behind * max(corner.facing, 0.02) > settings.reach {
        discard;
    }
    return vec4f(corner.color, settings.opacity);
}

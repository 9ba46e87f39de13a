// From light to the shown picture: radiance, or the difference of two, exposed, tone mapped, as sRGB. Mirror of the last steps:
// shaders/src/cpu/resolve.rs.

struct Settings {
    // Where the picture begins in the target, pixels.
    origin: vec2f,
    // Radiance in nt is multiplied by this.
    exposure: f32,
    // 0: the light of the first method; 1: the difference of both.
    shows_difference: u32,
    // Factors of direct and indirect light.
    shares: vec2f,
    // Of the difference.
    gain: f32,
    padding: f32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var albedos: texture_2d<f32>;
@group(0) @binding(2) var emissions: texture_2d<f32>;
@group(0) @binding(3) var<storage, read> direct: array<vec4f>;
@group(0) @binding(4) var first: texture_2d<f32>;
@group(0) @binding(5) var second: texture_2d<f32>;

const PI: f32 = 3.14159265358979;
// sRGB bytes 24, 26, 30.
const BACKGROUND: vec3f = vec3f(24.0, 26.0, 30.0) / 255.0;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index % 2u) * 4.0 - 1.0, f32(index / 2u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fragment(@builtin(position) place: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(place.xy - settings.origin);
    let albedo = textureLoad(albedos, pixel, 0);
    if albedo.a == 0.0 {
        return vec4f(BACKGROUND, 1.0);
    }
    let first_light = textureLoad(first, pixel, 0).rgb;
    if settings.shows_difference != 0u {
        let second_light = textureLoad(second, pixel, 0).rgb;
        let difference = albedo.rgb / PI * (first_light - second_light) * settings.exposure * settings.gain;
        return vec4f(signed(dot(difference, vec3f(0.2126, 0.7152, 0.0722))), 1.0);
    }
    let direct_light = direct[pixel.y * textureDimensions(albedos).x + pixel.x].rgb;
    let irradiance = settings.shares.x * direct_light + settings.shares.y * first_light;
    let radiance = textureLoad(emissions, pixel, 0).rgb + albedo.rgb / PI * irradiance;
    return vec4f(encode_srgb(tone_map(radiance * settings.exposure)), 1.0);
}

// Orange where the first is brighter, blue where the second is, grey between.
fn signed(difference: f32) -> vec3f {
    let strength = sqrt(min(abs(difference), 1.0));
    let hue = select(vec3f(0.2, 0.5, 1.0), vec3f(1.0, 0.55, 0.1), difference > 0.0);
    return mix(vec3f(0.12), hue, strength);
}

// Khronos PBR Neutral tone mapper (2024).
fn tone_map(exposed: vec3f) -> vec3f {
    let start = 0.8 - 0.04;
    var color = max(exposed, vec3f(0.0));
    let darkest = min(color.r, min(color.g, color.b));
    color -= select(0.04, darkest - 6.25 * darkest * darkest, darkest < 0.08);
    let peak = max(color.r, max(color.g, color.b));
    if peak < start {
        return color;
    }
    let d = 1.0 - start;
    let new_peak = 1.0 - d * d / (peak + d - start);
    let share = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
    return mix(color * (new_peak / peak), vec3f(new_peak), share);
}

// IEC 61966-2-1.
fn encode_srgb(color: vec3f) -> vec3f {
    let linear = clamp(color, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(linear, vec3f(1.0 / 2.4)) - 0.055, 12.92 * linear, linear <= vec3f(0.0031308));
}

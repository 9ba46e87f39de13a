// Phase 1: the radiosity of lights and sources, from the direct light on the surface for which they stand; an invocation per light, then
// one per piece of surface without one; or those of `injected` alone. After shared/grid.wgsl; mirror: src/cpu/inject.rs.

struct Sample {
    position: array<f32, 3>,
    normal: array<f32, 3>,
    reflectance: array<f32, 3>,
}

struct Uncovered {
    position: vec3f,
    area: f32,
    normal: vec3f,
    padding: f32,
    reflectance: vec3f,
    padding_2: f32,
    emission: vec3f,
    padding_3: f32,
}

// What a light emits by itself, and the radiosity of its surface over its own.
struct LightSurface {
    emission: vec3f,
    gain: f32,
}

@group(1) @binding(0) var<storage, read> samples: array<Sample>;
@group(1) @binding(1) var<storage, read> uncovered: array<Uncovered>;
// The host's direct light with shadows at the samples, then at the pieces without a light, lx; w is not used.
@group(1) @binding(2) var<storage, read> irradiance: array<vec4f>;
@group(1) @binding(3) var<storage, read> light_surfaces: array<LightSurface>;
@group(1) @binding(4) var<storage, read> sample_shares: array<f32>;
// Of the lights themselves, lx.
@group(1) @binding(5) var<storage, read_write> light_radiosity: array<vec4f>;
// Of the sources: samples, lights, pieces without a light, lx.
@group(1) @binding(6) var<storage, read_write> source_radiosity: array<vec4f>;

@compute @workgroup_size(64)
fn inject(@builtin(global_invocation_id) id: vec3u) {
    let light = listed(header.injected, id.x);
    if light < header.light_count {
        light_sources(light);
        return;
    }
    let piece = light - header.light_count;
    if piece < header.uncovered_count {
        let source = header.sample_count + light;
        source_radiosity[source] = vec4f(uncovered_radiosity(piece), 0.0);
    }
}

fn light_sources(light: u32) {
    let own = radiosity(light);
    light_radiosity[light] = vec4f(own, 0.0);
    let surface = light_surfaces[light];
    source_radiosity[header.sample_count + light] = vec4f(own * surface.gain, 0.0);
    let range = sample_range(light);
    for (var i = range.start; i < min(range.end, header.sample_count); i++) {
        let of_sample = (reflected(i) / sample_shares[i] + surface.emission) * surface.gain;
        source_radiosity[i] = vec4f(of_sample, 0.0);
    }
}

fn reflected(i: u32) -> vec3f {
    return vector(samples[i].reflectance) * irradiance[i].rgb;
}

fn radiosity(light: u32) -> vec3f {
    let range = sample_range(light);
    var own = vec3f(0.0);
    for (var i = range.start; i < min(range.end, header.sample_count); i++) {
        own += reflected(i);
    }
    return light_surfaces[light].emission + own;
}

fn uncovered_radiosity(piece: u32) -> vec3f {
    let direct = irradiance[header.sample_count + piece].rgb;
    return uncovered[piece].reflectance * direct + uncovered[piece].emission;
}

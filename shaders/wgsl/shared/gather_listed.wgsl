// Irradiance by every light of a list, unoccluded. After shared/grid.wgsl, shared/lights.wgsl and shared/tags.wgsl (or
// shared/no_tags.wgsl); mirror: src/cpu/gather.rs.

// Lights summed before they are added to the rest: a plain sum of N numbers errs by up to N/2 roundings.
const SUM_BLOCK: u32 = 64u;

// Phase 1's result, lx; w is not used.
@group(1) @binding(4) var<storage, read> light_radiosity: array<vec4f>;

fn gather_listed(position: vec3f, normal: vec3f, geometric_normal: vec3f, tag: u32) -> Gathered {
    var gathered = Gathered();
    let has_own_horizon = any(geometric_normal != normal);
    let count = min(indices[header.summed], header.light_count);
    for (var start = 0u; start < count; start += SUM_BLOCK) {
        var block = vec3f(0.0);
        for (var i = start; i < min(start + SUM_BLOCK, count); i++) {
            let light = indices[header.summed + 1u + i];
            let radiosity = light_radiosity[light].rgb;
            if all(radiosity == vec3f(0.0)) || is_of_tag(light, tag) {
                continue;
            }
            gathered.pairs++;
            let geometry = lights[light];
            if !(has_own_horizon && is_behind(geometry, position, geometric_normal)) {
                block += radiosity * form_factor(geometry, position, normal);
            }
        }
        gathered.irradiance += block;
    }
    return gathered;
}

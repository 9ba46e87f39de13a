// Irradiance at a point of a surface that stands still. After shared/form_factor.wgsl, shared/lights.wgsl, shared/grid.wgsl,
// shared/blend.wgsl and shared/far.wgsl; mirror: src/cpu/gather_static.rs.

// What `refresh` found.
@group(1) @binding(2) var<storage, read> far: array<FarLight>;
@group(1) @binding(3) var<storage, read> near_radiosities: array<vec4f>;

fn gather_static(position: vec3f, normal: vec3f, geometric_normal: vec3f) -> Gathered {
    let leaf = leaf_at(position);
    if leaf == NO_LEAF {
        return Gathered();
    }
    return gather_in(leaf, position, normal, geometric_normal);
}

// By the probes on surface of this leaf, in which the point need not lie.
fn gather_in(leaf: u32, position: vec3f, normal: vec3f, geometric_normal: vec3f) -> Gathered {
    let blend = blend(leaf, position, normal);
    var gathered = Gathered(far_light(blend, position, normal), 0u);
    // The probes' lists ascend, so each light is met once, with all probes that see it.
    var lists = array<Range, MOST_PROBES>();
    for (var i = 0u; i < blend.count; i++) {
        if blend.weights[i] > 0.0 {
            lists[i] = near_range(probe_of(blend.first, i));
        }
    }
    loop {
        let light = first_light(&lists, blend.count);
        if light == NO_LIGHT {
            break;
        }
        var radiosity = vec3f(0.0);
        for (var i = 0u; i < blend.count; i++) {
            let list = lists[i];
            if list.start < list.end && indices[header.near + list.start] == light {
                radiosity += near_radiosities[list.start].rgb * blend.weights[i];
                lists[i].start++;
            }
        }
        if light >= arrayLength(&lights) || all(radiosity == vec3f(0.0)) {
            continue;
        }
        gathered.pairs++;
        let geometry = lights[light];
        if !is_behind(geometry, position, geometric_normal) {
            gathered.irradiance += radiosity * form_factor(geometry, position, normal);
        }
    }
    return gathered;
}

const NO_LIGHT: u32 = 0xffffffffu;

// The lowest light at the head of the lists.
fn first_light(lists: ptr<function, array<Range, MOST_PROBES>>, count: u32) -> u32 {
    var light = NO_LIGHT;
    for (var i = 0u; i < count; i++) {
        let list = (*lists)[i];
        if list.start < list.end {
            light = min(light, indices[header.near + list.start]);
        }
    }
    return light;
}

fn far_light(blend: Blend, position: vec3f, normal: vec3f) -> vec3f {
    var irradiance = vec3f(0.0);
    for (var i = 0u; i < blend.count; i++) {
        let weight = blend.weights[i];
        let probe = probe_of(blend.first, i);
        if weight > 0.0 && probe < min(arrayLength(&probes), arrayLength(&far)) {
            let place = local(probes[probe], position);
            irradiance += far_irradiance(far[probe], normal, place) * weight;
        }
    }
    return irradiance;
}

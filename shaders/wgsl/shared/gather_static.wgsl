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
    var blend = Blend();
    weigh(&blend, leaf, position, normal);
    var gathered = Gathered();
    // What lies behind the shading normal's own plane gives nothing anyway.
    let has_own_horizon = any(geometric_normal != normal);
    // The probes' lists ascend, so each light is met once, with all probes that see it.
    var lists: Lists;
    lists.count = 0u;
    // Those that count first, as neighbouring pixels then read at the same time.
    var numbers: array<u32, MOST_PROBES>;
    var count = 0u;
    for (var i = 0u; i < blend.count; i++) {
        if blend.weights[i] > 0.0 {
            numbers[count] = probe_of(blend.first, i);
            blend.weights[count] = blend.weights[i];
            count++;
        }
    }
    for (var i = 0u; i < count; i++) {
        gathered.irradiance += far_light(numbers[i], position, normal) * blend.weights[i];
        add_list(&lists, numbers[i], blend.weights[i]);
    }
    var light = NO_LIGHT;
    for (var i = 0u; i < lists.count; i++) {
        light = min(light, lists.heads[i]);
    }
    while light != NO_LIGHT {
        var radiosity = vec3f(0.0);
        var following = NO_LIGHT;
        for (var i = 0u; i < lists.count; i++) {
            if lists.heads[i] == light {
                radiosity += near_radiosities[lists.next[i]].rgb * lists.weights[i];
                lists.next[i]++;
                lists.heads[i] = near_light(lists.next[i], lists.end[i]);
            }
            following = min(following, lists.heads[i]);
        }
        if light < arrayLength(&lights) && any(radiosity != vec3f(0.0)) {
            gathered.pairs++;
            let geometry = lights[light];
            if !(has_own_horizon && is_behind(geometry, position, geometric_normal)) {
                gathered.irradiance += radiosity * form_factor(geometry, position, normal);
            }
        }
        light = following;
    }
    return gathered;
}

const NO_LIGHT: u32 = 0xffffffffu;

// What is left of the near lights of the probes that count.
struct Lists {
    count: u32,
    heads: array<u32, MOST_PROBES>,
    next: array<u32, MOST_PROBES>,
    end: array<u32, MOST_PROBES>,
    weights: array<f32, MOST_PROBES>,
}

fn add_list(lists: ptr<function, Lists>, probe: u32, weight: f32) {
    let range = near_range(probe);
    let head = near_light(range.start, range.end);
    let i = (*lists).count;
    if head != NO_LIGHT && i < MOST_PROBES {
        (*lists).heads[i] = head;
        (*lists).next[i] = range.start;
        (*lists).end[i] = range.end;
        (*lists).weights[i] = weight;
        (*lists).count = i + 1u;
    }
}

// The light of a place among the near lights.
fn near_light(next: u32, end: u32) -> u32 {
    if next >= end {
        return NO_LIGHT;
    }
    let number = near_radiosities[next].w;
    return select(NO_LIGHT, u32(max(number, 0.0)), number >= 0.0);
}

fn far_light(probe: u32, position: vec3f, normal: vec3f) -> vec3f {
    if probe >= min(arrayLength(&probes), arrayLength(&far)) {
        return vec3f(0.0);
    }
    return far_irradiance(far[probe], normal, local(probes[probe], position));
}

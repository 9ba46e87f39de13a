// The weights of a leaf's probes for a point. After shared/grid.wgsl; mirrors: `Probe` in vlm-format/src/grid.rs, src/cpu/grid.rs.

const LEAST_NORMAL_COSINE: f32 = 0.5;
const FIRM: f32 = 0.05;

struct Probe {
    position: vec3f,
    row_scale: f32,
    normal: vec3f,
    reach_up: f32,
    tangent: vec3f,
    reach_down: f32,
    reach: vec4f,
}

struct Blend {
    first: u32,
    count: u32,
    weights: array<f32, MOST_PROBES>,
}

@group(1) @binding(0) var<storage, read> probes: array<Probe>;

fn local(probe: Probe, position: vec3f) -> vec3f {
    let away = position - probe.position;
    let bitangent = cross(probe.normal, probe.tangent);
    return vec3f(dot(away, probe.tangent), dot(away, bitangent), dot(away, probe.normal));
}

fn place_weight(probe: Probe, local: vec3f) -> f32 {
    let w = within(probe, local);
    let product = w.x * w.y * w.z;
    return product * product;
}

fn depth(probe: Probe, local: vec3f) -> f32 {
    let w = within(probe, local);
    return min(w.x, min(w.y, w.z));
}

fn within(probe: Probe, local: vec3f) -> vec3f {
    let against = vec3f(probe.reach.xz, probe.reach_down);
    let along = vec3f(probe.reach.yw, probe.reach_up);
    let c = local / select(along, against, local < vec3f(0.0));
    return max(1.0 - c * c, vec3f(0.0));
}

fn stray_weight(probe: Probe, local: vec3f, normal: vec3f) -> f32 {
    let facing = max(0.5 + 0.5 * dot(normal, probe.normal), 0.0);
    let size = max(max(probe.reach.x, probe.reach.y), max(probe.reach.z, probe.reach.w));
    let away = dot(local, local) / (size * size);
    return (facing * facing + 1e-3) / (1e-2 + away * away);
}

fn normal_weight(probe_normal: vec3f, normal: vec3f) -> f32 {
    let c = clamp((dot(normal, probe_normal) - LEAST_NORMAL_COSINE) / (1.0 - LEAST_NORMAL_COSINE), 0.0, 1.0);
    return c * c;
}

fn blend(leaf: u32, position: vec3f, normal: vec3f) -> Blend {
    var blend = Blend();
    weigh(&blend, leaf, position, normal);
    return blend;
}

// In place, as shaders copy what functions return. Most of a leaf's probes face elsewhere, so that is asked first, and strays only where they
// count.
fn weigh(blend: ptr<function, Blend>, leaf: u32, position: vec3f, normal: vec3f) {
    if !is_leaf(leaf) {
        return;
    }
    let lists = leaf_of(leaf);
    let count = min(lists.free_probes - lists.probes, MOST_PROBES);
    (*blend).first = lists.probes;
    (*blend).count = count;
    var sum = 0.0;
    for (var i = 0u; i < count; i++) {
        let weight = weight_of(probe_of(lists.probes, i), position, normal);
        (*blend).weights[i] = weight;
        sum += weight;
    }
    if !(sum < FIRM) {
        for (var i = 0u; i < count; i++) {
            (*blend).weights[i] *= 1.0 / sum;
        }
        return;
    }
    add_strays(blend, sum, position, normal);
}

fn weight_of(number: u32, position: vec3f, normal: vec3f) -> f32 {
    if number >= arrayLength(&probes) {
        return 0.0;
    }
    let facing = normal_weight(probes[number].normal, normal);
    if !(facing > 0.0) {
        return 0.0;
    }
    let probe = probes[number];
    return facing * place_weight(probe, local(probe, position));
}

// Where reaches end, strays fade in.
fn add_strays(blend: ptr<function, Blend>, sum: f32, position: vec3f, normal: vec3f) {
    var stray_sum = 0.0;
    for (var i = 0u; i < (*blend).count; i++) {
        stray_sum += stray_of(probe_of((*blend).first, i), position, normal);
    }
    var stray_share = max(1.0 - sum / FIRM, 0.0);
    stray_share *= stray_share;
    var inside = 0.0;
    var outside = 0.0;
    if sum > 0.0 {
        inside = (1.0 - stray_share) / sum;
    } else {
        stray_share = 1.0;
    }
    if stray_sum > 0.0 {
        outside = stray_share / stray_sum;
    }
    for (var i = 0u; i < (*blend).count; i++) {
        let stray = stray_of(probe_of((*blend).first, i), position, normal);
        (*blend).weights[i] = (*blend).weights[i] * inside + stray * outside;
    }
}

fn stray_of(number: u32, position: vec3f, normal: vec3f) -> f32 {
    if number >= arrayLength(&probes) {
        return 0.0;
    }
    let probe = probes[number];
    return stray_weight(probe, local(probe, position), normal);
}

// The number of probe `i` of those of a leaf, which begin at `first`.
fn probe_of(first: u32, i: u32) -> u32 {
    return indices[header.leaf_probes + first + i];
}

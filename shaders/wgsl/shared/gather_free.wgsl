// Irradiance at a point of an object that moves. After shared/gather_static.wgsl and shared/free_light.wgsl; mirror:
// src/cpu/gather_free.rs.

const FIRM_DEPTH: f32 = 0.01;
const LEAST_SUM: f32 = 1e-30;
const LEAST_BENT_COSINE: f32 = 0.8;
const FARTHEST: u32 = 16u;

// What `refresh_free` found.
@group(1) @binding(6) var<storage, read> free: array<FreeLight>;

fn gather_free(position: vec3f, normal: vec3f) -> Gathered {
    let leaf = leaf_around(position);
    if leaf == NO_LEAF {
        return Gathered();
    }
    let probes_here = free_probes(leaf);
    if probes_here.start < probes_here.end {
        return Gathered(free_blend(probes_here, position, normal), 0u);
    }
    let bent = bent(leaf, position, normal);
    return gather_in(leaf, position, bent, bent);
}

// The normal turned toward the side that the nearest of the leaf's probes on surface sees.
fn bent(leaf: u32, position: vec3f, normal: vec3f) -> vec3f {
    var nearest = normal;
    var most = 0.0;
    let lists = leaf_of(leaf);
    for (var i = lists.probes; i < lists.free_probes; i++) {
        let number = indices[header.leaf_probes + i];
        if number >= arrayLength(&probes) {
            continue;
        }
        let probe = probes[number];
        let weight = stray_weight(probe, local(probe, position), normal);
        if weight > most {
            nearest = probe.normal;
            most = weight;
        }
    }
    let missing = max(LEAST_BENT_COSINE - dot(normal, nearest), 0.0);
    let bent = normal + nearest * (2.0 * missing);
    let size = length(bent);
    if size > 0.0 {
        return bent / size;
    }
    return nearest;
}

fn free_blend(probes_here: Range, position: vec3f, normal: vec3f) -> vec3f {
    var inside = vec3f(0.0);
    var outside = vec3f(0.0);
    var sum = 0.0;
    var stray_sum = 0.0;
    var deepest = 0.0;
    for (var i = probes_here.start; i < probes_here.end; i++) {
        let number = indices[header.leaf_probes + i];
        if number < header.surface_probes || number >= arrayLength(&probes) {
            continue;
        }
        let light = number - header.surface_probes;
        if light >= arrayLength(&free) {
            continue;
        }
        let probe = probes[number];
        let place = local(probe, position);
        let irradiance = free_irradiance(free[light], normal);
        let weight = place_weight(probe, place);
        let stray = stray_weight(probe, place, probe.normal);
        inside += irradiance * weight;
        outside += irradiance * stray;
        sum += weight;
        stray_sum += stray;
        deepest = max(deepest, depth(probe, place));
    }
    // Where reaches end, strays fade in.
    var stray_share = 1.0;
    var blended = vec3f(0.0);
    if sum > LEAST_SUM {
        stray_share = max(1.0 - deepest / FIRM_DEPTH, 0.0);
        stray_share *= stray_share;
        blended = inside * ((1.0 - stray_share) / sum);
    }
    if stray_sum > 0.0 {
        blended += outside * (stray_share / stray_sum);
    }
    return blended;
}

// The leaf that holds a point, else the next one along an axis.
fn leaf_around(position: vec3f) -> u32 {
    let own = leaf_at(position);
    if has_probes(own) {
        return own;
    }
    for (var cells = 1u; cells <= FARTHEST; cells++) {
        let step = f32(cells) * header.cell_size;
        let away = array(
            vec3f(0.0, -step, 0.0),
            vec3f(step, 0.0, 0.0),
            vec3f(-step, 0.0, 0.0),
            vec3f(0.0, 0.0, step),
            vec3f(0.0, 0.0, -step),
            vec3f(0.0, step, 0.0),
        );
        for (var i = 0u; i < 6u; i++) {
            let leaf = leaf_at(position + away[i]);
            if has_probes(leaf) {
                return leaf;
            }
        }
    }
    return NO_LEAF;
}

fn has_probes(leaf: u32) -> bool {
    if !is_leaf(leaf) {
        return false;
    }
    let lists = leaf_of(leaf);
    let probes_here = free_probes(leaf);
    return lists.probes < lists.free_probes || probes_here.start < probes_here.end;
}

// Where the probes in free space of a leaf are in the leaves' list.
fn free_probes(leaf: u32) -> Range {
    if !is_leaf(leaf) || !is_leaf(leaf + 1u) {
        return Range(0u, 0u);
    }
    return Range(leaf_of(leaf).free_probes, leaf_of(leaf + 1u).probes);
}

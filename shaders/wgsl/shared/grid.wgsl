// The static grid as all passes bind it, and the leaf that holds a point. Mirrors: vlm-format/src/grid.rs, src/cpu/grid.rs.
//
// Vectors that the format packs tightly are arrays of three numbers here, as a vec3f would be padded to 16 bytes.

const MOST_PROBES: u32 = 32u;
const DEEPEST: u32 = 24u;
// In place of a list's length: no list, but all that there are.
const ALL: u32 = 0xffffffffu;
// What `leaf_at` gives where there is no leaf.
const NO_LEAF: u32 = 0xffffffffu;

// Where each of the grid's lists begins in `indices`; the cells begin at 0.
struct GridHeader {
    origin: vec3f,
    cell_size: f32,
    dimensions: vec3u,
    surface_probes: u32,
    leaves: u32,
    leaf_probes: u32,
    near_starts: u32,
    near: u32,
    row_starts: u32,
    sample_starts: u32,
    probe_count: u32,
    near_count: u32,
    light_count: u32,
    sample_count: u32,
    uncovered_count: u32,
    light_tags: u32,
    summed: u32,
    injected: u32,
    refreshed: u32,
    padding: u32,
}

struct Leaf {
    probes: u32,
    free_probes: u32,
}

// The numbers `start` to `end`, without the latter.
struct Range {
    start: u32,
    end: u32,
}

// Bound once per scene: the same group serves every pass.
@group(0) @binding(0) var<uniform> header: GridHeader;
@group(0) @binding(1) var<storage, read> indices: array<u32>;

fn vector(v: array<f32, 3>) -> vec3f {
    return vec3f(v[0], v[1], v[2]);
}

fn leaf_of(number: u32) -> Leaf {
    let at = header.leaves + 2u * number;
    return Leaf(indices[at], indices[at + 1u]);
}

fn is_leaf(number: u32) -> bool {
    return number < (header.leaf_probes - header.leaves) / 2u;
}

fn near_range(probe: u32) -> Range {
    if probe >= header.probe_count {
        return Range(0u, 0u);
    }
    let range = Range(indices[header.near_starts + probe], indices[header.near_starts + probe + 1u]);
    if range.end > header.near_count {
        return Range(0u, 0u);
    }
    return range;
}

// What an invocation works on: its number, or what stands there in the list at `start`, if that has so many.
fn listed(start: u32, number: u32) -> u32 {
    let count = indices[start];
    if count == ALL {
        return number;
    }
    if number >= count {
        return ALL;
    }
    return indices[start + 1u + number];
}

fn sample_range(light: u32) -> Range {
    if light >= header.light_count {
        return Range(0xffffffffu, 0xffffffffu);
    }
    let at = header.sample_starts + light;
    return Range(indices[at], indices[at + 1u]);
}

// Told by their bits, as comparisons with NaN may give anything.
fn is_finite(v: vec3f) -> bool {
    return all((bitcast<vec3u>(v) & vec3u(0x7f800000u)) < vec3u(0x7f800000u));
}

fn leaf_at(x: vec3f) -> u32 {
    let place = (x - header.origin) / header.cell_size;
    // The grid's maximum faces belong to it.
    let is_inside = all(place >= vec3f(0.0)) && all(place <= vec3f(header.dimensions));
    if !is_finite(place) || !is_inside || any(header.dimensions == vec3u(0u)) {
        return NO_LEAF;
    }
    let index = min(vec3u(place), header.dimensions - 1u);
    var within = place - vec3f(index);
    var at = (index.z * header.dimensions.y + index.y) * header.dimensions.x + index.x;
    for (var i = 0u; i < DEEPEST; i++) {
        // The leaves begin where the cells end.
        if at >= header.leaves {
            return NO_LEAF;
        }
        let cell = indices[at];
        if cell % 2u == 1u {
            return cell / 2u;
        }
        if cell == 0u {
            return NO_LEAF;
        }
        within *= 2.0;
        let upper = within >= vec3f(1.0);
        within -= select(vec3f(0.0), vec3f(1.0), upper);
        at = cell / 2u + dot(vec3u(upper), vec3u(1u, 2u, 4u));
    }
    return NO_LEAF;
}

// What share of a probe's light comes from which source, and the sources of a frame. After shared/grid.wgsl; mirror: `Row` in
// vlm-format/src/grid.rs.

struct FarSource {
    centroid: vec3f,
    padding: f32,
    normal: vec3f,
    padding_2: f32,
}

struct Row {
    next: u32,
    end: u32,
    source: u32,
}

@group(1) @binding(1) var<storage, read> rows: array<u32>;
@group(1) @binding(3) var<storage, read> sources: array<FarSource>;
// Of the sources, lx; w is not used.
@group(1) @binding(4) var<storage, read> radiosity: array<vec4f>;

fn row_of(number: u32) -> Row {
    let at = header.row_starts + number;
    return Row(indices[at], indices[at + 1u], 0u);
}

// The weight of a row's next entry and, in `source`, whose it is; 0 after the last.
fn next_weight(row: ptr<function, Row>) -> u32 {
    while (*row).next < (*row).end && (*row).next / 2u < arrayLength(&rows) {
        let word = rows[(*row).next / 2u];
        let entry = (word >> (16u * ((*row).next & 1u))) & 0xffffu;
        (*row).next++;
        let step = entry & 0xffu;
        let weight = entry >> 8u;
        (*row).source += select(step, 256u * step, weight == 0u);
        if weight > 0u {
            return weight;
        }
    }
    return 0u;
}

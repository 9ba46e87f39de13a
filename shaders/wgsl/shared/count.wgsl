// Counts pairs of a pixel and a light: the lower and the upper half of the number.

@group(2) @binding(6) var<storage, read_write> pair_count: array<atomic<u32>, 2>;

fn count(pairs: u32) {
    let before = atomicAdd(&pair_count[0], pairs);
    if before + pairs < before {
        atomicAdd(&pair_count[1], 1u);
    }
}

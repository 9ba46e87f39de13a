// Which lights a receiver ignores, in assets that have tags. After shared/grid.wgsl.

fn is_of_tag(light: u32, tag: u32) -> bool {
    return tag != 0u && indices[header.light_tags + light] == tag;
}

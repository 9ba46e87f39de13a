// The indirect irradiance of what moves, in an asset all of whose lights stand still. After shared/gather_free.wgsl.

fn indirect_moving(position: vec3f, normal: vec3f, geometric_normal: vec3f, tag: u32) -> Gathered {
    return gather_free(position, normal);
}

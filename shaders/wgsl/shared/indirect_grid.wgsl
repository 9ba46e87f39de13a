// The indirect irradiance of an asset with a grid, all of whose lights stand still. After shared/gather_static.wgsl.

fn indirect(position: vec3f, normal: vec3f, geometric_normal: vec3f, tag: u32) -> Gathered {
    return gather_static(position, normal, geometric_normal);
}

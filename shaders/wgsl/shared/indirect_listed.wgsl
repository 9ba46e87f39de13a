// The indirect irradiance of an asset without a grid. After shared/gather_listed.wgsl.

fn indirect(position: vec3f, normal: vec3f, geometric_normal: vec3f, tag: u32) -> Gathered {
    return gather_listed(position, normal, geometric_normal, tag);
}

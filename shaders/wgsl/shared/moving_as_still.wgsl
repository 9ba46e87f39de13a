// The indirect irradiance of what moves, in an asset without probes in free space. After one of shared/indirect_*.wgsl.

fn indirect_moving(position: vec3f, normal: vec3f, geometric_normal: vec3f, tag: u32) -> Gathered {
    return indirect(position, normal, geometric_normal, tag);
}

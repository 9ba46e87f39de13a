// In place of shared/moving_texture.wgsl where there are no probes in free space.

fn indirect_of(pixel: vec2u, position: vec3f, normal: vec3f, geometric_normal: vec3f) -> Gathered {
    return indirect(position, normal, geometric_normal, tag_at(pixel));
}

// The indirect irradiance of a pixel in assets with probes in free space, which light what moves.

// Not 0 where the surface of a pixel moves.
@group(2) @binding(7) var moving: texture_2d<u32>;

fn indirect_of(pixel: vec2u, position: vec3f, normal: vec3f, geometric_normal: vec3f) -> Gathered {
    if textureLoad(moving, pixel, 0).r != 0u {
        return indirect_moving(position, normal, geometric_normal, tag_at(pixel));
    }
    return indirect(position, normal, geometric_normal, tag_at(pixel));
}

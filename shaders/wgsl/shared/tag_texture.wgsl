// The tag of a pixel's surface, in assets that have tags.

@group(2) @binding(5) var surface_tags: texture_2d<u32>;

fn tag_at(pixel: vec2u) -> u32 {
    return textureLoad(surface_tags, pixel, 0).r;
}

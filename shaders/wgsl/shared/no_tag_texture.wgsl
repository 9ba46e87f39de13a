// In place of shared/tag_texture.wgsl where no light has a tag.

fn tag_at(pixel: vec2u) -> u32 {
    return 0u;
}

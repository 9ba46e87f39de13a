// In place of shared/tags.wgsl where no light has a tag.

fn is_of_tag(light: u32, tag: u32) -> bool {
    return false;
}

// The indirect irradiance of what moves, in an asset some of whose lights moved: the list holds those, and the grid has no light of them.
// After shared/gather_free.wgsl and shared/gather_listed.wgsl.

fn indirect_moving(position: vec3f, normal: vec3f, geometric_normal: vec3f, tag: u32) -> Gathered {
    let still = gather_free(position, normal);
    let moved = gather_listed(position, normal, geometric_normal, tag);
    return Gathered(still.irradiance + moved.irradiance, still.pairs + moved.pairs);
}

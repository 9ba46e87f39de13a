// The indirect irradiance of an asset with a grid, some of whose lights moved: the list holds those, and the grid has no light of them.
// After shared/gather_static.wgsl and shared/gather_listed.wgsl.

fn indirect(position: vec3f, normal: vec3f, geometric_normal: vec3f, tag: u32) -> Gathered {
    let still = gather_static(position, normal, geometric_normal);
    let moved = gather_listed(position, normal, geometric_normal, tag);
    return Gathered(still.irradiance + moved.irradiance, still.pairs + moved.pairs);
}

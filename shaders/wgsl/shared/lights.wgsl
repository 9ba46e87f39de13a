// What phase 2 reads of the lights and gives to a point. After shared/form_factor.wgsl; mirror: src/cpu/gather.rs.

struct Gathered {
    irradiance: vec3f,
    // Lights whose geometry was read.
    pairs: u32,
}

// World space, one per light.
@group(1) @binding(1) var<storage, read> lights: array<LightGeometry>;

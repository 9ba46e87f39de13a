// The far light of a probe, and how its near lights are stored. After shared/blend.wgsl; mirrors: `FarLight` and `near_entries` in
// src/cpu/refresh.rs.

// In place of a light's number after the last of a probe's near lights that shine.
const NO_NEAR: f32 = -1.0;

struct FarLight {
    by_normal: array<array<f32, 3>, 3>,
    along: array<array<f32, 3>, 2>,
    padding: f32,
}

fn far_irradiance(far: FarLight, normal: vec3f, local: vec3f) -> vec3f {
    let by_normal = vector(far.by_normal[0]) * normal.x + vector(far.by_normal[1]) * normal.y
        + vector(far.by_normal[2]) * normal.z;
    return max(by_normal + vector(far.along[0]) * local.x + vector(far.along[1]) * local.y, vec3f(0.0));
}

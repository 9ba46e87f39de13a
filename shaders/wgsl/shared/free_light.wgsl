// The light around a probe in free space: irradiance as spherical harmonics up to the second band (Ramamoorthi and Hanrahan 2001).
// Mirror: src/cpu/free_light.rs.

const COEFFICIENTS: u32 = 9u;
const PI: f32 = 3.14159265;
// The clamped cosine, by band.
const COSINE: vec3f = vec3f(PI, 2.0 * PI / 3.0, PI / 4.0);

struct FreeLight {
    // Each red, green, blue in lx, and a number that is not used.
    coefficients: array<vec4f, COEFFICIENTS>,
}

fn free_irradiance(light: FreeLight, normal: vec3f) -> vec3f {
    let harmonics = harmonics(normal);
    var irradiance = vec4f(0.0);
    for (var i = 0u; i < COEFFICIENTS; i++) {
        irradiance += light.coefficients[i] * harmonics[i];
    }
    return max(irradiance.rgb, vec3f(0.0));
}

fn band(coefficient: u32) -> u32 {
    if coefficient == 0u {
        return 0u;
    }
    return select(2u, 1u, coefficient < 4u);
}

fn blur(share: f32) -> vec3f {
    return vec3f(1.0, 1.0 - share, (1.0 - share) * (1.0 - 2.0 * share));
}

fn add(light: ptr<function, FreeLight>, direction: vec3f, share: f32, radiosity: vec3f) {
    let harmonics = harmonics(direction);
    // Radiance is radiosity / pi, the solid angle 4 pi share.
    let strength = radiosity * (4.0 * share);
    let by_band = COSINE * blur(share);
    for (var i = 0u; i < COEFFICIENTS; i++) {
        (*light).coefficients[i] += vec4f(strength * (by_band[band(i)] * harmonics[i]), 0.0);
    }
}

fn harmonics(v: vec3f) -> array<f32, COEFFICIENTS> {
    const C0: f32 = 0.2820948;
    const C1: f32 = 0.4886025;
    const C2: f32 = 1.0925484;
    const C3: f32 = 0.31539157;
    const C4: f32 = 0.5462742;
    return array(
        C0,
        C1 * v.y,
        C1 * v.z,
        C1 * v.x,
        C2 * v.x * v.y,
        C2 * v.y * v.z,
        C3 * (3.0 * v.z * v.z - 1.0),
        C2 * v.x * v.z,
        C4 * (v.x * v.x - v.y * v.y),
    );
}

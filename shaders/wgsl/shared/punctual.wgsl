// Unshadowed irradiance from the lights of KHR_lights_punctual. Mirror: src/cpu/punctual.rs.

struct PunctualLight {
    position: vec3f,
    // 1 over the distance beyond which there is no light, per metre; 0 for none.
    inverse_range: f32,
    direction: vec3f,
    // 1 for lights that shine along `direction` from infinitely far away, else 0.
    directional: u32,
    intensity: vec3f,
    cone_scale: f32,
    cone_offset: f32,
    padding: f32,
    padding_2: f32,
    padding_3: f32,
}

struct Incident {
    // From the point to the light.
    direction: vec3f,
    // Irradiance of a surface that faces the light, lx; 0 where the light does not reach.
    facing_irradiance: vec3f,
}

fn incident(light: PunctualLight, x: vec3f) -> Incident {
    if light.directional != 0u {
        return Incident(-light.direction, light.intensity);
    }
    let to_light = light.position - x;
    let squared = dot(to_light, to_light);
    if !(squared > 0.0) {
        return Incident();
    }
    let distance = sqrt(squared);
    let direction = to_light / distance;
    let falloff = range_window(distance, light.inverse_range) * cone(light, direction) / squared;
    return Incident(direction, light.intensity * falloff);
}

fn punctual_irradiance(light: PunctualLight, x: vec3f, n: vec3f) -> vec3f {
    let arriving = incident(light, x);
    return arriving.facing_irradiance * max(dot(n, arriving.direction), 0.0);
}

fn cone(light: PunctualLight, to_light: vec3f) -> f32 {
    let cosine = -dot(light.direction, to_light);
    let linear = clamp(cosine * light.cone_scale + light.cone_offset, 0.0, 1.0);
    return linear * linear;
}

fn range_window(distance: f32, inverse_range: f32) -> f32 {
    let share = distance * inverse_range;
    let squared = share * share;
    return clamp(1.0 - squared * squared, 0.0, 1.0);
}

// The textbook form factor of a triangle (Baum, Rushmeier, Winget 1989), clipped at the horizon (Sutherland and Hodgman 1974). `edge_term` stands
// in the shader that this is appended to. Mirror: `textbook_form_factor` in textbook.rs.

fn textbook(v0: vec3f, v1: vec3f, v2: vec3f, normal: vec3f, x: vec3f, n: vec3f) -> f32 {
    let r = array<vec3f, 3>(v0 - x, v1 - x, v2 - x);
    if dot(normal, r[0]) >= 0.0 {
        return 0.0;
    }
    var polygon: array<vec3f, 4>;
    var count = 0u;
    for (var i = 0u; i < 3u; i++) {
        let j = (i + 1u) % 3u;
        let z_i = dot(n, r[i]);
        let z_j = dot(n, r[j]);
        if z_i >= 0.0 && count < 4u {
            polygon[count] = normalize(r[i]);
            count++;
        }
        if (z_i >= 0.0) != (z_j >= 0.0) && count < 4u {
            polygon[count] = normalize(r[i] + (r[j] - r[i]) * (z_i / (z_i - z_j)));
            count++;
        }
    }
    var sum = 0.0;
    for (var i = 0u; i < count; i++) {
        sum += edge_term(polygon[i], polygon[(i + 1u) % count], n);
    }
    return clamp(-sum / 6.28318531, 0.0, 1.0);
}

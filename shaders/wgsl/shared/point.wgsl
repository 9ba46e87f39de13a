// A point on the visible surface, world space. Mirror: `Point` in src/cpu/direct.rs.

struct Point {
    position: vec3f,
    padding: f32,
    normal: vec3f,
    padding_2: f32,
}

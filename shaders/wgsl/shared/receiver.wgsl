// A point that is lit. Mirror: `Receiver` in src/cpu/gather.rs.

struct Receiver {
    position: array<f32, 3>,
    normal: array<f32, 3>,
    geometric_normal: array<f32, 3>,
    // Not read: probes know which lights reach them.
    tag: u32,
}

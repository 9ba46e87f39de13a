// Irradiance at a list of points of objects that move; one invocation each. After shared/gather_free.wgsl and shared/receiver.wgsl.

@group(2) @binding(0) var<storage, read> receivers: array<Receiver>;
@group(2) @binding(1) var<storage, read_write> gathered: array<Gathered>;

@compute @workgroup_size(64)
fn gather_moving(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= min(arrayLength(&receivers), arrayLength(&gathered)) {
        return;
    }
    let receiver = receivers[i];
    gathered[i] = gather_free(vector(receiver.position), vector(receiver.normal));
}

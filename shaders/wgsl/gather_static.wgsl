// The static grid's irradiance at a list of receivers; one invocation each. After shared/gather_static.wgsl and shared/receiver.wgsl.

@group(2) @binding(0) var<storage, read> receivers: array<Receiver>;
@group(2) @binding(1) var<storage, read_write> gathered: array<Gathered>;

@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= min(arrayLength(&receivers), arrayLength(&gathered)) {
        return;
    }
    let receiver = receivers[i];
    gathered[i] = gather_static(
        vector(receiver.position), vector(receiver.normal), vector(receiver.geometric_normal),
    );
}

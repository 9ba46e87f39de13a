// The sum of all lights' form factors at each receiver: the loop of a gather, without its lists. Appended to
// shared/form_factor.wgsl and shared/receivers.wgsl.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= arrayLength(&results) {
        return;
    }
    let x = receivers[i].x;
    let n = receiver_normal(i);
    var sum = 0.0;
    for (var light = 0u; light < arrayLength(&lights); light++) {
        sum += form_factor(lights[light], x, n);
    }
    results[i] = sum;
}

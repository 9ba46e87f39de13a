// One form factor per case: a light and a receiver each. Appended to shared/form_factor.wgsl and shared/receivers.wgsl.

// Zero for the exact form alone.
@group(0) @binding(3) var<storage, read> bound: ErrorBound;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= arrayLength(&results) {
        return;
    }
    let x = receivers[i].x;
    let n = receiver_normal(i);
    if bound.second_moment > 0.0 {
        results[i] = form_factor_within(lights[i], x, n, bound);
    } else {
        results[i] = form_factor(lights[i], x, n);
    }
}

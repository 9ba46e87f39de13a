// The light around the probes in free space, from the radiosity of the sources; one invocation per such probe, or per
// probe of `refreshed`. After shared/grid.wgsl,
// shared/blend.wgsl, shared/free_light.wgsl and shared/rows.wgsl; mirror: `free_light` in src/cpu/free_light.rs.
//
// Only for grids that have such probes, and again only where lights changed.

@group(1) @binding(5) var<storage, read_write> free: array<FreeLight>;

@compute @workgroup_size(64)
fn refresh_free(@builtin(global_invocation_id) id: vec3u) {
    var number = header.surface_probes + id.x;
    if indices[header.refreshed] != ALL {
        number = listed(header.refreshed, id.x);
    }
    if number < header.surface_probes || number >= header.probe_count {
        return;
    }
    let place = number - header.surface_probes;
    if place < arrayLength(&free) {
        free[place] = free_light(number);
    }
}

fn free_light(number: u32) -> FreeLight {
    let probe = probes[number];
    var light = FreeLight();
    var row = row_of(number);
    for (var weight = next_weight(&row); weight > 0u; weight = next_weight(&row)) {
        if row.source >= min(arrayLength(&sources), arrayLength(&radiosity)) {
            continue;
        }
        let away = sources[row.source].centroid - probe.position;
        let distance = length(away);
        if distance > 0.0 {
            let share = min(f32(weight) * probe.row_scale, 1.0);
            add(&light, away / distance, share, radiosity[row.source].rgb);
        }
    }
    return light;
}

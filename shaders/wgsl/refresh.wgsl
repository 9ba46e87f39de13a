// What arrives at the probes, from the radiosity of the sources; one invocation per probe, or per probe of
// `refreshed`. After shared/grid.wgsl,
// shared/blend.wgsl, shared/far.wgsl and shared/rows.wgsl; mirror: src/cpu/refresh.rs.
//
// Runs again only where lights changed. Every probe writes its own far light and its own near lights, so invocations share nothing.

const LEAST_COSINE: f32 = 0.2;

@group(1) @binding(2) var<storage, read> near_form_factors: array<f32>;
// One per probe on surface.
@group(1) @binding(5) var<storage, read_write> far: array<FarLight>;
// Room for all near lights of each probe: those that shine, lx, and their number in w, which a float holds exactly up to 2^24; then NO_NEAR.
@group(1) @binding(6) var<storage, read_write> near_radiosities: array<vec4f>;

@compute @workgroup_size(64)
fn refresh(@builtin(global_invocation_id) id: vec3u) {
    let probe = listed(header.refreshed, id.x);
    if probe >= header.probe_count {
        return;
    }
    if probe < header.surface_probes {
        far[probe] = far_light(probe);
    }
    let row_scale = probes[probe].row_scale;
    let range = near_range(probe);
    var place = range.start;
    for (var near = range.start; near < range.end; near++) {
        let arriving = near_radiosity(near, row_scale);
        if any(arriving != vec3f(0.0)) {
            near_radiosities[place] = vec4f(arriving, f32(indices[header.near + near]));
            place++;
        }
    }
    if place < range.end {
        near_radiosities[place] = vec4f(vec3f(0.0), NO_NEAR);
    }
}

fn near_radiosity(number: u32, row_scale: f32) -> vec3f {
    let light = indices[header.near + number];
    let form_factor = near_form_factors[number];
    var row = row_of(header.probe_count + number);
    row.source = sample_range(light).start;
    var irradiance = vec3f(0.0);
    for (var weight = next_weight(&row); weight > 0u; weight = next_weight(&row)) {
        if row.source < arrayLength(&radiosity) {
            irradiance += radiosity[row.source].rgb * f32(weight);
        }
    }
    return irradiance * (row_scale / form_factor);
}

fn far_light(number: u32) -> FarLight {
    let probe = probes[number];
    let bitangent = cross(probe.normal, probe.tangent);
    var by_normal = mat3x3f();
    var along = mat2x3f();
    var row = row_of(number);
    for (var weight = next_weight(&row); weight > 0u; weight = next_weight(&row)) {
        let light = row.source;
        if light >= min(arrayLength(&sources), arrayLength(&radiosity)) {
            continue;
        }
        let source = sources[light];
        let irradiance = radiosity[light].rgb * (f32(weight) * probe.row_scale);
        // `lean . n = 1` at the probe's own normal, so there the irradiance is the row's.
        let lean = lean(probe, source);
        by_normal += mat3x3f(irradiance * lean.x, irradiance * lean.y, irradiance * lean.z);
        let slope = slope(probe, source);
        along += mat2x3f(irradiance * dot(slope, probe.tangent), irradiance * dot(slope, bitangent));
    }
    return FarLight(
        array(packed(by_normal[0]), packed(by_normal[1]), packed(by_normal[2])),
        array(packed(along[0]), packed(along[1])),
        0.0,
    );
}

fn lean(probe: Probe, source: FarSource) -> vec3f {
    let direction = normalize_or_zero(source.centroid - probe.position);
    let cosine = dot(direction, probe.normal);
    return probe.normal + (direction - probe.normal * cosine) / max(cosine, LEAST_COSINE);
}

fn slope(probe: Probe, source: FarSource) -> vec3f {
    let r = source.centroid - probe.position;
    let squared = dot(r, r);
    let facing = min(dot(source.normal, r), -LEAST_COSINE * sqrt(squared));
    let slope = r * (4.0 / squared) - source.normal / facing;
    let most = 4.0 / dot(probe.reach, vec4f(1.0));
    if !(squared > 0.0 && is_finite(slope)) {
        return vec3f(0.0);
    }
    let size = length(slope);
    if size > most {
        return slope * (most / size);
    }
    return slope;
}

fn normalize_or_zero(v: vec3f) -> vec3f {
    let size = length(v);
    if size > 0.0 {
        return v / size;
    }
    return vec3f(0.0);
}

fn packed(v: vec3f) -> array<f32, 3> {
    return array(v.x, v.y, v.z);
}

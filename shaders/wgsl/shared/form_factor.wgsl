// The form factor of a triangular light at a point; derivations stand in the mirror, src/cpu/form_factor/.
//
// No built-in acos, asin, atan or atan2: WGSL lets them err by up to 4096 units in the last place. NaN is told by its bits,
// as `a != a` may be false for it.

const TINY: f32 = 1e-30;
const CLOSEST: f32 = 0.1;
const NEAREST_BY_DIFFERENCES: f32 = 0.25;
const HALF_PI: f32 = 1.57079637;
const INVERSE_PI: f32 = 0.318309886;
const INVERSE_TAU: f32 = 0.159154943;

struct LightGeometry {
    v0: vec3f,
    scale: f32,
    base: vec3f,
    before: f32,
    altitude: vec3f,
    after: f32,
    normal: vec3f,
    altitude_squared: f32,
    v1: vec3f,
    padding_1: f32,
    v2: vec3f,
    padding_2: f32,
}

struct Heights {
    corners: vec3f,
    rises: vec3f,
}

struct FarSum {
    sum: f32,
    is_far: bool,
}

struct Polygon {
    corners: array<vec3f, 4>,
    edges: array<vec3f, 4>,
    share: f32,
    is_quad: bool,
}

struct EdgeWeight {
    inverse: f32,
    excess: f32,
    half_weight: f32,
    is_far: bool,
}

fn form_factor(light: LightGeometry, x: vec3f, n: vec3f) -> f32 {
    let r = (light.v0 - x) * light.scale;
    let h = heights(light, r, n);
    if !(dot(light.normal, r) < 0.0 && any(h.corners > vec3f(0.0))) {
        return 0.0;
    }
    let far = far_triangle(light, r, n);
    if far.is_far && all(h.corners > vec3f(0.0)) {
        return to_unit(far.sum * -INVERSE_TAU);
    }
    return close(light, x, n, h);
}

fn close(light: LightGeometry, x: vec3f, n: vec3f, h: Heights) -> f32 {
    let r0 = (light.v0 - x) * light.scale;
    let r1 = (light.v1 - x) * light.scale;
    let r2 = (light.v2 - x) * light.scale;
    let polygon = clip_at_horizon(light, r0, r1, r2, h);
    return to_unit(polygon_sum(polygon, n, dot(n, light.normal)) * -INVERSE_PI);
}

fn to_unit(x: f32) -> f32 {
    let magnitude = bitcast<u32>(x) & 0x7fffffffu;
    if magnitude > 0x7f800000u || !(x > 0.0) {
        return 0.0;
    }
    return select(1.0, x, x < 1.0);
}

fn arctangent_excess(t: f32) -> f32 {
    var q = 0.00297460523;
    q = q * t - 0.0165812404;
    q = q * t + 0.0435536267;
    q = q * t - 0.0758058519;
    q = q * t + 0.106789434;
    q = q * t - 0.142142099;
    q = q * t + 0.199941373;
    q = q * t - 0.33333167;
    return q * t;
}

fn heights(light: LightGeometry, r: vec3f, n: vec3f) -> Heights {
    let first = dot(n, r);
    let along_base = dot(n, light.base);
    let along_altitude = dot(n, light.altitude);
    let to_second = along_altitude - light.before * along_base;
    let to_third = along_altitude + light.after * along_base;
    return Heights(
        vec3f(first, first + to_second, first + to_third),
        vec3f(to_second, along_base, -to_third),
    );
}

fn far_triangle(light: LightGeometry, r: vec3f, n: vec3f) -> FarSum {
    let r_base = cross(r, light.base);
    let r_altitude = cross(r, light.altitude);
    let c01 = r_altitude - light.before * r_base;
    let c20 = r_altitude + light.after * r_base;
    let c12 = light.normal + r_base;

    let y = dot(r, light.base);
    let h = dot(r, light.altitude);
    let to_foot = h + light.altitude_squared;
    let d = dot(r, r) + h;
    let d01 = d - light.before * y;
    let d20 = d + light.after * y;
    let shares = light.before * light.after;
    let base_squared = dot(light.base, light.base);
    let d12 = ((d01 + d20) - d + to_foot) - shares * base_squared;

    let i01 = 1.0 / d01;
    let i12 = 1.0 / d12;
    let i20 = 1.0 / d20;
    let t01 = dot(c01, c01) * i01 * i01;
    let t12 = dot(c12, c12) * i12 * i12;
    let t20 = dot(c20, c20) * i20 * i20;
    let g01 = arctangent_excess(t01) * i01;
    let g12 = arctangent_excess(t12) * i12;
    let g20 = arctangent_excess(t20) * i20;

    let i01_i20 = i01 * i20;
    let first = y * i01_i20 + (g01 - g20);
    let bend = d * to_foot + shares * (y * y - d * base_squared);
    let bend_g = (g12 - light.after * g20) - light.before * g01;
    let second = bend_g - bend * i12 * i01_i20;

    let tail = dot(n, r_altitude) * first + dot(n, r_base) * second;
    let sum = dot(n, light.normal) * (i12 + g12) + tail;
    let is_far = d01 > CLOSEST && d12 > CLOSEST && d20 > CLOSEST && t01 <= 1.0 && t12 <= 1.0 && t20 <= 1.0;
    return FarSum(sum, is_far);
}

fn share_of(part: f32, whole: f32) -> f32 {
    if !(abs(whole) > 0.0) {
        return select(0.0, 1.0, part * whole > 0.0);
    }
    let t = part / whole;
    return select(0.0, select(1.0, t, t < 1.0), t > 0.0);
}

fn clip_at_horizon(light: LightGeometry, r0: vec3f, r1: vec3f, r2: vec3f, heights: Heights) -> Polygon {
    let e1 = light.altitude - light.base * light.before;
    let e2 = light.altitude + light.base * light.after;
    let e12 = light.base;
    let above = heights.corners > vec3f(0.0);
    let all_above = all(above);
    let second_is_shorter = light.after < light.before;
    let a_is_1 = !all_above && above.y != above.x && above.y != above.z;
    let a_is_2 = (all_above && second_is_shorter) || (!all_above && above.z != above.x && above.z != above.y);

    var ab = e1; var bc = e12; var ca = -e2;
    var a = r0; var b = r1; var c = r2;
    var z_a = heights.corners.x;
    var rises = heights.rises;
    if a_is_1 {
        ab = e12; bc = -e2; ca = e1;
        a = r1; b = r2; c = r0;
        z_a = heights.corners.y;
        rises = heights.rises.yzx;
    }
    if a_is_2 {
        ab = -e2; bc = e1; ca = e12;
        a = r2; b = r0; c = r1;
        z_a = heights.corners.z;
        rises = heights.rises.zxy;
    }

    let is_quad = !(z_a > 0.0);
    var t_b = 1.0;
    var t_c = 1.0;
    if !all_above {
        t_b = share_of(-z_a, rises.x);
        t_c = share_of(z_a, rises.z);
    }
    var from_b = 1.0;
    var from_c = 1.0;
    if t_b > 0.0 { from_b = share_of(z_a + rises.x, rises.x); }
    if t_c > 0.0 { from_c = share_of(rises.z - z_a, rises.z); }
    var t_step = t_c - t_b;
    if t_b < 1.0 && t_c < 1.0 && t_b > 0.0 && t_c > 0.0 { t_step = t_b * (rises.y / rises.z); }
    let h = bc * t_c + t_step * ab;
    let cut_b = a + t_b * ab;
    let cut_c = a - t_c * ca;
    let keeps_bc = is_quad || all_above;
    let share_b = select(t_b, from_b, is_quad);
    let share_c = select(t_c, from_c, is_quad);
    var polygon: Polygon;
    polygon.corners = array<vec3f, 4>(
        select(cut_b, b, keeps_bc),
        select(cut_c, c, keeps_bc),
        select(a, cut_c, is_quad),
        select(a, cut_b, is_quad),
    );
    polygon.edges = array<vec3f, 4>(
        select(h, bc, keeps_bc),
        ca * share_c,
        select(vec3f(0.0), -h, is_quad),
        ab * share_b,
    );
    polygon.share = select(share_b * share_c, (1.0 - share_b) * share_c + share_b, is_quad);
    polygon.is_quad = is_quad;
    return polygon;
}

fn edge_weight(c: vec3f, k: f32) -> EdgeWeight {
    let s = dot(c, c);
    let is_far = s <= k * k;
    let inverse = 1.0 / max(k, TINY);
    let inverse_length = 1.0 / max(sqrt(s), TINY);
    let ratio = select(k * inverse_length, sqrt(s) * inverse, is_far);
    let excess = arctangent_excess(ratio * ratio);
    let excess_far = excess * inverse;
    let half_near = (HALF_PI - (ratio * excess + ratio)) * inverse_length;
    return EdgeWeight(inverse, excess_far, select(half_near, inverse + excess_far, is_far), is_far);
}

// The step from one edge's weight to another's: from edge p-mid to edge mid-s, `d = s - p`.
fn weight_step(from_edge: EdgeWeight, to_edge: EdgeWeight, mid: vec3f, p: vec3f, s: vec3f, d: vec3f) -> f32 {
    let stretch = dot(d, s + p) / max(length(s) + length(p), TINY);
    let k_step = length(mid) * stretch + dot(mid, d);
    return k_step * from_edge.inverse * to_edge.inverse + (from_edge.excess - to_edge.excess);
}

fn polygon_sum(polygon: Polygon, n: vec3f, n_normal: f32) -> f32 {
    let q = polygon.corners;
    let e = polygon.edges;
    let lengths = vec4f(length(q[0]), length(q[1]), length(q[2]), length(q[3]));
    let w0 = edge_weight(cross(q[0], e[0]), lengths.x * lengths.y + dot(q[0], q[1]));
    let w1 = edge_weight(cross(q[1], e[1]), lengths.y * lengths.z + dot(q[1], q[2]));
    let w2 = edge_weight(cross(q[2], e[2]), lengths.z * lengths.w + dot(q[2], q[3]));
    let w3 = edge_weight(cross(q[3], e[3]), lengths.w * lengths.x + dot(q[3], q[0]));
    let flux = vec4f(
        dot(n, cross(q[0], e[0])),
        dot(n, cross(q[1], e[1])),
        dot(n, cross(q[2], e[2])),
        dot(n, cross(q[3], e[3])),
    );
    let nearest = min(min(lengths.x, lengths.y), min(lengths.z, lengths.w));
    if !(nearest > NEAREST_BY_DIFFERENCES && w0.is_far && w1.is_far && w2.is_far && w3.is_far) {
        return w0.half_weight * flux.x + w1.half_weight * flux.y + w2.half_weight * flux.z + w3.half_weight * flux.w;
    }
    let step_01 = weight_step(w0, w1, q[1], q[0], q[2], -(e[2] + e[3]));
    let total = n_normal * polygon.share;
    var sum = w3.half_weight * total + step_01 * flux.x;
    if polygon.is_quad {
        let step_12 = weight_step(w1, w2, q[2], q[1], q[3], e[1] + e[2]);
        let step_23 = weight_step(w2, w3, q[3], q[2], q[0], e[2] + e[3]);
        sum += step_12 * (flux.x + flux.y) + step_23 * (total - flux.w);
    } else {
        let step_13 = weight_step(w1, w3, q[2], q[1], q[0], -e[0]);
        sum += step_13 * (flux.x + flux.y);
    }
    return sum;
}

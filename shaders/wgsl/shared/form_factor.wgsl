// The form factor of a triangular light at a point; derivations stand in the mirror, src/cpu/form_factor/.
//
// No built-in acos, asin, atan or atan2: WGSL lets them err by up to 4096 units in the last place. NaN is told by its bits,
// as `a != a` may be false for it.

const TINY: f32 = 1e-30;
const CLOSEST: f32 = 0.1;
const NEAREST_OVER_AREA: f32 = 0.3;
const NEAREST_EDGE: f32 = 0.12;
const GREATEST_ARGUMENT: f32 = 1.2;
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
    base_squared: f32,
    v2: vec3f,
    padding: f32,
}

struct Heights {
    corners: vec3f,
    rises: vec3f,
}

struct Sum {
    sum: f32,
    is_good: bool,
}

struct FarHalf {
    edge: f32,
    foot: f32,
    step: f32,
    is_small: bool,
}

struct Polygon {
    corners: array<vec3f, 4>,
    edges: array<vec3f, 4>,
    shares: vec2f,
    is_quad: bool,
}

struct Triangle {
    corners: array<vec3f, 3>,
    base: vec3f,
    before: f32,
    altitude: vec3f,
    after: f32,
    normal: vec3f,
    base_squared: f32,
}

struct Apex {
    r: vec3f,
    length: f32,
    altitude: vec3f,
    stretch: f32,
    base: vec3f,
    edge_reach: f32,
    r_altitude: vec3f,
    foot_base: vec3f,
    normal: vec3f,
}

struct NearHalf {
    weight: f32,
    step: f32,
    inverse: f32,
    excess: f32,
    sine: f32,
    is_small: bool,
    is_good: bool,
}

struct HalfAngle {
    angle: f32,
    weight: f32,
}

fn form_factor(light: LightGeometry, x: vec3f, n: vec3f) -> f32 {
    let r = (light.v0 - x) * light.scale;
    let normal_r = dot(light.normal, r);
    let h = heights(light, r, n);
    if !(normal_r < 0.0 && any(h.corners > vec3f(0.0))) {
        return 0.0;
    }
    if !all(h.corners > vec3f(0.0)) {
        return close_clipped(light, x, n);
    }
    let far = far_triangle(light, r, n, h.corners.x, normal_r);
    if far.is_good {
        return to_unit(far.sum * -INVERSE_TAU);
    }
    return close_whole(light, x, n);
}

// The whole light lies behind a surface through `x` with this normal.
fn is_behind(light: LightGeometry, x: vec3f, surface_normal: vec3f) -> bool {
    let r = (light.v0 - x) * light.scale;
    return !any(heights(light, r, surface_normal).corners > vec3f(0.0));
}

fn close_whole(light: LightGeometry, x: vec3f, n: vec3f) -> f32 {
    return to_unit(whole_sum(light, corners_from(light, x), n) * -INVERSE_PI);
}

fn close_clipped(light: LightGeometry, x: vec3f, n: vec3f) -> f32 {
    let corners = corners_from(light, x);
    let polygon = clip_at_horizon(light, corners, heights_from_nearest(light, corners, n));
    return to_unit(polygon_sum(light, polygon, n) * -INVERSE_PI);
}

fn corners_from(light: LightGeometry, x: vec3f) -> array<vec3f, 3> {
    return array<vec3f, 3>(
        (light.v0 - x) * light.scale,
        (light.v1 - x) * light.scale,
        (light.v2 - x) * light.scale,
    );
}

fn to_unit(x: f32) -> f32 {
    let magnitude = bitcast<u32>(x) & 0x7fffffffu;
    if magnitude > 0x7f800000u || !(x > 0.0) {
        return 0.0;
    }
    return select(1.0, x, x < 1.0);
}

fn arctangent_excess(t: f32) -> f32 {
    var q = 0.0005837857;
    q = q * t - 0.0046142703;
    q = q * t + 0.01673454;
    q = q * t - 0.037888978;
    q = q * t + 0.06270793;
    q = q * t - 0.0861641;
    q = q * t + 0.11012069;
    q = q * t - 0.14274228;
    q = q * t + 0.1999941;
    q = q * t - 0.33333325;
    return q * t;
}

// The excess at t, and its divided difference between t and u.
fn excess_and_slope(t: f32, u: f32) -> vec2f {
    var slope = 0.0005837857;
    var q = slope * t - 0.0046142703;
    slope = slope * u + q;
    q = q * t + 0.01673454;
    slope = slope * u + q;
    q = q * t - 0.037888978;
    slope = slope * u + q;
    q = q * t + 0.06270793;
    slope = slope * u + q;
    q = q * t - 0.0861641;
    slope = slope * u + q;
    q = q * t + 0.11012069;
    slope = slope * u + q;
    q = q * t - 0.14274228;
    slope = slope * u + q;
    q = q * t + 0.1999941;
    slope = slope * u + q;
    q = q * t - 0.33333325;
    return vec2f(q * t, slope * u + q);
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

fn heights_from_nearest(light: LightGeometry, corners: array<vec3f, 3>, n: vec3f) -> Heights {
    let from_first = heights(light, corners[0], n);
    let l0 = dot(corners[0], corners[0]);
    let l1 = dot(corners[1], corners[1]);
    let l2 = dot(corners[2], corners[2]);
    let second = l1 < l0 && l1 <= l2;
    let third = l2 < l0 && l2 < l1;
    let z1 = dot(n, corners[1]);
    let z2 = dot(n, corners[2]);
    let z0 = select(z1 - from_first.rises.x, z2 + from_first.rises.z, third);
    let from_nearest = vec3f(z0, select(z0 + from_first.rises.x, z1, second), select(z0 - from_first.rises.z, z2, third));
    let agree = all((from_first.corners > vec3f(0.0)) == (from_nearest > vec3f(0.0)));
    return Heights(select(from_first.corners, from_nearest, agree && (second || third)), from_first.rises);
}

fn far_triangle(light: LightGeometry, r: vec3f, n: vec3f, n_r: f32, normal_r: f32) -> Sum {
    let p = light.before;
    let q = light.after;
    let hh = light.altitude_squared;
    let around = cross(n, r);
    let n_base = dot(around, light.base);
    let n_altitude = dot(around, light.altitude);
    let rho = dot(r, r);
    let y = dot(r, light.base);
    let b = dot(r, light.altitude);
    let to_foot = b + hh;

    let d = rho + b;
    let py = p * y;
    let qy = q * y;
    let d01 = d - py;
    let d20 = d + qy;
    let d1f = d01 + to_foot;
    let df2 = d20 + to_foot;
    let pair_1 = 1.0 / (d01 * d1f);
    let pair_2 = 1.0 / (d20 * df2);
    let i01 = pair_1 * d1f;
    let i1f = pair_1 * d01;
    let i20 = pair_2 * df2;
    let if2 = pair_2 * d20;

    let b_squared = rho * hh - b * b;
    let a_squared = rho * light.base_squared - y * y;
    let rise = light.base_squared * (b + to_foot);
    let away_1 = 2.0 * b * py + b_squared;
    let away_2 = b_squared - 2.0 * b * qy;
    let half_1 = far_half(p * p * a_squared + away_1, p * p * rise - away_1, i01, i1f, pair_1, to_foot);
    let half_2 = far_half(q * q * a_squared + away_2, q * q * rise - away_2, i20, if2, pair_2, to_foot);

    let x = i01 * i20;
    let p_i1f = p * i1f;
    let q_if2 = q * if2;
    let e = (b - py) * (b + qy) - rho * hh;
    let bend = rho * (p_i1f * y) * (q_if2 * y) + e * (p_i1f + q_if2);
    let over_normal = x * bend + (p_i1f * half_1.foot + q_if2 * half_2.foot);
    let over_altitude = half_1.edge * i01 - half_2.edge * i20;
    let steps = p_i1f * half_1.step + q_if2 * half_2.step;
    let tilt = p_i1f * (to_foot - y) + q_if2 * (to_foot + y);
    let width = p_i1f * i01 + q_if2 * i20;
    let over_base = b * x * tilt + (steps - hh * width);

    let rest = dot(n, light.normal) * over_normal + (n_altitude * over_altitude + n_base * over_base);
    let is_far = d01 > CLOSEST && d20 > CLOSEST && d1f > CLOSEST && df2 > CLOSEST;
    return Sum(x * n_r * normal_r + rest, is_far && half_1.is_small && half_2.is_small);
}

fn far_half(s: f32, s_step: f32, i: f32, i_foot: f32, pair: f32, to_foot: f32) -> FarHalf {
    let t = s * (i * i);
    let t_step = s_step * i_foot * i_foot - s * to_foot * (pair * (i + i_foot));
    let t_foot = t + t_step;
    let g = excess_and_slope(t, t_foot);
    let g_step = t_step * g.y;
    return FarHalf(g.x, g.x + g_step, g_step - g.x * to_foot * i, t <= 1.0 && t_foot <= 1.0);
}

fn share_of(part: f32, whole: f32) -> f32 {
    if !(abs(whole) > 0.0) {
        return select(0.0, 1.0, part * whole > 0.0);
    }
    let t = part / whole;
    return select(0.0, select(1.0, t, t < 1.0), t > 0.0);
}

// One or two corners are above the horizon.
fn clip_at_horizon(light: LightGeometry, corners: array<vec3f, 3>, heights: Heights) -> Polygon {
    let e01 = light.altitude - light.base * light.before;
    let e02 = light.altitude + light.base * light.after;
    let e12 = light.base;
    let above = heights.corners > vec3f(0.0);
    let two = (above.x && above.y) || (above.y && above.z) || (above.z && above.x);

    var ab = e01; var bc = e12; var ca = -e02;
    var a = corners[0]; var b = corners[1]; var c = corners[2];
    var z_a = heights.corners.x;
    var rises = heights.rises;
    if above.y != two {
        ab = e12; bc = -e02; ca = e01;
        a = corners[1]; b = corners[2]; c = corners[0];
        z_a = heights.corners.y;
        rises = heights.rises.yzx;
    }
    if above.z != two {
        ab = -e02; bc = e01; ca = e12;
        a = corners[2]; b = corners[0]; c = corners[1];
        z_a = heights.corners.z;
        rises = heights.rises.zxy;
    }

    let t_b = share_of(-z_a, rises.x);
    let t_c = share_of(z_a, rises.z);
    var from_b = 1.0;
    var from_c = 1.0;
    if t_b > 0.0 { from_b = share_of(z_a + rises.x, rises.x); }
    if t_c > 0.0 { from_c = share_of(rises.z - z_a, rises.z); }
    var t_step = t_c - t_b;
    if t_b < 1.0 && t_c < 1.0 && t_b > 0.0 && t_c > 0.0 { t_step = t_b * (rises.y / rises.z); }
    let h = bc * t_c + t_step * ab;
    let cut_b = a + t_b * ab;
    let cut_c = a - t_c * ca;
    let share_b = select(t_b, from_b, two);
    let share_c = select(t_c, from_c, two);
    var polygon: Polygon;
    polygon.corners = array<vec3f, 4>(
        select(cut_b, b, two),
        select(cut_c, c, two),
        select(a, cut_c, two),
        select(a, cut_b, two),
    );
    polygon.edges = array<vec3f, 4>(
        select(h, bc, two),
        ca * share_c,
        select(vec3f(0.0), -h, two),
        ab * share_b,
    );
    polygon.shares = select(vec2f(share_b * share_c, 0.0), vec2f(share_c, t_c * share_b), two);
    polygon.is_quad = two;
    return polygon;
}

fn whole_sum(light: LightGeometry, corners: array<vec3f, 3>, n: vec3f) -> f32 {
    let triangle = Triangle(
        corners, light.base, light.before, light.altitude, light.after, light.normal, light.base_squared,
    );
    let by_differences = triangle_sum(triangle, n);
    if by_differences.is_good {
        return by_differences.sum;
    }
    let e01 = light.altitude - light.base * light.before;
    let e02 = light.altitude + light.base * light.after;
    return plain_edge(corners[0], corners[1], e01, false, n)
        + plain_edge(corners[1], corners[2], light.base, false, n)
        + plain_edge(corners[2], corners[0], -e02, false, n);
}

fn polygon_sum(light: LightGeometry, polygon: Polygon, n: vec3f) -> f32 {
    let q = polygon.corners;
    let e = polygon.edges;
    let is_quad = polygon.is_quad;
    let diagonal = e[0] + e[1];
    let first = triangle_part(light, q[0], q[1], q[2], e[0], e[1], select(e[3], -diagonal, is_quad), polygon.shares.x);
    var by_differences = triangle_sum(first, n);
    if is_quad && by_differences.is_good {
        let second = triangle_part(light, q[0], q[2], q[3], diagonal, e[2], e[3], polygon.shares.y);
        let rest = triangle_sum(second, n);
        by_differences = Sum(by_differences.sum + rest.sum, rest.is_good);
    }
    if by_differences.is_good {
        return by_differences.sum;
    }
    return plain_edge(q[0], q[1], e[0], !is_quad, n)
        + plain_edge(q[1], q[2], e[1], false, n)
        + plain_edge(q[2], q[3], e[2], is_quad, n)
        + plain_edge(q[3], q[0], e[3], false, n);
}

fn triangle_part(
    light: LightGeometry, c0: vec3f, c1: vec3f, c2: vec3f, e0: vec3f, e1: vec3f, e2: vec3f, share: f32,
) -> Triangle {
    let l0 = dot(e0, e0);
    let l1 = dot(e1, e1);
    let l2 = dot(e2, e2);
    var base = e0; var to_apex = e1; var from_apex = e2;
    var corners = array<vec3f, 3>(c2, c0, c1);
    var base_squared = l0;
    if l0 < l2 && l1 < l2 {
        base = e2; to_apex = e0; from_apex = e1;
        corners = array<vec3f, 3>(c1, c2, c0);
        base_squared = l2;
    } else if l0 < l1 {
        base = e1; to_apex = e2; from_apex = e0;
        corners = array<vec3f, 3>(c0, c1, c2);
        base_squared = l1;
    }
    let inverse = 1.0 / max(base_squared, TINY);
    let normal = light.normal * share;
    let before = -dot(from_apex, base) * inverse;
    let after = -dot(to_apex, base) * inverse;
    return Triangle(corners, base, before, cross(base, normal) * inverse, after, normal, base_squared);
}

fn triangle_sum(triangle: Triangle, n: vec3f) -> Sum {
    let r0 = triangle.corners[0];
    let r1 = triangle.corners[1];
    let r2 = triangle.corners[2];
    let p = triangle.before;
    let q = triangle.after;
    let foot = r0 + triangle.altitude;
    let squares = vec4f(dot(r0, r0), dot(r1, r1), dot(r2, r2), dot(foot, foot));
    let lengths = sqrt(squares);
    let r_base = cross(r0, triangle.base);
    let r_altitude = cross(r0, triangle.altitude);
    let area = sqrt(dot(triangle.altitude, triangle.altitude) * triangle.base_squared);
    let reach = area * NEAREST_OVER_AREA;
    let edge_reach = area * NEAREST_EDGE;
    let stretch = dot(triangle.altitude, foot + r0) / max(lengths.w + lengths.x, TINY);
    let apex = Apex(
        r0, lengths.x, triangle.altitude, stretch, triangle.base, edge_reach, r_altitude, r_base + triangle.normal,
        triangle.normal,
    );
    let half_1 = near_half(apex, r1, lengths.y, -p);
    let half_2 = near_half(apex, r2, lengths.z, q);

    var across = half_1.weight - half_2.weight;
    if half_1.is_small && half_2.is_small {
        let spread = dot(triangle.base, r1 + r2) / max(lengths.y + lengths.z, TINY);
        let k_step = lengths.x * spread + dot(r0, triangle.base);
        across = k_step * half_1.inverse * half_2.inverse + (half_1.excess - half_2.excess);
    }
    let steps = p * half_1.step + q * half_2.step;
    let along_base = p * half_1.weight + (q * half_2.weight + steps);
    let sum = dot(n, triangle.normal) * along_base + (dot(n, r_altitude) * across + dot(n, r_base) * steps);
    let is_far = reach < squares.x && reach * half_1.sine < squares.y && reach * half_2.sine < squares.z
        && reach < squares.w;
    return Sum(sum, is_far && half_1.is_good && half_2.is_good);
}

fn near_half(apex: Apex, end: vec3f, end_length: f32, share: f32) -> NearHalf {
    let k_step = end_length * apex.stretch + dot(end, apex.altitude);
    let edge = apex.altitude + share * apex.base;
    let c = cross(select(end, apex.r, apex.length < end_length), edge);
    let c_foot = apex.foot_base * share;
    let c_foot_edge = share * share * dot(apex.base, apex.base);
    let s_0 = dot(c, c);
    let s_step = dot(apex.normal * share - apex.r_altitude, c_foot + c);
    let k_0 = half_angle_k(s_0, apex.length * end_length, dot(apex.r, end));
    let k_foot = max(k_0 + k_step, TINY);
    let s_foot = max(s_0 + s_step, TINY);
    let k = max(k_0, TINY);
    let s = max(s_0, TINY);

    let is_small = s <= k * k && s_foot <= k_foot * k_foot;
    let inverse = 1.0 / select(s, k, is_small);
    let inverse_foot = 1.0 / select(s_foot, k_foot, is_small);
    let i_change = select(k_step * s - k * s_step, -k_step, is_small);
    let i_step = i_change * inverse * inverse_foot;
    let i = select(k * inverse, inverse, is_small);
    let i_foot = select(k_foot * inverse_foot, inverse_foot, is_small);
    let t = select(k * i, s * inverse * inverse, is_small);
    let t_step_small = s_step * i_foot * i_foot + s * i_step * (i + i_foot);
    let t_step = select(k_step * i_foot + k * i_step, t_step_small, is_small);
    let g = excess_and_slope(t, t + t_step);
    let core = g.x * i + i;
    let core_step = i_step * g.x + i_step + i_foot * t_step * g.y;
    let c_length = sqrt(s);
    let foot_length = sqrt(s_foot);
    let right = HALF_PI / c_length;
    let right_step = -right * s_step / (foot_length * (c_length + foot_length));
    let edge_squared = max(dot(edge, edge), TINY);
    let passes_far = apex.edge_reach * edge_squared < s && apex.edge_reach * c_foot_edge < s_foot;
    return NearHalf(
        select(right - core, core, is_small),
        select(right_step - core_step, core_step, is_small),
        inverse,
        g.x * i,
        sqrt(dot(apex.altitude, apex.altitude) / edge_squared),
        is_small,
        t <= GREATEST_ARGUMENT && t + t_step <= GREATEST_ARGUMENT && (is_small || passes_far),
    );
}

fn half_angle_k(s: f32, reach: f32, d: f32) -> f32 {
    return select(reach + d, s / (reach - d), d < 0.0);
}

fn half_angle(s: f32, reach: f32, d: f32) -> HalfAngle {
    let k = half_angle_k(s, reach, d);
    let is_small = s <= k * k;
    let length = sqrt(s);
    let inverse = 1.0 / max(k, TINY);
    let inverse_length = 1.0 / max(length, TINY);
    let ratio = select(k * inverse_length, length * inverse, is_small);
    let excess = arctangent_excess(ratio * ratio);
    let first = ratio * excess + ratio;
    let large = HALF_PI - first;
    return HalfAngle(
        select(large, first, is_small),
        select(large * inverse_length, excess * inverse + inverse, is_small),
    );
}

// One edge of Lambert's sum, from corner p to q.
fn plain_edge(p: vec3f, q: vec3f, edge: vec3f, is_horizon: bool, n: vec3f) -> f32 {
    let p_length = length(p);
    let q_length = length(q);
    let c = cross(select(q, p, p_length < q_length), edge);
    let half = half_angle(dot(c, c), p_length * q_length, dot(p, q));
    return select(half.weight * dot(n, c), -half.angle * length(n), is_horizon);
}

const FADE_START: f32 = 0.7;

struct ErrorBound {
    centroid: f32,
    second_moment: f32,
}

// The light's centroid as seen from the point, light units.
struct Centroid {
    c: vec3f,
    n_c: f32,
    facing: f32,
    inverse_square: f32,
    tau_squared: f32,
}

fn form_factor_within(light: LightGeometry, x: vec3f, n: vec3f, bound: ErrorBound) -> f32 {
    let seen = centroid(light, x, n);
    let exact_share = max(fade(seen.tau_squared, bound.second_moment), horizon_share(seen));
    var cheap = 0.0;
    if exact_share < 1.0 {
        cheap = cheap_form_factor(light, n, seen, bound);
    }
    if exact_share > 0.0 {
        let share = min(exact_share, 1.0);
        cheap = cheap + share * (form_factor(light, x, n) - cheap);
    }
    return to_unit(cheap);
}

fn centroid_form_factor(light: LightGeometry, x: vec3f, n: vec3f) -> f32 {
    return to_unit(first_moment(centroid(light, x, n)));
}

fn second_moment_form_factor(light: LightGeometry, x: vec3f, n: vec3f) -> f32 {
    return to_unit(second_moment(centroid(light, x, n), light, n));
}

fn cheap_form_factor(light: LightGeometry, n: vec3f, seen: Centroid, bound: ErrorBound) -> f32 {
    let share = fade(seen.tau_squared, bound.centroid);
    var result = 0.0;
    if share < 1.0 {
        result = first_moment(seen);
    }
    if share > 0.0 {
        result = result + share * (second_moment(seen, light, n) - result);
    }
    return result;
}

// 0 up to FADE_START of the limit, 1 from the limit on.
fn fade(value: f32, limit: f32) -> f32 {
    let start = FADE_START * limit;
    if !(value > start) {
        return 0.0;
    }
    return min((value - start) / max(limit - start, 1.17549435e-38), 1.0);
}

fn centroid(light: LightGeometry, x: vec3f, n: vec3f) -> Centroid {
    let r = (light.v0 - x) * light.scale;
    let slide = (light.after - light.before) / 3.0;
    let c = r + light.altitude * (2.0 / 3.0) + light.base * slide;
    let inverse_square = 1.0 / dot(c, c);
    return Centroid(
        c, dot(n, c), max(-dot(light.normal, r), 0.0), inverse_square, light.base_squared * inverse_square,
    );
}

// 0 if the light is clear of the horizon, 1 if it may cross it.
fn horizon_share(seen: Centroid) -> f32 {
    let clearance_squared = seen.n_c * seen.n_c * seen.inverse_square;
    if !(clearance_squared > 0.0) {
        return 1.0;
    }
    return fade(seen.tau_squared * (4.0 / 9.0) / clearance_squared, 1.0);
}

fn first_moment(seen: Centroid) -> f32 {
    return seen.facing * max(seen.n_c, 0.0) * seen.inverse_square * seen.inverse_square * INVERSE_TAU;
}

fn second_moment(seen: Centroid, light: LightGeometry, n: vec3f) -> f32 {
    let skew = light.altitude + light.base * (0.5 * (light.after - light.before));
    let c_h = dot(seen.c, skew);
    let c_a = dot(seen.c, light.base);
    let trace = (dot(skew, skew) + 0.75 * light.base_squared) / 18.0;
    let c_cov_c = (c_h * c_h + 0.75 * c_a * c_a) / 18.0;
    let n_cov_c = (dot(n, skew) * c_h + 0.75 * dot(n, light.base) * c_a) / 18.0;
    let i = seen.inverse_square;
    let mean = seen.n_c * (1.0 - 2.0 * trace * i + 12.0 * c_cov_c * i * i) - 4.0 * n_cov_c * i;
    return seen.facing * mean * i * i * INVERSE_TAU;
}

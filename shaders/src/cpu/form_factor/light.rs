//! What the form factor wants to know about a light: made once per light in f64, rounded once.

use glam::{DVec3, Vec3};

/// A one-sided triangular light, 96 bytes, laid out as the GPU reads it; the first 64 serve nearly all receivers.
///
/// Seen from its first corner, which lies opposite the longest edge `base`, the triangle is an altitude and the two parts
/// into which its foot cuts that edge: the other corners are `v0 + altitude - before base` and
/// `v0 + altitude + after base`, `before + after = 1`. Two edges of a thin triangle nearly cancel in every product;
/// `base` and `altitude` are perpendicular and never do.
///
/// All but `v0` are in the light's own unit, `1 / scale` metres: a power of two near its longest edge. In that unit
/// nothing overflows or underflows, whatever the light's size, and the change of unit rounds nothing.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct LightGeometry {
    /// First corner, metres, world space.
    pub v0: Vec3,
    /// Light units per metre, a power of two.
    pub scale: f32,
    /// The longest edge, from the second corner to the third, light units.
    pub base: Vec3,
    /// Share of the base before the foot of the altitude, 0 to 1.
    pub before: f32,
    /// From the first corner to the nearest point of the base, light units.
    pub altitude: Vec3,
    /// Share of the base after the foot of the altitude, 0 to 1.
    pub after: f32,
    /// `altitude x base`: points to the emitting side, twice the area long.
    pub normal: Vec3,
    /// `altitude . altitude`.
    pub altitude_squared: f32,
    /// Second corner, metres, world space. Receivers that nearly touch a corner need it as it is: a sum of edges would be
    /// rounded to the first corner's distance.
    pub v1: Vec3,
    /// `base . base`.
    pub base_squared: f32,
    /// Third corner, metres, world space.
    pub v2: Vec3,
    /// Not used.
    pub padding: f32,
}

impl LightGeometry {
    /// From corners that run counter-clockwise seen from the emitting side, metres.
    ///
    /// Corners that are not finite, or a triangle without area, make a light that lights nothing.
    #[must_use]
    pub fn new(corners: [DVec3; 3]) -> Self {
        let [v0, v1, v2] = opposite_longest_edge(corners);
        let scale = power_of_two_below(1.0 / (v2 - v1).abs().max_element());
        let (e1, e2) = ((v1 - v0) * f64::from(scale), (v2 - v0) * f64::from(scale));
        let base = e2 - e1;
        let base_squared = base.length_squared();
        if !(base_squared > 0.0 && v0.is_finite()) {
            return Self::default();
        }
        let (before, after) = (-e1.dot(base) / base_squared, e2.dot(base) / base_squared);
        // The shorter edge is the more exact way to the foot.
        let altitude = if before < after { e1 + before * base } else { e2 - after * base };
        Self {
            v0: v0.as_vec3(),
            scale,
            base: base.as_vec3(),
            before: before as f32,
            altitude: altitude.as_vec3(),
            after: after as f32,
            normal: e1.cross(e2).as_vec3(),
            altitude_squared: altitude.length_squared() as f32,
            v1: v1.as_vec3(),
            base_squared: base_squared as f32,
            v2: v2.as_vec3(),
            padding: 0.0,
        }
    }

    /// From the first corner to the second and to the third, light units.
    #[must_use]
    #[inline(always)]
    pub fn edges(&self) -> [Vec3; 2] {
        [self.altitude - self.base * self.before, self.altitude + self.base * self.after]
    }

    /// The corners, metres, counter-clockwise seen from the emitting side.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 3] {
        [self.v0, self.v1, self.v2]
    }

    /// The middle, metres.
    #[must_use]
    pub fn centroid(&self) -> Vec3 {
        (self.v0 + self.v1 + self.v2) / 3.0
    }

    /// Length of the longest edge, metres.
    #[must_use]
    pub fn longest_edge(&self) -> f32 {
        self.v1.distance(self.v2)
    }

    /// Square metres.
    #[must_use]
    pub fn area(&self) -> f32 {
        0.5 * self.normal.length() * self.metres() * self.metres()
    }

    /// Metres per light unit.
    fn metres(&self) -> f32 {
        if self.scale > 0.0 { 1.0 / self.scale } else { 0.0 }
    }
}

/// Turns a triangle until its first corner lies opposite the longest edge; the sense of rotation stays.
fn opposite_longest_edge([a, b, c]: [DVec3; 3]) -> [DVec3; 3] {
    let (ab, bc, ca) = (a.distance_squared(b), b.distance_squared(c), c.distance_squared(a));
    if bc >= ab && bc >= ca {
        [a, b, c]
    } else if ca >= ab {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// The largest power of two up to `x` that f32 holds without losing bits, from `2^-126` to `2^126`; 0 for NaN.
fn power_of_two_below(x: f64) -> f32 {
    if x.is_nan() {
        return 0.0;
    }
    let clamped = x.clamp(f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX) / 4.0);
    // Clearing the mantissa of a normal number leaves its power of two.
    f64::from_bits(clamped.to_bits() & !((1 << 52) - 1)) as f32
}

//! Cheaper forms for lights that look small, and the choice between them by an error bound.
//!
//! The integrand of `F = integral of (n.p) (-N.p) / (pi |N| |p|^4) dA` is expanded around the light's centroid `c`: `N.p` is the
//! same all over the light, so with `p = c + u`, mean `u` 0 and covariance `C`,
//! ```text
//! F = (-N.c) / (2 pi |c|^4) [ n.c (1 - 2 tr C / |c|^2 + 12 c.C c / |c|^4) - 4 n.C c / |c|^2 ] + O(tau^3)
//! ```
//! times the uncosined form factor, `tau` the longest edge over `|c|`. The first term alone is the centroid form. A uniform
//! triangle has `C = (e1 e1' + e2 e2' - (e1 e2' + e2 e1') / 2) / 18`, which by base `a`, altitude `h` and
//! `m = (after - before) / 2` is `(h' h'^T + (3/4) a a^T) / 18` with `h' = h + m a`.

use std::f32::consts::TAU;

use glam::Vec3;

use super::light::LightGeometry;
use super::{form_factor, to_unit};

/// Error of the centroid form over `tau^2` and of the second moment over `tau^3`, as shares of the uncosined form factor:
/// upper bounds over the stress test's cases. Lower values would choose the cheap forms sooner and break the promise.
const CENTROID_ERROR: f32 = 0.23;
const SECOND_MOMENT_ERROR: f32 = 0.12;

/// Down to this share of a form's greatest `tau^2` it is used alone; from there it fades into the next, so that a moving
/// light does not jump. Higher values evaluate two forms for fewer lights.
const FADE_START: f32 = 0.7;

/// How large a light may look for each cheap form: made once from the error bound.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ErrorBound {
    /// Greatest `tau^2` of the centroid form.
    pub centroid: f32,
    /// Greatest `tau^2` of the second moment.
    pub second_moment: f32,
}

impl ErrorBound {
    /// `eps` bounds the error of each form factor, as a share of the light's uncosined form factor; 0 is always exact. 1e-3
    /// takes the centroid beyond 15 times the light's size and the exact form below 5.
    #[must_use]
    pub fn new(eps: f32) -> Self {
        let eps = eps.max(0.0);
        Self { centroid: eps / CENTROID_ERROR, second_moment: (eps / SECOND_MOMENT_ERROR).powf(2.0 / 3.0) }
    }
}

/// [`super::form_factor`] by the cheapest form that keeps the error within `bound`.
#[must_use]
pub fn form_factor_within(light: &LightGeometry, x: Vec3, n: Vec3, bound: &ErrorBound) -> f32 {
    let seen = Centroid::new(light, x, n);
    let exact_share = fade(seen.tau_squared, bound.second_moment).max(seen.horizon_share());
    let cheap = if exact_share >= 1.0 { 0.0 } else { cheap_form_factor(light, n, &seen, bound) };
    if exact_share > 0.0 {
        let share = exact_share.min(1.0);
        to_unit(cheap + share * (form_factor(light, x, n) - cheap))
    } else {
        to_unit(cheap)
    }
}

/// `N.n / r^4` at the centroid. The light must be wholly above the horizon, or its part below counts negative.
#[must_use]
pub fn centroid_form_factor(light: &LightGeometry, x: Vec3, n: Vec3) -> f32 {
    to_unit(Centroid::new(light, x, n).first_moment())
}

/// The centroid form and its second-order term. The light must be wholly above the horizon.
#[must_use]
pub fn second_moment_form_factor(light: &LightGeometry, x: Vec3, n: Vec3) -> f32 {
    to_unit(Centroid::new(light, x, n).second_moment(light, n))
}

fn cheap_form_factor(light: &LightGeometry, n: Vec3, seen: &Centroid, bound: &ErrorBound) -> f32 {
    let share = fade(seen.tau_squared, bound.centroid);
    let centroid = if share < 1.0 { seen.first_moment() } else { 0.0 };
    let second = if share > 0.0 { seen.second_moment(light, n) } else { 0.0 };
    centroid + share * (second - centroid)
}

/// 0 up to `FADE_START limit`, 1 from `limit` on.
fn fade(value: f32, limit: f32) -> f32 {
    let start = FADE_START * limit;
    if value > start { ((value - start) / (limit - start).max(f32::MIN_POSITIVE)).min(1.0) } else { 0.0 }
}

/// The light's centroid as seen from the point, light units.
struct Centroid {
    c: Vec3,
    n_c: f32,
    facing: f32,
    inverse_square: f32,
    tau_squared: f32,
}

impl Centroid {
    fn new(light: &LightGeometry, x: Vec3, n: Vec3) -> Self {
        let r = (light.v0 - x) * light.scale;
        let slide = (light.after - light.before) / 3.0;
        let c = r + light.altitude * (2.0 / 3.0) + light.base * slide;
        let inverse_square = 1.0 / c.dot(c);
        Self {
            c,
            n_c: n.dot(c),
            facing: (-light.normal.dot(r)).max(0.0),
            inverse_square,
            tau_squared: light.base_squared * inverse_square,
        }
    }

    /// 0 if the light is clear of the horizon, 1 if it may cross it. A corner is at most 2/3 of the longest edge away
    /// from the centroid.
    fn horizon_share(&self) -> f32 {
        let clearance_squared = self.n_c * self.n_c * self.inverse_square;
        let reach_squared = self.tau_squared * (4.0 / 9.0);
        if clearance_squared > 0.0 { fade(reach_squared / clearance_squared, 1.0) } else { 1.0 }
    }

    fn first_moment(&self) -> f32 {
        self.facing * self.n_c.max(0.0) * self.inverse_square * self.inverse_square / TAU
    }

    fn second_moment(&self, light: &LightGeometry, n: Vec3) -> f32 {
        let skew = light.altitude + light.base * (0.5 * (light.after - light.before));
        let (c_h, c_a) = (self.c.dot(skew), self.c.dot(light.base));
        let (n_h, n_a) = (n.dot(skew), n.dot(light.base));
        let trace = (skew.dot(skew) + 0.75 * light.base_squared) / 18.0;
        let c_cov_c = (c_h * c_h + 0.75 * c_a * c_a) / 18.0;
        let n_cov_c = (n_h * c_h + 0.75 * n_a * c_a) / 18.0;
        let i = self.inverse_square;
        let mean = self.n_c * (1.0 - 2.0 * trace * i + 12.0 * c_cov_c * i * i) - 4.0 * n_cov_c * i;
        self.facing * mean * i * i / TAU
    }
}

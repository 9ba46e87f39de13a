//! The shaders' source, put together from `wgsl/` and `wgsl/shared/`. What each pass binds stands in the crate's README.

/// Functions that other shaders use: the form factor.
pub const FORM_FACTOR: &str = include_str!("../wgsl/shared/form_factor.wgsl");

/// Bindings of the shaders that measure form factors; after [`FORM_FACTOR`].
pub const RECEIVERS: &str = include_str!("../wgsl/shared/receivers.wgsl");

/// The static grid: bind group 0 of every pass, and the leaf that holds a point.
pub const GRID: &str = include_str!("../wgsl/shared/grid.wgsl");

/// Probes and their weights for a point; after [`GRID`].
pub const BLEND: &str = include_str!("../wgsl/shared/blend.wgsl");

/// A probe's far light; after [`BLEND`].
pub const FAR: &str = include_str!("../wgsl/shared/far.wgsl");

/// The function `gather_static` with its bindings, for shaders that light pixels; after [`FORM_FACTOR`], [`GRID`], [`BLEND`] and
/// [`FAR`].
pub const GATHER_STATIC: &str = include_str!("../wgsl/shared/gather_static.wgsl");

/// The rows of probes; after [`GRID`].
const ROWS: &str = include_str!("../wgsl/shared/rows.wgsl");

/// A point that is lit.
const RECEIVER: &str = include_str!("../wgsl/shared/receiver.wgsl");

/// The light around a probe in free space.
pub const FREE_LIGHT: &str = include_str!("../wgsl/shared/free_light.wgsl");

/// The function `gather_free` with its bindings, for shaders that light what moves; after [`GATHER_STATIC`] and [`FREE_LIGHT`].
pub const GATHER_FREE: &str = include_str!("../wgsl/shared/gather_free.wgsl");

/// A compute shader that finds one form factor per case; entry point `main`, 64 invocations per workgroup.
#[must_use]
pub fn form_factor_cases() -> String {
    format!("{FORM_FACTOR}\n{RECEIVERS}\n{}", include_str!("../wgsl/form_factor_cases.wgsl"))
}

/// A compute shader that sums the form factors of all lights at each receiver; entry point `main`, 64 invocations per
/// workgroup. Software devices stop loops after 65,535 rounds, so more lights need several dispatches.
#[must_use]
pub fn form_factor_sums() -> String {
    format!("{FORM_FACTOR}\n{RECEIVERS}\n{}", include_str!("../wgsl/form_factor_sums.wgsl"))
}

/// Phase 1: the radiosity of lights and sources; entry point `inject`, 64 invocations per workgroup, one per light and one per piece
/// of surface without one.
#[must_use]
pub fn inject() -> String {
    format!("{GRID}\n{}", include_str!("../wgsl/inject.wgsl"))
}

/// What arrives at the probes; entry point `refresh`, 64 invocations per workgroup, one per probe.
#[must_use]
pub fn refresh() -> String {
    format!("{GRID}\n{BLEND}\n{FAR}\n{ROWS}\n{}", include_str!("../wgsl/refresh.wgsl"))
}

/// What arrives at the probes in free space; entry point `refresh_free`, 64 invocations per workgroup, one per such probe.
#[must_use]
pub fn refresh_free() -> String {
    format!("{GRID}\n{BLEND}\n{FREE_LIGHT}\n{ROWS}\n{}", include_str!("../wgsl/refresh_free.wgsl"))
}

/// Phase 2 by the static grid at a list of receivers; entry point `gather`, 64 invocations per workgroup, one per receiver.
#[must_use]
pub fn gather_static() -> String {
    let receivers = include_str!("../wgsl/gather_static.wgsl");
    format!("{FORM_FACTOR}\n{GRID}\n{BLEND}\n{FAR}\n{GATHER_STATIC}\n{RECEIVER}\n{receivers}")
}

/// Phase 2 at a list of receivers that move; entry point `gather_moving`, 64 invocations per workgroup, one per receiver.
#[must_use]
pub fn gather_free() -> String {
    let receivers = include_str!("../wgsl/gather_free.wgsl");
    let gather = format!("{GATHER_STATIC}\n{FREE_LIGHT}\n{GATHER_FREE}");
    format!("{FORM_FACTOR}\n{GRID}\n{BLEND}\n{FAR}\n{gather}\n{RECEIVER}\n{receivers}")
}

/// Every shader with its name.
#[must_use]
pub fn all() -> [(&'static str, String); 7] {
    [
        ("form_factor_cases", form_factor_cases()),
        ("form_factor_sums", form_factor_sums()),
        ("inject", inject()),
        ("refresh", refresh()),
        ("refresh_free", refresh_free()),
        ("gather_static", gather_static()),
        ("gather_free", gather_free()),
    ]
}

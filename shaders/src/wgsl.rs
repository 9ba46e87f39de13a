//! The shaders' source, put together from `wgsl/` and `wgsl/shared/`.

/// Functions that other shaders use: the form factor.
pub const FORM_FACTOR: &str = include_str!("../wgsl/shared/form_factor.wgsl");

/// Bindings of the shaders that measure form factors; after [`FORM_FACTOR`].
pub const RECEIVERS: &str = include_str!("../wgsl/shared/receivers.wgsl");

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

//! The methods that are compared, one file each.

pub mod area_lights;
pub mod direct;
pub mod brute;
pub mod thesis;
pub mod vlm;
pub mod instant_radiosity;
pub mod ddgi;
pub mod gpu;

use crate::method::{Backend, Method, Stage};

/// A method as the comparison knows it.
pub struct Entry {
    /// The method's name.
    pub name: &'static str,
    /// One method per setting of the knobs that a run compares, cheap ones first.
    pub sweep: fn(&Stage<'_>) -> Vec<Box<dyn Method>>,
    /// The setting that should give known answers: nothing is cut off for speed.
    pub proof: fn() -> Box<dyn Method>,
    /// How far the proof's mean irradiance may be from the known answer, relative.
    pub tolerance: f64,
}

/// The methods that run on a backend.
#[must_use]
pub fn all(backend: Backend) -> &'static [Entry] {
    match backend {
        Backend::Cpu => &ALL,
        Backend::Gpu => &gpu::ALL,
    }
}

/// Every method there is on the processor.
pub const ALL: [Entry; 6] =
    [direct::ENTRY, brute::ENTRY, thesis::ENTRY, vlm::ENTRY, instant_radiosity::ENTRY, ddgi::ENTRY];

//! Metrics, comparison methods and benchmarks.

pub mod glb;
pub mod cornell;
pub mod assets;
pub mod form_factor;

//! Metrics, comparison methods and benchmarks.

pub mod assets;
pub mod glb;
pub mod cornell;

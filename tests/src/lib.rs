//! Metrics, comparison methods and benchmarks.

pub mod assets;

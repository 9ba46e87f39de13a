//! Metrics, comparison methods and benchmarks.

pub mod assets;
pub mod sample_asset;

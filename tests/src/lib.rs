//! Metrics, comparison methods and benchmarks.

pub mod assets;
pub mod glb;
pub mod cornell;
pub mod sample_asset;
pub mod scenes;
pub mod flip;
pub mod metrics;
pub mod form_factor;
pub mod thesis;
pub mod plot;
pub mod pareto;

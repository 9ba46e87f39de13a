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
pub mod random;
pub mod method;
pub mod methods;
pub mod exact;
pub mod proof;
pub mod exr;
pub mod truth;
pub mod pareto;
pub mod device;
pub mod slope;
pub mod room;
pub mod hard_meshes;
pub mod text;
pub mod grid_bench;
pub mod bake_bench;
pub mod clearance_bench;

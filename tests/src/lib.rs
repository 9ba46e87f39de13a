//! Metrics, comparison methods and benchmarks.

<<<<<<< HEAD
pub mod assets;
=======
>>>>>>> main
pub mod glb;
pub mod cornell;
pub mod scenes;
pub mod metrics;
pub mod thesis;

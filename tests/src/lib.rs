//! Metrics, comparison methods and benchmarks.

//! The tools around `vlm`: glTF-Transform with our plugin, what the page on pipelines says, and the files for CI.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod support;
mod gltf_transform;
mod page;
mod ci;

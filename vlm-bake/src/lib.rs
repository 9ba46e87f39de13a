//! Bakes Virtual Light Meshes from glTF.
//!
//! Stages, in the order in which data flows:
//! `scene -> patches -> decimate -> offset -> refine -> verify -> tag -> samples -> grid -> write`.

pub mod scene;
pub mod bvh;

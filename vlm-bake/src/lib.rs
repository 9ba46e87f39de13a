//! Bakes Virtual Light Meshes from glTF.
//!
//! Stages, in the order in which data flows:
//! `scene -> patches -> decimate -> offset -> refine -> verify -> tag -> samples -> grid -> write`.
//! For pictures on the CPU: `scene, bvh -> camera -> shade -> gbuffer -> reference | render -> picture`.

pub mod scene;
pub mod bvh;
pub mod camera;
pub mod shade;
pub mod gbuffer;
pub mod reference;
pub mod render;
pub mod picture;

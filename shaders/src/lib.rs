//! Light transport of Virtual Light Meshes. `cpu` mirrors the WGSL function for function, so that everything also runs,
//! and is tested, without a GPU.

pub mod cpu;
pub mod wgsl;

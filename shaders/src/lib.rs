//! Light transport of Virtual Light Meshes. `cpu` mirrors the WGSL function for function, so that everything also runs,
//! and is tested, without a GPU.

// No input may crash a program that links this.
#![warn(clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)]

pub mod cpu;
pub mod tables;
pub mod wgsl;

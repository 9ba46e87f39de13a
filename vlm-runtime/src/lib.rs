//! Virtual Light Meshes in a game: loads a baked glTF and finds the indirect light of a frame on the GPU.
//!
//! Data flows `load -> upload -> direct -> inject -> refresh -> gather`: [`VlmAsset`] reads a file, [`VlmRenderer::load`] puts it on the
//! device, [`VlmRenderer::prepare`] says what changed since the last frame, and [`VlmRenderer::record`] adds the passes that this needs.
//! Wants nothing beyond WebGPU's default limits, and no optional feature.

// No input may crash a program that links this.
#![warn(clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)]

mod error;
mod device;
mod load;
mod frame;
mod stats;
mod pass;
mod upload;
mod changes;
mod direct;
mod inject;
mod refresh;
mod gather;
mod renderer;

#[cfg(feature = "view")]
pub mod view;

pub use device::{check_limits, request_device};
pub use error::Error;
pub use frame::{Frame, IrradianceFormat, MovedNode, Settings, Targets, Visibility};
pub use load::VlmAsset;
pub use renderer::VlmRenderer;
pub use stats::{FrameStats, Skipped};
pub use upload::{MOST_LISTED, MOST_REAL_LIGHTS};
pub use vlm_shaders::cpu::direct::Point;
pub use vlm_shaders::cpu::punctual::PunctualLight;
pub use vlm_shaders::cpu::view::View;

/// Compiles the code of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

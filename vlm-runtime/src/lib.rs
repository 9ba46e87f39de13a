//! Virtual Light Meshes in a game: loads a baked glTF and finds the indirect light of a frame on the GPU.
//!
//! Data flows `load -> upload -> shadow -> direct -> inject -> refresh -> gather`: [`VlmAsset`] reads a file, [`VlmRenderer::load`] puts it on the
//! device, [`VlmRenderer::prepare`] says what changed since the last frame, and [`VlmRenderer::record`] adds the passes that this needs.
//! Wants nothing beyond WebGPU's default limits, and no optional feature.

// No input may crash a program that links this.
#![warn(clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)]

mod error;
mod device;
mod load;
mod frame;
mod stats;
mod timer;
mod pass;
mod upload;
mod changes;
mod shadow;
mod direct;
mod inject;
mod dependents;
mod refresh;
mod gather;
mod loaded;
mod renderer;

#[cfg(feature = "view")]
pub mod view;

pub use device::{check_limits, request_device, request_device_with};
pub use error::Error;
pub use frame::{Frame, IrradianceFormat, MovedNode, Settings, ShadowMap, Targets, Visibility};
pub use load::VlmAsset;
pub use renderer::VlmRenderer;
pub use stats::{FrameStats, FrameTimes, PassTime, Skipped};
pub use upload::{MOST_LISTED, MOST_REAL_LIGHTS};
pub use vlm_shaders::cpu::direct::Point;
pub use vlm_shaders::cpu::punctual::PunctualLight;
pub use vlm_shaders::cpu::view::View;

/// Compiles the code of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

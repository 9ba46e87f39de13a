//! The glTF extension `VLM_virtual_light_mesh`: types, reading, writing, validation.
//!
//! Data flows `container -> validate -> accessor` on the way in and `asset -> write` on the way out.

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod asset;

pub use asset::{Grid, Sample, Settings, Vlm, VlmAsset};

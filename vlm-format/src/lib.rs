//! The glTF extension `VLM_virtual_light_mesh`: types, reading, writing, validation.
//!
//! Data flows `container -> check -> typed, accessor -> read` on the way in and `asset -> validate -> write` on the way
//! out. A file is checked before anything follows its indices, and written by patching its JSON and appending to its
//! binary data, so that every byte and value of others stays as it was.

mod error;
mod glb;
mod uri;
mod check;
mod typed;
mod codec;
mod container;
mod accessor;
mod asset;

pub use asset::{Grid, Sample, Settings, Vlm, VlmAsset};
pub use container::{GltfFile, Kind};
pub use error::{Code, Error, Issue, Severity, Stale};

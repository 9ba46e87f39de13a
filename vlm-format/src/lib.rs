//! The glTF extension `VLM_virtual_light_mesh`: types, reading, writing, validation.
//!
//! Data flows `container -> check -> typed, accessor -> read` on the way in and `asset -> validate -> write` on the way
//! out. A file is checked before anything follows its indices, and written by patching its JSON and appending to its
//! binary data, so that every byte and value of others stays as it was.

// No input may crash a program that links this.
#![warn(clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)]

mod code;
mod error;
mod glb;
mod uri;
mod check;
mod typed;
mod codec;
mod compress;
mod container;
mod accessor;
mod asset;
mod grid;
mod tags;
mod validate;
mod nodes;
mod digest;
mod place;
mod recover;
mod read;
mod patch;
mod strip;
mod package;
mod write;
mod relink;
mod sidecar;
mod sizes;
mod save;

pub use asset::{Sample, Settings, Vlm, VlmAsset};
pub use container::{GltfFile, Kind};
pub use error::{Code, Error, Issue, Severity, Stale};
pub use grid::{Grid, Leaf, MOST_PROBES, Probe, Row, RowWriter, Uncovered};
pub use package::{Container, OutputFile, Target};
pub use read::{read_vlm, read_vlm_recovered, read_vlm_unchecked};
pub use relink::{Donor, RelinkOptions, Relinked, relink};
pub use save::{write_atomic, write_file};
pub use sidecar::write_sidecar;
pub use strip::{Difference, EXTENSION, Stripped, strip_vlm, strip_vlm_compared};
pub use tags::TriangleTags;
pub use validate::{MAX_ASPECT_RATIO, validate};
pub use write::{WriteOptions, write_vlm, write_vlm_with};

/// Compiles the code of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

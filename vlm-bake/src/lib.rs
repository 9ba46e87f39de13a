//! Bakes Virtual Light Meshes from glTF, and renders them on the CPU.
//!
//! Stages of the bake, in the order in which data flows:
//! `scene -> patches -> decimate -> refine, offset, mend (verify) -> samples, flux -> authored -> tag, prove -> grid -> write`.
//! For pictures on the CPU: `scene, bvh -> camera -> shade -> gbuffer -> reference | render -> picture`.

// No input may crash a program that links this.
#![warn(clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)]

pub mod options;
pub mod flags;
pub mod progress;
pub mod report;

pub mod refusal;
pub mod bake;
pub mod memory;
pub mod scene;
pub mod patches;
pub mod decimate;
pub mod planar;
pub mod slivers;
pub mod surface;
pub mod correspondence;
pub mod standing;
pub mod clearance;
pub mod signed_distance;
pub mod way_out;
pub mod ground;
pub mod refine;
pub mod offset;
pub mod fit;
pub mod fitting;
pub mod mend;
pub mod verify;
pub mod samples;
pub mod flux;
pub mod authored;
pub mod grid;
pub mod grid_content;
pub mod neighbours;
pub mod tag;
pub mod tag_cost;
pub mod prove;
pub mod write;
pub mod diff;

pub mod bvh;
pub mod grouped_bvh;
pub mod topology;

pub mod camera;
pub mod shade;
pub mod gbuffer;
pub mod emitters;
pub mod reference;
pub mod render;
pub mod picture;

pub mod report_html;

pub mod references;
pub mod follow;
pub mod settings;
pub mod project;
pub mod inputs;
pub mod recipe;
pub mod cache;
pub mod job;

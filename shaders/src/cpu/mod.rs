//! The CPU mirrors, in the order in which data flows.

pub mod upload;
pub mod punctual;
pub mod shadow;
pub mod direct;
pub mod inject;
pub mod form_factor;
pub mod free_light;
pub mod refresh;
pub mod grid;
pub mod gather;
pub mod gather_static;
pub mod gather_free;
pub mod view;
pub mod resolve;

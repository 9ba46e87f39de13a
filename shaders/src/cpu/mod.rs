//! The CPU mirrors, in the order in which data flows.

pub mod upload;
pub mod punctual;
pub mod inject;
pub mod grid;
pub mod form_factor;
pub mod gather;
pub mod resolve;

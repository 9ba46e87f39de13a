//! The stress test of the form factor: cases, reference, other forms, and how far each errs.

pub mod case;
pub mod generate;
pub mod reference;
pub mod textbook;
pub mod bins;
pub mod stress;
pub mod gpu;
pub mod error_plot;
pub mod peak;
pub mod kernel;
pub mod command;

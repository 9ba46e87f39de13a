//! Run time against error: every method over its knob, on the same machine in one interleaved run.

pub mod row;
pub mod scene;
pub mod run;
mod judge;
pub mod names;
pub mod front;
pub mod curves;
pub mod numbers;
pub mod equal;
pub mod summary;
pub mod figures;
pub mod false_colour;
pub mod sheet;
pub mod report;
#[cfg(test)]
mod made_up;

pub use report::{ReportError, report};

//! Run time against error: every method over its knob, on the same machine in one interleaved run.

pub mod row;
pub mod names;
pub mod front;
pub mod curves;
pub mod numbers;
pub mod equal;
pub mod summary;
#[cfg(test)]
mod made_up;

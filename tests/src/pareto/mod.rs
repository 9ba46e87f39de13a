//! Run time against error: every method over its knob, on the same machine in one interleaved run.

pub mod row;

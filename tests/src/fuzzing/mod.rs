//! What a fuzzer feeds and asks: targets that must hold for any bytes, and a mutator that knows glTF.
//!
//! `seeds -> mutate (parts, json, bin) -> format_reader | whole_bake`. `tests/fuzz` runs both targets under libFuzzer without end, the test
//! `fuzz_short` runs them over a fixed random stream. The crate `tests/fuzz` includes these files by path, so that it need not build the
//! viewer; they use nothing of this package but [`crate::glb`], [`crate::random`] and [`crate::sample_asset`].

mod draw;
mod parts;
mod json;
mod bin;
mod mutate;
mod seeds;
mod format_reader;
mod whole_bake;

pub use draw::Draw;
pub use format_reader::format_reader;
pub use json::places;
pub use mutate::mutate;
pub use parts::Parts;
pub use seeds::{of_code, of_files};
pub use whole_bake::whole_bake;

/// How far a target came with an input; it panics where the library breaks its word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reached {
    /// The file was refused.
    Refused,
    /// The file opened, and went no further: no scene in it, too large a one, or nothing to bake.
    Opened,
    /// What the target is about was done: written and read again, or baked.
    Done,
}

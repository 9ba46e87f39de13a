//! Random choices from a stream that is the same on every machine.

use crate::random::bits;

/// Draws numbers one after the other; the seed names the stream.
#[derive(Clone, Debug)]
pub struct Draw {
    stream: u64,
    number: u64,
}

impl Draw {
    /// The stream with this seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { stream: seed, number: 0 }
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.number += 1;
        bits(self.stream, self.number)
    }

    /// A number below `limit`; 0 for a limit of 0.
    pub fn below(&mut self, limit: usize) -> usize {
        (self.bits() % limit.max(1) as u64) as usize
    }

    /// True once in so many draws.
    pub fn one_in(&mut self, times: usize) -> bool {
        self.below(times) == 0
    }

    /// One of the items; `None` of none.
    pub fn of<'a, T>(&mut self, items: &'a [T]) -> Option<&'a T> {
        items.get(self.below(items.len()))
    }
}

//! Changes to whole files that leave them files: what is left of a GLB after a blind change is almost never one.

use super::{Draw, Parts, bin, json};

/// Most changes at once. More of them reach what one alone is refused for, and refuse more.
const MOST_CHANGES: usize = 4;

/// A changed copy of a file: the same for the same seed. What is no glTF gets a few bytes flipped.
#[must_use]
pub fn mutate(bytes: &[u8], seed: u64) -> Vec<u8> {
    let mut draw = Draw::new(seed);
    let Some(mut parts) = Parts::of(bytes).filter(|_| !draw.one_in(40)) else {
        return flipped(bytes, &mut draw);
    };
    for _ in 0..=draw.below(MOST_CHANGES) {
        match &mut parts.bin {
            Some(data) if draw.one_in(2) => bin::change(data, &parts.json, &mut draw),
            _ => json::change(&mut parts.json, &mut draw),
        }
    }
    parts.pack()
}

fn flipped(bytes: &[u8], draw: &mut Draw) -> Vec<u8> {
    let mut flipped = bytes.to_vec();
    for _ in 0..=draw.below(MOST_CHANGES) {
        let at = draw.below(flipped.len());
        if let Some(byte) = flipped.get_mut(at) {
            *byte ^= 1 << draw.below(8);
        }
    }
    if draw.one_in(4) {
        flipped.truncate(draw.below(flipped.len()));
    }
    flipped
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cornell;

    #[test]
    fn a_seed_names_a_change() {
        let room = &cornell::all()[0].1;
        let changed: Vec<Vec<u8>> = (0..200).map(|seed| mutate(room, seed)).collect();
        assert_eq!(changed, (0..200).map(|seed| mutate(room, seed)).collect::<Vec<_>>());
        let differ = changed.iter().filter(|bytes| *bytes != room).count();
        assert!(differ > 180, "{differ} of 200 differ");
        let whole = changed.iter().filter(|bytes| Parts::of(bytes).is_some()).count();
        assert!(whole > 180, "{whole} of 200 can be taken apart again");
    }
}

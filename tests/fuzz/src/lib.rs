//! The fuzz targets and the mutator of `vlm-tests`, included by path: that package also builds the viewer, which no target needs.

#[path = "../../src/cornell.rs"]
pub mod cornell;
#[path = "../../src/fuzzing/mod.rs"]
pub mod fuzzing;
#[path = "../../src/glb.rs"]
pub mod glb;
#[path = "../../src/random.rs"]
pub mod random;
#[path = "../../src/sample_asset.rs"]
pub mod sample_asset;

/// [`fuzzing::mutate()`] in the fuzzer's own buffer, whose first `size` bytes are the input; returns the size of the output. What does not
/// fit stays as it was.
pub fn mutate_in_place(data: &mut [u8], size: usize, max_size: usize, seed: u32) -> usize {
    let mutated = fuzzing::mutate(&data[..size], u64::from(seed));
    match data.get_mut(..mutated.len()).filter(|place| place.len() <= max_size) {
        Some(place) => place.copy_from_slice(&mutated),
        None => return size,
    }
    mutated.len()
}

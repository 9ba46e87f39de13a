//! [`vlm_fuzz::fuzzing::format_reader`] under libFuzzer.

#![no_main]

use libfuzzer_sys::{fuzz_mutator, fuzz_target};
use vlm_fuzz::{fuzzing, mutate_in_place};

fuzz_target!(|data: &[u8]| {
    fuzzing::format_reader(data);
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    mutate_in_place(data, size, max_size, seed)
});

//! Any bytes give a model or a typed error, soon and in little memory: `tools/fuzz`.

#![no_main]

use kanagata_fuzz::cad::{build, step};
use kanagata_fuzz::mutate::{Text, mutate};
use libfuzzer_sys::{fuzz_mutator, fuzz_target};

fuzz_target!(|bytes: &[u8]| {
    kanagata_fuzz::within_limits(|| {
        if let Ok(raw) = step::read_bytes(bytes, "fuzz.stp") {
            let _ = build::build_with(raw, "fuzz.stp", build::Creases::Cut);
        }
    });
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    mutate(Text::Step, include_str!("../step.dict"), data, size, max_size, seed)
});

//! Any bytes give a model or a typed error: `cargo fuzz run step fuzz/seeds/step -- -max_total_time=60`, with the small
//! `fixtures/forming/*.stp` copied to `fuzz/seeds/step`. A find goes to `fixtures/fuzz/NAME.stp`, where the tests read it again.

#![no_main]

use kanagata::cad::{build, step};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(raw) = step::read_bytes(bytes, "fuzz.stp") {
        let _ = build::build(raw, "fuzz.stp");
    }
});

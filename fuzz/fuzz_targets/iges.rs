//! Any bytes give a model or a typed error: `cargo fuzz run iges fuzz/seeds/iges -- -max_total_time=60`, with the small
//! `fixtures/forming/*.igs` copied to `fuzz/seeds/iges`. A find goes to `fixtures/fuzz/NAME.igs`, where the tests read it again.

#![no_main]

use kanagata::cad::{build, iges};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(raw) = iges::read_bytes(bytes, "fuzz.igs") {
        let _ = build::build(raw, "fuzz.igs");
    }
});

//! What the fuzz targets share: what the programs do with the bytes of each kind of file ([`readers`], [`checkpoint`]), what
//! one input may cost ([`limits`]), and changes that keep an input readable far into its reader ([`damage`],
//! [`mutate`]).
//! `tools/fuzz` runs them.
//!
//! libFuzzer's own limits see the whole process and nothing that was asked for but never touched; [`limits::within`]
//! counts what one input asks for.

pub mod checkpoint;
pub mod damage;
pub mod dice;
pub mod limits;
pub mod mutate;
pub mod readers;

pub use libfuzzer_sys;

/// A fuzz target: what reads the bytes, how long it may take [s], which text it is, words of it.
#[macro_export]
macro_rules! target {
    ($read:expr, $seconds:expr, $text:expr, $known:expr) => {
        use $crate::libfuzzer_sys::{fuzz_mutator, fuzz_target};

        fuzz_target!(|bytes: &[u8]| {
            $crate::limits::within(bytes.len(), $seconds, || drop($read(bytes)));
        });

        fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
            $crate::mutate::mutate($text, $known, data, size, max_size, seed)
        });
    };
}

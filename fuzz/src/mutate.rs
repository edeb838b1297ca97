//! libFuzzer's mutator of texts.

use libfuzzer_sys::fuzzer_mutate;

use crate::checkpoint;
use crate::damage::{Text, damage};
use crate::dice::Dice;

/// Changes the input in place and gives its new length: one time in three libFuzzer's own way, else by [`damage`].
pub fn mutate(
    text: Text,
    known: &str,
    data: &mut [u8],
    size: usize,
    most: usize,
    seed: u32,
) -> usize {
    let mut dice = Dice(u64::from(seed));
    let bytes = if text == Text::Checkpoint && !data[..size].contains(&b'\n') {
        // No seed of a file: versions and lengths change with the program.
        checkpoint::body()
    } else if size == 0 || dice.below(3) == 0 {
        return fuzzer_mutate(data, size, most);
    } else {
        let mut bytes = data[..size].to_vec();
        damage(text, known, &mut bytes, &mut dice);
        bytes
    };
    let size = bytes.len().min(most);
    data[..size].copy_from_slice(&bytes[..size]);
    size
}

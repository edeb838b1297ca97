//! Files on disk: one routine opens what others wrote, one writes.
//!
//! - `input`: regular files only, up to a size for each kind of file; never blocks
//! - `output`: a temporary file beside the target, flushed with its folder, then renamed over it
//! - `temporary`: files, folders and child programs to remove when the process ends early
//! - `digest`: SHA-256

pub mod digest;
pub mod input;
pub mod output;
pub mod temporary;

pub use digest::{Sha256Writer, sha256_hex};
pub use input::{Input, open, open_lock, read, read_system, read_text};
pub use output::{WriteError, remove_where, sweep, write_atomic};

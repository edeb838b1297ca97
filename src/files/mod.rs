//! Files on disk, with one routine for reading external files and one for writing.
//!
//! - `input`: regular files only, with a size limit for each kind of file; never blocks
//! - `output`: a temporary file next to the target, flushed with its folder, then renamed over it
//! - `exclusive`: files that only one process can create, and the clock of the file server
//! - `temporary`: files, folders and child programs to remove when the process ends early
//! - `digest`: SHA-256
//! - `kind`: what a file is, by its first bytes
//! - `standard`: standard input and output in place of a file

pub mod digest;
pub mod exclusive;
pub mod input;
pub mod kind;
pub mod output;
pub mod standard;
pub mod temporary;

pub use digest::{Sha256Writer, sha256_hex};
pub use exclusive::{create_new, random, server_time, unique_beside};
pub use input::{Input, open, read, read_system, read_text};
pub use kind::{FileKind, WrongKind};
pub use output::{WriteError, create_log, remove_where, sweep, write_atomic};

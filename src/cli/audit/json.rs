//! Figures of an audit as JSON.

use super::args::AuditArgs;
use crate::cli::exit::Failure;
use crate::files::write_atomic;

/// Writes the figures of one tool, or a list for several in the order of the arguments.
pub(super) fn write_json<R: serde::Serialize>(
    args: &AuditArgs,
    reports: &[R],
) -> Result<(), Failure> {
    let Some(path) = &args.json else { return Ok(()) };
    write_atomic(path, |w| {
        match reports {
            [one] if args.tools.len() == 1 => serde_json::to_writer_pretty(&mut *w, one)?,
            several => serde_json::to_writer_pretty(&mut *w, several)?,
        }
        writeln!(w)
    })?;
    Ok(())
}

//! Files on the command line, with `-` for standard input and output.

use std::path::PathBuf;

use crate::files::standard::{stdin, stdout};

/// Parses the name of a file that is read once; `-` is standard input.
pub(super) fn input_path(text: &str) -> Result<PathBuf, String> {
    Ok(if text == "-" { stdin() } else { text.into() })
}

/// Parses the name of a file that is written; `-` is standard output, and the summary goes to standard error.
pub(super) fn output_path(text: &str) -> Result<PathBuf, String> {
    Ok(if text == "-" { stdout() } else { text.into() })
}

/// Parses the name of a file or folder that must have one.
pub(super) fn named_path(text: &str) -> Result<PathBuf, String> {
    match text {
        "-" => Err(
            "standard input and output have no name, which is needed here for its ending or for what lies beside it; allowed: a file or folder (./- for one of this name)"
                .into(),
        ),
        text => Ok(text.into()),
    }
}

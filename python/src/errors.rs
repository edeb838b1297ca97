//! Exceptions of the package.

use kanagata::prelude::{Error, ErrorKind};
use pyo3::exceptions::{PyException, PyOSError};
use pyo3::{PyErr, create_exception};

create_exception!(
    kanagata,
    KanagataError,
    PyException,
    "Any error of the package but those of files (OSError)."
);
create_exception!(kanagata, InputError, KanagataError, "A file or a value is not what is allowed.");
create_exception!(kanagata, ConvergenceError, KanagataError, "The solver does not converge.");
create_exception!(kanagata, StoppedError, KanagataError, "The run was asked to stop.");

/// The exception of an error of the library.
pub fn raised(error: Error) -> PyErr {
    let text = error.to_string();
    match error.kind() {
        ErrorKind::Io => PyOSError::new_err(text),
        ErrorKind::Input => InputError::new_err(text),
        ErrorKind::NoConvergence => ConvergenceError::new_err(text),
        ErrorKind::Stopped => StoppedError::new_err(text),
        _ => KanagataError::new_err(text),
    }
}

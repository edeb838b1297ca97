//! The one error of the facade.

use crate::accuracy::AccuracyError;
use crate::audit::AuditError;
use crate::cad::CadError;
use crate::cad::offset::OffsetError;
use crate::cad::usable::Unusable;
use crate::convert::bezier::BezierError;
use crate::convert::offset::NoSide;
use crate::convert::origin::OriginError;
use crate::convert::select::SelectError;
use crate::convert::tolerance::ToleranceError;
use crate::convert::unfolded::UnfoldedError;
use crate::files::WriteError;
use crate::reach::ReachError;
use crate::run::RunError;
use crate::scene::SceneError;
use crate::solver::SimulationError;
use crate::tool::file::ToolFileError;

/// What kind of error ended an operation.
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorKind {
    /// A file cannot be read or written.
    Io,
    /// A file or a value is not what is allowed.
    Input,
    /// The solver does not converge.
    NoConvergence,
    /// The operation was asked to stop.
    Stopped,
}

/// Why an operation fails: what, where, and what is allowed. `std::error::Error::source` leads to the cause.
#[derive(Debug)]
pub struct Error {
    kind: ErrorKind,
    cause: Box<dyn std::error::Error + Send + Sync>,
}

impl Error {
    pub(super) fn new(
        kind: ErrorKind,
        cause: impl Into<Box<dyn std::error::Error + Send + Sync>>,
    ) -> Self {
        Self { kind, cause: cause.into() }
    }

    /// An error of a value or a file's content.
    pub(super) fn input(cause: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        Self::new(ErrorKind::Input, cause)
    }

    /// What kind of error it is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.cause.fmt(f)
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.cause.source()
    }
}

macro_rules! input_errors {
    ($($cause:ty),*) => { $(impl From<$cause> for Error {
        fn from(cause: $cause) -> Self {
            Self::input(cause)
        }
    })* };
}

input_errors!(
    AuditError,
    BezierError,
    NoSide,
    OffsetError,
    OriginError,
    ReachError,
    SelectError,
    ToleranceError,
    UnfoldedError,
    Unusable
);

impl From<CadError> for Error {
    fn from(cause: CadError) -> Self {
        let is_io = matches!(cause, CadError::Io { .. });
        Self::new(if is_io { ErrorKind::Io } else { ErrorKind::Input }, cause)
    }
}

impl From<ToolFileError> for Error {
    fn from(cause: ToolFileError) -> Self {
        let is_io = matches!(cause, ToolFileError::Io { .. });
        Self::new(if is_io { ErrorKind::Io } else { ErrorKind::Input }, cause)
    }
}

impl From<SceneError> for Error {
    fn from(cause: SceneError) -> Self {
        let is_io = matches!(cause, SceneError::Io { .. });
        Self::new(if is_io { ErrorKind::Io } else { ErrorKind::Input }, cause)
    }
}

impl From<WriteError> for Error {
    fn from(cause: WriteError) -> Self {
        Self::new(ErrorKind::Io, cause)
    }
}

impl From<AccuracyError> for Error {
    fn from(cause: AccuracyError) -> Self {
        match cause {
            AccuracyError::Run(cause) => cause.into(),
            AccuracyError::Scene(cause) => cause.into(),
            AccuracyError::Write(cause) => cause.into(),
            AccuracyError::Results { .. } => Self::new(ErrorKind::Io, cause),
            AccuracyError::NotConverged { .. } => Self::new(ErrorKind::NoConvergence, cause),
            _ => Self::input(cause),
        }
    }
}

impl From<RunError> for Error {
    fn from(cause: RunError) -> Self {
        let kind = match &cause {
            RunError::Write(_) | RunError::LockLost { .. } | RunError::Folder { .. } => {
                ErrorKind::Io
            }
            RunError::Solver { cause, .. } => match **cause {
                SimulationError::Setup(_) | SimulationError::NoTouch { .. } => ErrorKind::Input,
                SimulationError::Stopped { .. } => ErrorKind::Stopped,
                _ => ErrorKind::NoConvergence,
            },
            RunError::ExcludedPatchReached { .. } => ErrorKind::NoConvergence,
            _ => ErrorKind::Input,
        };
        Self::new(kind, cause)
    }
}

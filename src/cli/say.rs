//! Lines on standard output and standard error. Who reads them may have gone (`kanagata audit ... | head`): what is left to
//! say is then dropped, and the work goes on to its end and its exit code.

/// A line on standard output.
macro_rules! out {
    ($($part:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout(), $($part)*);
    }};
}

/// A line on standard error.
macro_rules! err {
    ($($part:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($part)*);
    }};
}

pub(super) use {err, out};

//! Extension module of the Python package: the facade of the library with arrays of NumPy.

mod cad;
mod errors;
mod material;
mod run;
mod scene;
mod tool;

use pyo3::prelude::*;

/// Objects of the library; `kanagata/__init__.py` has the package.
#[pymodule]
mod _kanagata {
    #[pymodule_export]
    use super::cad::Cad;
    #[pymodule_export]
    use super::errors::{ConvergenceError, InputError, KanagataError, StoppedError};
    #[pymodule_export]
    use super::material::{Material, materials};
    #[pymodule_export]
    use super::run::RunRecord;
    #[pymodule_export]
    use super::scene::{Scene, make_tools};
    #[pymodule_export]
    use super::tool::{Audit, Tool};
    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

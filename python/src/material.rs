//! Material cards.

use std::path::PathBuf;

use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::errors::{InputError, raised};

/// Names of the cards in the package.
#[pyfunction]
pub fn materials() -> Vec<String> {
    kanagata::prelude::Material::names()
}

/// A material card with its curves.
#[pyclass(frozen, module = "kanagata")]
pub struct Material {
    inner: kanagata::prelude::Material,
}

#[pymethods]
impl Material {
    /// The card of this name, or else the card in this file.
    #[new]
    fn new(card: PathBuf) -> PyResult<Self> {
        let name = card.to_str().filter(|name| materials().iter().any(|known| known == name));
        let inner = match name {
            Some(name) => kanagata::prelude::Material::named(name),
            None if card.is_file() => kanagata::prelude::Material::read(&card),
            // An error that lists the names.
            None => kanagata::prelude::Material::named(&card.to_string_lossy()),
        };
        Ok(Self { inner: inner.map_err(raised)? })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.inner.card().name
    }

    #[getter]
    fn source(&self) -> &str {
        &self.inner.card().source
    }

    /// The card as JSON text.
    fn json(&self) -> PyResult<String> {
        serde_json::to_string(self.inner.card()).map_err(|e| InputError::new_err(e.to_string()))
    }

    fn stress_mpa<'py>(
        &self,
        py: Python<'py>,
        plastic_strains: Vec<f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let stress = |p: &f64| {
            if !(*p >= 0.0 && p.is_finite()) {
                return Err(InputError::new_err(format!(
                    "plastic strain {p}; allowed: 0 or above"
                )));
            }
            self.inner.tension(*p).map(|found| found.0).map_err(raised)
        };
        let stresses = plastic_strains.iter().map(stress).collect::<PyResult<Vec<f64>>>()?;
        Ok(stresses.into_pyarray(py))
    }

    fn yield_locus<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, self.inner.yield_locus().map_err(raised)?)
    }

    fn r_value(&self, angle_deg: f64) -> PyResult<f64> {
        self.inner.r_value(angle_deg).map_err(raised)
    }

    fn limit_curve<'py>(
        &self,
        py: Python<'py>,
        thickness_mm: f64,
    ) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let curve = self.inner.limit_curve(thickness_mm).map_err(raised)?;
        curve.map(|curve| points(py, curve)).transpose()
    }

    fn __repr__(&self) -> String {
        format!("<kanagata.Material {}>", self.inner.card().name)
    }
}

/// Points in the plane as an array of two columns.
fn points(py: Python<'_>, points: Vec<[f64; 2]>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    use numpy::PyArrayMethods as _;
    let n = points.len();
    points.into_iter().flatten().collect::<Vec<f64>>().into_pyarray(py).reshape([n, 2])
}

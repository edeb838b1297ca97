//! Results of a run.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::{InputError, raised};

/// The files of a run folder.
#[pyclass(frozen, module = "kanagata._kanagata")]
pub struct RunRecord {
    pub inner: kanagata::prelude::Run,
}

#[pymethods]
impl RunRecord {
    #[new]
    fn new(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        let inner = py.detach(|| kanagata::prelude::Run::open(folder)).map_err(raised)?;
        Ok(Self { inner })
    }

    #[getter]
    fn folder(&self) -> PathBuf {
        self.inner.folder().to_path_buf()
    }

    /// `run.json` as JSON text.
    fn json(&self) -> PyResult<String> {
        serde_json::to_string(self.inner.record()).map_err(|e| InputError::new_err(e.to_string()))
    }

    /// Columns of `history.csv`, in its order.
    fn history<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let history = self.inner.history();
        let rows = &history.rows;
        let out = PyDict::new(py);
        out.set_item("increment", rows.iter().map(|r| r.increment).collect::<Vec<_>>())?;
        out.set_item("stage", rows.iter().map(|r| r.stage.clone()).collect::<Vec<_>>())?;
        out.set_item("time", rows.iter().map(|r| r.time).collect::<Vec<_>>())?;
        for (k, tool) in history.tools.iter().enumerate() {
            let of =
                |values: &dyn Fn(usize) -> f64| (0..rows.len()).map(values).collect::<Vec<_>>();
            out.set_item(format!("{tool}_travel_mm"), of(&|r| rows[r].travel_mm[k]))?;
            out.set_item(format!("{tool}_force_n"), of(&|r| rows[r].force_n[k]))?;
        }
        out.set_item("iterations", rows.iter().map(|r| r.iterations).collect::<Vec<_>>())?;
        out.set_item("contact_nodes", rows.iter().map(|r| r.contacts[0]).collect::<Vec<_>>())?;
        out.set_item("slipping_nodes", rows.iter().map(|r| r.contacts[1]).collect::<Vec<_>>())?;
        let energies: [(&str, &dyn Fn(usize) -> f64); 3] = [
            ("external_work_nmm", &|r| rows[r].energy.external),
            ("internal_work_nmm", &|r| rows[r].energy.internal),
            ("friction_work_nmm", &|r| rows[r].energy.friction),
        ];
        for (key, of) in energies {
            out.set_item(key, (0..rows.len()).map(of).collect::<Vec<_>>())?;
        }
        for (k, tool) in history.tools.iter().enumerate().filter(|_| history.has_pressures()) {
            for (which, name) in ["mean", "max"].into_iter().enumerate() {
                let values: Vec<f64> = rows.iter().map(|r| r.pressure_mpa[k][which]).collect();
                out.set_item(format!("{tool}_{name}_pressure_mpa"), values)?;
            }
        }
        Ok(out)
    }

    /// The flat table of results as JSON text.
    fn metrics(&self) -> PyResult<String> {
        let metrics = self.inner.metrics().map_err(raised)?;
        serde_json::to_string(&metrics).map_err(|e| InputError::new_err(e.to_string()))
    }

    /// Process time and file of every step that was written.
    fn steps(&self) -> Vec<(f64, PathBuf)> {
        self.inner.steps()
    }
}

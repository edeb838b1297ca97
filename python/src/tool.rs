//! Tools and audits.

use std::path::PathBuf;

use kanagata::prelude::AuditOptions;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::cad::Cad;
use crate::errors::{InputError, raised};

/// A tool of Nagata patches, Bezier patches or facets [mm].
#[pyclass(frozen, module = "kanagata")]
pub struct Tool {
    pub inner: kanagata::prelude::Tool,
}

/// Arrays of closest points: points, normals, gaps, patches, parameters, past the border.
type Closest<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<bool>>,
);

/// Points and triangles.
type Triangles<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>);

#[pymethods]
impl Tool {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let inner = py.detach(|| kanagata::prelude::Tool::read(path)).map_err(raised)?;
        Ok(Self { inner })
    }

    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.inner.write(path)).map_err(raised)
    }

    #[getter]
    fn name(&self) -> &str {
        self.inner.name()
    }

    #[getter]
    fn kind(&self) -> String {
        format!("{:?}", self.inner.kind()).to_lowercase()
    }

    #[getter]
    fn patches(&self) -> usize {
        self.inner.patches()
    }

    #[getter]
    fn shape_error_mm(&self) -> Option<f64> {
        self.inner.shape_error_mm()
    }

    #[getter]
    fn doubts(&self) -> Vec<String> {
        self.inner.doubts().iter().map(ToString::to_string).collect()
    }

    #[pyo3(signature = (cad, *, tol_mm = None, normal_tol_deg = None, samples = 8))]
    fn audit(
        &self,
        py: Python<'_>,
        cad: &Cad,
        tol_mm: Option<f64>,
        normal_tol_deg: Option<f64>,
        samples: usize,
    ) -> PyResult<Audit> {
        let options = AuditOptions {
            samples,
            tolerance_mm: tol_mm,
            normal_tolerance_deg: normal_tol_deg,
            ..AuditOptions::default()
        };
        let inner = py.detach(|| self.inner.audit(&cad.inner, &options)).map_err(raised)?;
        Ok(Audit { inner })
    }

    fn closest<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Closest<'py>> {
        if points.shape()[1] != 3 {
            let found = points.shape()[1];
            return Err(InputError::new_err(format!("points of {found} columns; allowed: 3")));
        }
        let asked: Vec<[f64; 3]> =
            points.as_array().rows().into_iter().map(|p| [p[0], p[1], p[2]]).collect();
        if let Some(k) = asked.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(InputError::new_err(format!("point {k} is not finite")));
        }
        let found = py.detach(|| self.inner.closest(&asked));
        let rows = |f: &dyn Fn(&kanagata::prelude::Projection) -> Vec<f64>, columns: usize| {
            let flat: Vec<f64> = found.iter().flat_map(f).collect();
            flat.into_pyarray(py).reshape([found.len(), columns])
        };
        Ok((
            rows(&|p| vec![p.point.x, p.point.y, p.point.z], 3)?,
            rows(&|p| vec![p.normal.x, p.normal.y, p.normal.z], 3)?,
            found.iter().map(|p| p.gap).collect::<Vec<f64>>().into_pyarray(py),
            found.iter().map(|p| p.patch).collect::<Vec<u32>>().into_pyarray(py),
            rows(&|p| vec![p.eta, p.zeta], 2)?,
            found.iter().map(|p| p.past_border).collect::<Vec<bool>>().into_pyarray(py),
        ))
    }

    #[pyo3(signature = (divisions = 4))]
    fn triangles<'py>(&self, py: Python<'py>, divisions: usize) -> PyResult<Triangles<'py>> {
        if !(1..=256).contains(&divisions) {
            return Err(InputError::new_err(format!("divisions {divisions}; allowed: 1 to 256")));
        }
        let (points, triangles) = self.inner.triangles(divisions);
        let (n, m) = (points.len(), triangles.len());
        let points = points.into_iter().flatten().collect::<Vec<f64>>().into_pyarray(py);
        let triangles = triangles.into_iter().flatten().collect::<Vec<u32>>().into_pyarray(py);
        Ok((points.reshape([n, 3])?, triangles.reshape([m, 3])?))
    }

    fn __repr__(&self) -> String {
        let (name, kind, n) = (self.inner.name(), self.kind(), self.inner.patches());
        format!("<kanagata.Tool {name}: {n} patches ({kind})>")
    }
}

/// Points, shape errors, patches.
type Samples<'py> =
    (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<u32>>);

/// The shape error of a tool against its CAD (Eq. 24).
#[pyclass(frozen, module = "kanagata")]
pub struct Audit {
    inner: kanagata::prelude::Audit,
}

#[pymethods]
impl Audit {
    #[getter]
    fn max_mm(&self) -> f64 {
        self.inner.report.max_mm
    }

    #[getter]
    fn min_mm(&self) -> f64 {
        self.inner.report.min_mm
    }

    #[getter]
    fn rms_mm(&self) -> f64 {
        self.inner.report.rms_mm
    }

    #[getter]
    fn worst_mm(&self) -> f64 {
        self.inner.report.worst_mm()
    }

    #[getter]
    fn normal_max_deg(&self) -> f64 {
        self.inner.report.normal_max_deg
    }

    #[getter]
    fn doubts(&self) -> Vec<String> {
        self.inner.report.doubts.iter().map(ToString::to_string).collect()
    }

    /// The report as JSON text.
    fn json(&self) -> PyResult<String> {
        serde_json::to_string(&self.inner.report).map_err(|e| InputError::new_err(e.to_string()))
    }

    fn samples<'py>(&self, py: Python<'py>) -> PyResult<Samples<'py>> {
        let (mut points, mut errors, mut patches) = (Vec::new(), Vec::new(), Vec::new());
        for (patch, samples) in self.inner.samples.iter().enumerate() {
            for sample in samples.valid() {
                points.extend(sample.point.iter());
                errors.push(sample.delta);
                patches.push(patch as u32);
            }
        }
        let n = errors.len();
        Ok((
            points.into_pyarray(py).reshape([n, 3])?,
            errors.into_pyarray(py),
            patches.into_pyarray(py),
        ))
    }

    fn __repr__(&self) -> String {
        let r = &self.inner.report;
        format!(
            "<kanagata.Audit: {:.3e} to {:.3e} mm, rms {:.3e} mm>",
            r.min_mm, r.max_mm, r.rms_mm
        )
    }
}

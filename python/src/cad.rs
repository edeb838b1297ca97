//! CAD files and conversions.

use std::path::PathBuf;

use kanagata::prelude::{
    Borders, ConvertSettings, FaceSelection, OffsetRequest, SheetReference, ToolKind,
};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::errors::{InputError, raised};
use crate::tool::Tool;

/// The trimmed faces of an IGES or STEP file [mm].
#[pyclass(frozen, module = "kanagata")]
pub struct Cad {
    pub inner: kanagata::prelude::Cad,
}

#[pymethods]
impl Cad {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let inner = py.detach(|| kanagata::prelude::Cad::read(path)).map_err(raised)?;
        Ok(Self { inner })
    }

    #[getter]
    fn faces(&self) -> usize {
        self.inner.faces()
    }

    #[getter]
    fn areas_mm2<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, py.detach(|| self.inner.areas_mm2()))
    }

    #[getter]
    fn bounds_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows: Vec<Vec<f64>> = self.inner.bounds_mm().iter().map(|row| row.to_vec()).collect();
        Ok(PyArray2::from_vec2(py, &rows)?)
    }

    #[getter]
    fn unit(&self) -> &str {
        self.inner.unit()
    }

    #[getter]
    fn bodies(&self) -> Vec<String> {
        self.inner.bodies()
    }

    #[getter]
    fn lost_faces(&self) -> Vec<(String, String)> {
        self.inner.lost_faces().into_iter().map(|[face, why]| (face, why)).collect()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.inner.warnings()
    }

    #[pyo3(signature = (*, name = "tool", kind = "nagata", tol_mm = None, normal_tol_deg = None, patches = None, time_s = None,
        arc_divisions = 4, edges_on_cad = None, independent_borders = false, smooth_deg = 0.5, sheet_side = None, flip = false,
        offset_mm = None, sheet_reference = None, thickness_mm = None, faces = None, skip_lost_faces = false))]
    #[expect(clippy::too_many_arguments)]
    fn convert(
        &self,
        py: Python<'_>,
        name: &str,
        kind: &str,
        tol_mm: Option<f64>,
        normal_tol_deg: Option<f64>,
        patches: Option<usize>,
        time_s: Option<f64>,
        arc_divisions: usize,
        edges_on_cad: Option<bool>,
        independent_borders: bool,
        smooth_deg: f64,
        sheet_side: Option<&str>,
        flip: bool,
        offset_mm: Option<f64>,
        sheet_reference: Option<&str>,
        thickness_mm: Option<f64>,
        faces: Option<&str>,
        skip_lost_faces: bool,
    ) -> PyResult<Tool> {
        let settings = ConvertSettings {
            name: name.into(),
            kind: kind_of(kind)?,
            tolerance_mm: positive("tol_mm", tol_mm)?,
            normal_tolerance_deg: positive("normal_tol_deg", normal_tol_deg)?,
            patches,
            time_s: positive("time_s", time_s)?,
            arc_divisions,
            edges_on_cad,
            borders: if independent_borders { Borders::Independent } else { Borders::Conforming },
            smooth_deg,
            sheet_side: sheet_side.map(side_of).transpose()?,
            flip,
            offset: offset_of(offset_mm, sheet_reference, thickness_mm)?,
            faces: faces.map(selection_of).transpose()?,
            skip_lost_faces,
            ..ConvertSettings::default()
        };
        let tool = py.detach(|| self.inner.convert(&settings)).map_err(raised)?;
        Ok(Tool { inner: tool })
    }

    fn __repr__(&self) -> String {
        format!("<kanagata.Cad: {} faces, unit {}>", self.inner.faces(), self.inner.unit())
    }
}

fn positive(key: &str, value: Option<f64>) -> PyResult<Option<f64>> {
    match value {
        Some(x) if !(x > 0.0 && x.is_finite()) => {
            Err(InputError::new_err(format!("{key} {x}; allowed: a finite number above 0")))
        }
        _ => Ok(value),
    }
}

fn kind_of(text: &str) -> PyResult<ToolKind> {
    match text {
        "nagata" => Ok(ToolKind::Nagata),
        "bezier" => Ok(ToolKind::Bezier),
        "facets" => Ok(ToolKind::Facets),
        _ => Err(InputError::new_err(format!("kind {text:?}; allowed: nagata, bezier, facets"))),
    }
}

fn side_of(text: &str) -> PyResult<[f64; 3]> {
    let axes = ["x", "y", "z"];
    let (sign, axis) = match text.split_at_checked(1) {
        Some(("+", axis)) => (1.0, axis),
        Some(("-", axis)) => (-1.0, axis),
        _ => (1.0, text),
    };
    let Some(k) = axes.iter().position(|a| *a == axis) else {
        return Err(InputError::new_err(format!(
            "sheet_side {text:?}; allowed: +x, -x, +y, -y, +z, -z"
        )));
    };
    let mut side = [0.0; 3];
    side[k] = sign;
    Ok(side)
}

fn offset_of(
    offset: Option<f64>,
    reference: Option<&str>,
    thickness: Option<f64>,
) -> PyResult<Option<OffsetRequest>> {
    let reference = match reference {
        None => None,
        Some("lower") => Some(SheetReference::Lower),
        Some("middle") => Some(SheetReference::Middle),
        Some("upper") => Some(SheetReference::Upper),
        Some(text) => {
            return Err(InputError::new_err(format!(
                "sheet_reference {text:?}; allowed: lower, middle, upper"
            )));
        }
    };
    match (offset, reference, positive("thickness_mm", thickness)?) {
        (None, None, None) => Ok(None),
        (Some(distance), None, None) if distance.is_finite() => {
            Ok(Some(OffsetRequest::Towards(distance)))
        }
        (None, Some(reference), Some(thickness)) => {
            Ok(Some(OffsetRequest::Sheet { thickness, reference }))
        }
        _ => Err(InputError::new_err(
            "offset_mm, sheet_reference and thickness_mm; allowed: a finite offset_mm alone, or sheet_reference with thickness_mm",
        )),
    }
}

/// A choice of faces, as in the provenance of a tool file.
fn selection_of(text: &str) -> PyResult<FaceSelection> {
    serde_json::from_str(text).map_err(|e| InputError::new_err(format!("faces: {e}")))
}

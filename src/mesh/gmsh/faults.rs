//! Defects of transfinite grids: folded elements, wrong area, or surfaces not meshed as a grid.

use std::collections::BTreeMap;

use super::plan::Plan;
use crate::SurfaceMesh;
use crate::quality::{corner_jacobians, face_areas};
use kanagata_cad::Model;

/// Signed sine of a corner angle below which the corner is folded or straight.
const STRAIGHT_CORNER_SINE: f64 = 1e-3;

/// A defect of the grid on one surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    surface: i64,
    face: Option<usize>,
    kind: Kind,
}

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    Empty,
    Folded(usize),
    Area { found: f64, model: f64 },
    NoGrid { quads: usize, elements: usize },
}

impl Fault {
    /// gmsh's number of the surface.
    pub fn surface(&self) -> i64 {
        self.surface
    }

    /// True when the surface must be meshed again; false when gmsh has already used its other algorithm.
    pub fn is_bad(&self) -> bool {
        !matches!(self.kind, Kind::NoGrid { .. })
    }

    /// Message text.
    pub fn note(&self, model: &Model) -> String {
        let face = self.face.and_then(|f| Some((f, &model.faces.get(f)?.source)));
        let name = face.map_or_else(
            || format!("gmsh's surface {}", self.surface),
            |(f, source)| format!("face {f} ({source})"),
        );
        let why = match &self.kind {
            Kind::Empty => "a grid on it has no elements".into(),
            Kind::Folded(1) => "1 element of a grid on it folds".into(),
            Kind::Folded(n) => format!("{n} elements of a grid on it fold"),
            Kind::Area { found, model } => {
                format!("a grid on it has {found:.4} mm2 where the CAD has {model:.4}")
            }
            Kind::NoGrid { quads, elements } => {
                format!("gmsh made {elements} elements and no grid of {quads} quads")
            }
        };
        format!("{name} is meshed by gmsh's algorithm for any surface: {why}")
    }
}

/// Defects of the grids of a plan; `found` is gmsh's mesh, `mesh` the same mesh attached to the model.
pub fn of_grids(
    plan: &Plan,
    found: &SurfaceMesh,
    mesh: &SurfaceMesh,
    model: &Model,
    area_tolerance: f64,
) -> Vec<Fault> {
    if plan.grids.is_empty() {
        return Vec::new();
    }
    let mut on: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
    for (k, e) in found.elements.iter().enumerate() {
        on.entry(i64::from(e.face)).or_default().push(k);
    }
    let corners = corner_jacobians(mesh, model);
    let areas = face_areas(mesh, model);
    let fault = |grid: &super::plan::Grid| {
        let elements = on.get(&grid.surface).map_or(&[][..], Vec::as_slice);
        let face = elements.first().map(|&k| model.cut_with(mesh.elements[k].face as usize).start);
        let folded = elements.iter().filter(|&&k| corners[k] < STRAIGHT_CORNER_SINE).count();
        let area = face.and_then(|f| areas.iter().find(|a| a.face == f));
        let off = area.filter(|a| a.exceeds_tolerance(area_tolerance));
        let is_quad = |k: &usize| found.elements[*k].nodes().len() == 4;
        let quads = elements.iter().filter(|k| is_quad(k)).count();
        let kind = match (off, plan.quads(grid)) {
            _ if elements.is_empty() => Kind::Empty,
            _ if folded > 0 => Kind::Folded(folded),
            (Some(a), _) => Kind::Area { found: a.area_mm2, model: a.model_area_mm2 },
            (None, Some(n)) if n != quads || n != elements.len() => {
                Kind::NoGrid { quads: n, elements: elements.len() }
            }
            _ => return None,
        };
        Some(Fault { surface: grid.surface, face, kind })
    };
    plan.grids.iter().filter_map(fault).collect()
}

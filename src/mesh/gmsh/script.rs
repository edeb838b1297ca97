//! Scripts in gmsh's own language: the CAD file merged, its faces sewn where the format does not join them, curves
//! divided and surfaces meshed as grids.

use std::fmt::Write;

use super::plan::Plan;

/// Divisions of every curve of the outline.
pub const OUTLINE_DIVISIONS: usize = 32;

/// Merges the CAD file; faces of a file that gives each its own curves are sewn within a tolerance (mm).
#[must_use]
pub fn merge(cad: &str, sewn: Option<f64>) -> String {
    let read = format!("Merge \"{cad}\";\n");
    sewn.map_or_else(
        || read.clone(),
        |tolerance| {
            format!(
                "old = Geometry.Tolerance;\nGeometry.OCCSewFaces = 1;\nGeometry.Tolerance = {tolerance:e};\n{read}\
                 Geometry.Tolerance = old;\n"
            )
        },
    )
}

/// Every curve divided alike.
#[must_use]
pub fn outline() -> String {
    format!("Transfinite Curve {{:}} = {};\n", OUTLINE_DIVISIONS + 1)
}

/// Divisions and grids of a plan; with `join` the grids of four sides are joined to quads by themselves.
#[must_use]
pub fn grids(plan: &Plan, join: bool) -> String {
    let mut out = String::new();
    for (curve, count) in &plan.divisions {
        let _ = writeln!(out, "Transfinite Curve {{{curve}}} = {};", count + 1);
    }
    for grid in &plan.grids {
        let corners: Vec<String> = grid.corners.iter().map(i64::to_string).collect();
        let _ =
            writeln!(out, "Transfinite Surface {{{}}} = {{{}}};", grid.surface, corners.join(", "));
        if join && grid.sides.len() == 4 {
            let _ = writeln!(out, "Recombine Surface {{{}}};", grid.surface);
        }
    }
    out
}

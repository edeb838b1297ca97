//! Scripts in the gmsh language: merge the CAD file, sew faces where the format does not join them, divide curves, mesh
//! surfaces as grids.

use std::fmt::Write;

use super::plan::Plan;

/// Divisions of every curve of the outline.
pub const OUTLINE_DIVISIONS: usize = 32;

/// Oldest supported gmsh version: older ones fold grids and lose faces.
pub const VERSION_MIN: [u32; 2] = [4, 12];

/// Terminates a gmsh older than `oldest` (major, minor): it writes no file, and its log contains the reason.
#[must_use]
pub fn version_guard(oldest: [u32; 2]) -> String {
    let [major, minor] = oldest;
    format!(
        "If (1000 * GMSH_MAJOR_VERSION + GMSH_MINOR_VERSION < {})\n  Error(\"gmsh %g.%g is too old; allowed: {major}.{minor} \
         or newer (KANAGATA_GMSH names another one)\", GMSH_MAJOR_VERSION, \
         GMSH_MINOR_VERSION);\n  Exit;\nEndIf\n",
        1000 * major + minor
    )
}

/// Merges the CAD file; faces without common curves are sewn within a tolerance [mm].
#[must_use]
pub fn merge(cad: &str, sewn: Option<f64>) -> String {
    let read = format!("Merge \"{cad}\";\n");
    let merged = sewn.map_or_else(
        || read.clone(),
        |tolerance| {
            format!(
                "old = Geometry.Tolerance;\nGeometry.OCCSewFaces = 1;\nGeometry.Tolerance = {tolerance:e};\n{read}\
                 Geometry.Tolerance = old;\n"
            )
        },
    );
    version_guard(VERSION_MIN) + &merged
}

/// Equal divisions of all curves.
#[must_use]
pub fn outline() -> String {
    format!("Transfinite Curve {{:}} = {};\n", OUTLINE_DIVISIONS + 1)
}

/// Divisions and grids of a plan; with `join` the grids of four sides are recombined to quadrilaterals individually.
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

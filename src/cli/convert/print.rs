//! Prints the result of a conversion.

use super::converted::{Converted, Fit};
use crate::cli::terminal::{err, out};
use crate::convert::tolerance::Borders;
use crate::geometry::Vec3;
use crate::reach::{Reached, Why};
use crate::tool::build::StraightEdge;

/// Largest number of edges listed of each kind.
const LISTED_EDGES_MAX: usize = 8;
/// Largest number of faces listed.
const LISTED_MAX: usize = 50;
/// Largest number of folded patches listed.
const LISTED_FOLDS_MAX: usize = 10;

/// Prints the figures of a conversion, and warnings.
pub(super) fn print_report(made: &Converted) {
    let (patches, vertices) = (made.tool.patches.len(), made.tool.vertices.len());
    let report = &made.report;
    out!("{patches} patches, {vertices} vertices, {} crease edges", report.creases);
    if let Some(fit) = &made.refined {
        print_fit(fit);
    }
    if report.turned {
        out!("  turned round to look at the sheet");
    }
    list_edges(made, &report.straight, "straight");
    list_edges(made, &report.bent, "follows the CAD, off its normals");
    list_faces(&report.finer, "divided more finely than asked, as patches of them folded");
    list_faces(
        &report.bare,
        "without a patch (they have no area, or the mesh has nothing on them)",
    );
    if report.split > 0 {
        err!("warning: {} folded quadrilaterals split in two triangles", report.split);
    }
    list_folds(made);
}

/// Prints the errors of a refined model, and how its faces meet.
fn print_fit(fit: &Fit) {
    let Fit { audit, moved_mm, slid_mm, borders, search_converged, independent_requested } = fit;
    out!(
        "  shape error {:+.5} to {:+.5} mm, normal error up to {:.3} deg; vertices up to {moved_mm:.5} mm off the CAD",
        audit.min_mm,
        audit.max_mm,
        audit.normal_max_deg
    );
    if let Some([x, y, z]) = audit.borders.at {
        out!(
            "  free borders within {:.5} mm of the CAD's, farthest at ({x:.3}, {y:.3}, {z:.3}) mm",
            audit.borders.deviation_mm()
        );
    }
    if !search_converged && audit.within_tolerance != Some(false) {
        err!(
            "note: the search for fewer patches ended at its limit of work or time; the model is within the tolerance"
        );
    }
    if *slid_mm > 0.0 {
        out!(
            "  vertices on smooth borders of flats up to {slid_mm:.5} mm off these, within the flat"
        );
    }
    if *borders == Borders::Independent {
        let [x, y, z] = audit.jumps.border_gap_at.unwrap_or_default();
        out!(
            "  faces divided independently: {} sides do not meet their neighbours', gap up to {:.5} mm at ({x:.3}, {y:.3}, {z:.3}) mm",
            audit.jumps.open_sides,
            audit.jumps.border_gap_mm
        );
    } else if *independent_requested {
        out!("  no fewer patches with faces divided independently: conforming");
    }
}

/// Lists folded patches with their positions. The caller adds the remedy.
fn list_folds(made: &Converted) {
    let folded = &made.report.folded;
    for &patch in folded.iter().take(LISTED_FOLDS_MAX) {
        let p = at(made, &made.tool.corners[patch as usize].vertices);
        let face = made.tool.faces[patch as usize];
        err!("warning: patch {patch} on face {face} near {p} folds");
    }
    if folded.len() > LISTED_FOLDS_MAX {
        err!("warning: and {} more patches fold", folded.len() - LISTED_FOLDS_MAX);
    }
}

/// Mean position of some vertices, as text.
fn at(made: &Converted, vertices: &[u32]) -> String {
    let sum: Vec3 = vertices.iter().map(|&v| made.tool.vertices[v as usize]).sum();
    let p = sum / vertices.len() as f64;
    format!("({:.3}, {:.3}, {:.3}) mm", p.x, p.y, p.z)
}

fn list_faces(faces: &[usize], what: &str) {
    if faces.is_empty() {
        return;
    }
    let listed: Vec<String> = faces.iter().take(LISTED_MAX).map(usize::to_string).collect();
    let more = if faces.len() > LISTED_MAX { ", ..." } else { "" };
    out!("  {} faces {what}: {}{more}", faces.len(), listed.join(", "));
}

fn list_edges(made: &Converted, edges: &[StraightEdge], what: &str) {
    for edge in edges.iter().take(LISTED_EDGES_MAX) {
        let ([a, b], p) = (edge.vertices, at(made, &edge.vertices));
        let patches: Vec<String> = edge.patches.iter().map(u32::to_string).collect();
        let patches = patches.join(", ");
        err!("warning: edge {a}-{b} of patches {patches} near {p}: {what}; {}", edge.fault);
    }
    if edges.len() > LISTED_EDGES_MAX {
        err!("warning: and {} more edges: {what}", edges.len() - LISTED_EDGES_MAX);
    }
}

/// Prints the number of excluded faces.
pub(super) fn print_reach(reached: &Reached) {
    let of = |why| reached.left_out.iter().filter(|l| l.1 == why).count();
    out!(
        "  {} of {} faces within the sheet's reach; left out: {} beside it, {} behind, {} looking away",
        reached.kept.len(),
        reached.kept.len() + reached.left_out.len(),
        of(Why::Beside),
        of(Why::Behind),
        of(Why::Away)
    );
}

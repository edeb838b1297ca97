//! The offset of the CAD from which a tool is made.

use super::args::{ConvertArgs, SheetSide};
use crate::cad::Model;
use crate::cad::offset::{OffsetModel, OffsetReport, offset_model_watched};
use crate::cli::exit::Failure;
use crate::cli::stages::progress;
use crate::cli::terminal::out;
use crate::convert::offset::signed_distance;

/// Gap at an edge above which it is printed [mm]; smaller ones are rounding of the file.
const GAP_SHOWN_MM: f64 = 1e-6;

/// The offset of the chosen faces, with its figures printed; `None` without an offset. `numbers` are those of the faces in
/// the file.
pub(super) fn offset_of(
    args: &ConvertArgs,
    model: &Model,
    numbers: Option<&[usize]>,
) -> Result<Option<OffsetModel>, Failure> {
    let Some(request) = args.how.offset.request() else { return Ok(None) };
    let side = args.how.sheet_side.map(SheetSide::direction);
    let distance = signed_distance(model, request, side, args.how.flip)
        .map_err(|e| Failure::of_file(&args.file, e))?;
    if distance == 0.0 {
        out!("the CAD is the surface of the sheet that the tool touches: no offset");
        return Ok(None);
    }
    let number = |f: usize| numbers.map_or(f, |numbers| numbers[f]);
    let made = offset_model_watched(model, distance, args.how.smooth_deg, &progress())
        .map_err(|e| Failure::of_file(&args.file, e.renumbered(number)))?;
    print(&made.report, model.faces.len());
    Ok(Some(made))
}

fn print(report: &OffsetReport, faces: usize) {
    let [least, most] = report.distances_mm;
    out!(
        "offset by {} mm along the CAD's outward normals: {least:.6} to {most:.6} mm from it",
        report.distance_mm
    );
    if report.fitted > 0 {
        out!("  {} of {faces} faces fitted within {:.1e} mm", report.fitted, report.tolerance_mm);
    }
    if report.radius_mm.is_finite() {
        let p = report.radius_at;
        out!(
            "  smallest radius on that side {:.3} mm, at ({:.2}, {:.2}, {:.2}) mm",
            report.radius_mm,
            p.x,
            p.y,
            p.z
        );
    }
    if report.gap.distance > GAP_SHOWN_MM {
        let p = report.gap.at;
        out!(
            "  faces up to {:.1e} mm apart at their edges, at ({:.2}, {:.2}, {:.2}) mm",
            report.gap.distance,
            p.x,
            p.y,
            p.z
        );
    }
}

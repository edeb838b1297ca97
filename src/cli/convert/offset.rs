//! `--offset` and `--reference`: the offset of the CAD from which a tool is made.

use clap::ValueEnum;

use super::args::{ConvertArgs, SheetSide};
use crate::cad::Model;
use crate::cad::offset::{OffsetModel, OffsetReport, offset_model};
use crate::cli::exit::Failure;
use crate::cli::quantity::{length_mm, signed_length_mm};
use crate::cli::terminal::{err, out};
use crate::convert::offset::{OffsetRequest, SheetReference, signed_distance};

/// Gap at an edge above which it is printed [mm]; smaller ones are rounding of the file.
const GAP_SHOWN_MM: f64 = 1e-6;

/// Offset of the CAD.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "Offset tools")]
pub struct OffsetArgs {
    /// Make the tool of the offset surface at this distance [mm] on the side of the sheet (negative: on the other side);
    /// with --flip the punch of a die. Recorded in the tool file
    #[arg(long, value_name = "LENGTH", value_parser = signed_length_mm, allow_hyphen_values = true)]
    pub(super) offset: Option<f64>,
    /// The CAD is this surface of the sheet: the tool is moved away from the sheet to the surface that it touches
    #[arg(
        long,
        value_enum,
        value_name = "SURFACE",
        requires = "sheet_thickness",
        conflicts_with = "offset"
    )]
    pub(super) reference: Option<Reference>,
    /// Thickness of the sheet [mm], for --reference
    #[arg(long, value_name = "LENGTH", value_parser = length_mm, requires = "reference")]
    pub(super) sheet_thickness: Option<f64>,
}

/// Surfaces of the sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Reference {
    /// The lower surface, which tools below the sheet touch
    Lower,
    /// The upper surface, which tools above the sheet touch
    Upper,
    /// The middle surface
    Middle,
}

impl OffsetArgs {
    /// Whether an offset is asked for.
    pub(super) fn is_given(&self) -> bool {
        self.request().is_some()
    }

    fn request(&self) -> Option<OffsetRequest> {
        let sheet = self.reference.zip(self.sheet_thickness).map(|(reference, thickness)| {
            let reference = match reference {
                Reference::Lower => SheetReference::Lower,
                Reference::Upper => SheetReference::Upper,
                Reference::Middle => SheetReference::Middle,
            };
            OffsetRequest::Sheet { thickness, reference }
        });
        self.offset.map(OffsetRequest::Towards).or(sheet)
    }

    /// Refuses an offset with a mesh of the whole file.
    pub(super) fn refuse_with(&self, option: Option<&str>) -> Result<(), Failure> {
        match option {
            Some(option) if self.is_given() => Err(Failure::input(format!(
                "{option} with an offset of the CAD; allowed: the built-in mesher, which meshes the offset faces; leave {option} out, \
                 or make the offset in the CAD"
            ))),
            _ => Ok(()),
        }
    }
}

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
    let made = offset_model(model, distance, args.how.smooth_deg)
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
    if !report.complete {
        err!(
            "warning: the search for self-intersections of the offset ended at its work limit; audit the tool, or choose fewer faces"
        );
    }
}

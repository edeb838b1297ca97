//! `--offset`, `--reference` and `--sheet-thickness`.

use clap::ValueEnum;

use crate::cli::exit::Failure;
use crate::cli::quantity::{length_mm, signed_length_mm};
use crate::convert::offset::{OffsetRequest, SheetReference};

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

    /// What is asked for.
    pub(super) fn request(&self) -> Option<OffsetRequest> {
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

//! The distance by which a model is offset to make a tool, along its outward normals.

use rayon::prelude::*;

use kanagata_cad::Model;
use kanagata_cad::model::Face;
use kanagata_cad::offset::OffsetReport;
use kanagata_geometry::Vec3;
use kanagata_report::doubt::{Doubt, DoubtCode};

/// Accuracy of vector areas relative to the squared size of a face.
const AREA_ACCURACY_REL: f64 = 1e-6;
/// Vertical component of the vector area of a model over its area below which the tool is neither above nor below the
/// sheet: walls. Doubled: tools inclined by less than 1.1 degrees from the vertical are refused.
const VERTICAL_MIN: f64 = 1e-2;

/// Surface of the sheet that a CAD model describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SheetReference {
    /// The lower surface, which a tool below the sheet touches.
    Lower,
    /// The middle surface.
    Middle,
    /// The upper surface, which a tool above the sheet touches.
    Upper,
}

/// What a tool is offset by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OffsetRequest {
    /// Distance towards the sheet [mm]: along the outward normals of the model, after it is turned to the sheet.
    Towards(f64),
    /// The model is a surface of the sheet; the tool is moved away from the sheet to the surface that it touches.
    Sheet {
        /// Thickness of the sheet [mm].
        thickness: f64,
        /// The surface.
        reference: SheetReference,
    },
}

/// The side of the sheet on which a tool lies cannot be found.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the tool is neither above nor below the sheet: the mean of its normals has the vertical component {vertical:.4}; allowed: \
     at least {VERTICAL_MIN} up or down; choose the faces that touch the sheet, or give the distance itself"
)]
pub struct NoSide {
    /// Vertical component of the mean normal.
    pub vertical: f64,
}

/// Distance [mm] along the outward normals of `model` for a tool whose normals are turned to `sheet_side` where they
/// point away from it, and reversed after that with `flip`.
///
/// A tool whose normals point up lies below the sheet and touches its lower surface. It is moved down by half the
/// thickness if the model is the middle surface, and by the thickness if it is the upper one. For a tool above the sheet
/// all is mirrored.
///
/// # Errors
/// [`NoSide`] for a surface of the sheet and a tool of vertical walls.
pub fn signed_distance(
    model: &Model,
    request: OffsetRequest,
    sheet_side: Option<Vec3>,
    flip: bool,
) -> Result<f64, NoSide> {
    let (sum, area) = areas(model);
    let is_turned =
        sheet_side.is_some_and(|side| sum.dot(&side) < -AREA_ACCURACY_REL * area * side.norm());
    let turn = if is_turned { -1.0 } else { 1.0 };
    let (thickness, reference) = match request {
        OffsetRequest::Towards(distance) => return Ok(turn * distance),
        OffsetRequest::Sheet { thickness, reference } => (thickness, reference),
    };
    let active = if flip { -turn } else { turn };
    let vertical = active * sum.z / area;
    // False also for an area of zero.
    let has_side = vertical.abs() >= VERTICAL_MIN;
    if !has_side {
        return Err(NoSide { vertical });
    }
    let fraction = match (reference, vertical > 0.0) {
        (SheetReference::Middle, _) => 0.5,
        (SheetReference::Lower, true) | (SheetReference::Upper, false) => 0.0,
        (SheetReference::Upper, true) | (SheetReference::Lower, false) => 1.0,
    };
    Ok(-active * fraction * thickness)
}

/// Deviation of distances from the CAD, over the accuracy of an offset, above which it is doubtful. Smaller: fitted faces
/// at edges with gaps raise doubts. Doubled: errors of four times the printed accuracy pass.
const INEXACT_RATIO: f64 = 2.0;

/// Doubts about an offset: its self-intersections were not searched for everywhere, or it is not at its distance.
#[must_use]
pub fn doubts(report: &OffsetReport) -> Vec<Doubt> {
    let place = format!("offset by {} mm", report.distance_mm);
    let unchecked = || {
        let text = "The search for self-intersections of the offset ended at its work limit. Choose fewer faces, or look at the tool where parts of the CAD are close to each other.";
        Doubt::new(DoubtCode::OffsetUnchecked, place.clone(), text.into())
    };
    let accuracy = report.tolerance_mm.max(report.gap.distance).max(report.join_tolerance_mm);
    let limit = INEXACT_RATIO * accuracy;
    let distance = report.distance_mm.abs();
    let [least, most] = report.distances_mm;
    let off = (distance - least).max(most - distance);
    let inexact = || {
        let text = format!(
            "Points of the offset are {least:.6} to {most:.6} mm from the CAD, not {distance} mm; allowed: a deviation of {limit:.1e} mm. The offset intersects itself, or a face of it is wrong. Choose other faces or a smaller distance, and compare with the offset of another CAD system."
        );
        Doubt::of(DoubtCode::OffsetInexact, place.clone(), [off, limit], text)
    };
    let unchecked = (!report.complete).then(unchecked);
    unchecked.into_iter().chain((off > limit).then(inexact)).collect()
}

/// Vector area and area of a model [mm^2].
fn areas(model: &Model) -> (Vec3, f64) {
    let of_face = |f: &Face| (f.vector_area(AREA_ACCURACY_REL), f.area(AREA_ACCURACY_REL));
    let each: Vec<(Vec3, f64)> = model.faces.par_iter().map(of_face).collect();
    each.into_iter().fold((Vec3::zeros(), 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_cad::build::build;
    use kanagata_cad::raw::{RawEdge, RawFace, RawLoop, RawModel, RawSurface};
    use kanagata_geometry::Frame;
    use kanagata_geometry::nurbs::Curve3;

    /// A square of 10 mm whose normal is the z axis of `frame`.
    fn square(frame: Frame) -> Model {
        let corners = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)]
            .map(|(x, y)| frame.point(&Vec3::new(x, y, 0.0)));
        let edge = |k: usize| RawEdge {
            curve: Some(Curve3::line(corners[k], corners[(k + 1) % 4])),
            ..RawEdge::default()
        };
        let face = RawFace {
            surface: RawSurface::Plane(frame),
            loops: vec![RawLoop { outer: None, edges: (0..4).map(edge).collect(), vertex: None }],
            flipped: false,
            source: "face".into(),
            shell: None,
            attributes: Default::default(),
        };
        build(RawModel { faces: vec![face], ..RawModel::default() }, "square").0
    }

    #[test]
    fn the_tool_moves_away_from_the_sheet_to_the_surface_that_it_touches() {
        use SheetReference::{Lower, Middle, Upper};
        let up = square(Frame::world());
        let of = |side: Option<Vec3>, flip, reference| {
            let sheet = OffsetRequest::Sheet { thickness: 0.8, reference };
            signed_distance(&up, sheet, side, flip).unwrap()
        };
        // Normals up: below the sheet. The distances are along +z.
        assert_eq!([Lower, Middle, Upper].map(|r| of(None, false, r)), [0.0, -0.4, -0.8]);
        // Reversed: above the sheet, moved up.
        assert_eq!([Lower, Middle, Upper].map(|r| of(None, true, r)), [0.8, 0.4, 0.0]);
        // Turned to a sheet below.
        let below = Some(-Vec3::z());
        assert_eq!([Lower, Middle, Upper].map(|r| of(below, false, r)), [0.8, 0.4, 0.0]);
        assert_eq!([Lower, Middle, Upper].map(|r| of(below, true, r)), [0.0, -0.4, -0.8]);
    }

    #[test]
    fn an_offset_off_its_distance_or_unchecked_is_doubtful() {
        let sound = OffsetReport {
            distance_mm: -0.8,
            join_tolerance_mm: 1e-5,
            distances_mm: [0.79999, 0.80001],
            complete: true,
            ..OffsetReport::default()
        };
        assert!(doubts(&sound).is_empty());
        let codes = |report: &OffsetReport| -> Vec<&str> {
            doubts(report).iter().map(|d| d.code.as_str()).collect()
        };
        let near = OffsetReport { distances_mm: [0.79, 0.8], ..sound.clone() };
        assert_eq!(codes(&near), ["offset-inexact"]);
        assert!(doubts(&OffsetReport { tolerance_mm: 0.006, ..near }).is_empty());
        let far = OffsetReport { distances_mm: [0.8, 0.8001], complete: false, ..sound };
        assert_eq!(codes(&far), ["offset-unchecked", "offset-inexact"]);
    }

    #[test]
    fn a_distance_is_towards_the_sheet_and_walls_have_no_side() {
        let up = square(Frame::world());
        let towards =
            |side, flip| signed_distance(&up, OffsetRequest::Towards(0.8), side, flip).unwrap();
        assert_eq!(towards(None, false), 0.8);
        assert_eq!(towards(None, true), 0.8);
        assert_eq!(towards(Some(Vec3::z()), true), 0.8);
        assert_eq!(towards(Some(-Vec3::z()), false), -0.8);
        let wall = square(Frame { y: Vec3::z(), z: -Vec3::y(), ..Frame::world() });
        let sheet = OffsetRequest::Sheet { thickness: 1.0, reference: SheetReference::Middle };
        let said = signed_distance(&wall, sheet, None, false).unwrap_err().to_string();
        assert!(said.contains("neither above nor below"), "{said}");
    }
}

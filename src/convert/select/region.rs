//! Regions in plan.

use super::chosen::Chosen;
use super::error::SelectError;
use kanagata_cad::region::{PlanCurve, RegionError, split};
use kanagata_geometry::Vec2;
use kanagata_geometry::nurbs::Curve2;
use kanagata_tool::selection::PlanPiece;

/// The pieces of a curve, as a tool file has them.
#[must_use]
pub fn plan_pieces(curve: &PlanCurve) -> Vec<PlanPiece> {
    let piece = |c: &Curve2| PlanPiece {
        degree: c.degree(),
        knots: c.knots().to_vec(),
        points: c.points().iter().map(|p| [p.x, p.y]).collect(),
        weights: if c.weights().iter().all(|w| *w == 1.0) {
            Vec::new()
        } else {
            c.weights().to_vec()
        },
    };
    curve.pieces().iter().map(piece).collect()
}

/// The curve of some pieces.
fn curve_of(pieces: &[PlanPiece]) -> Result<PlanCurve, RegionError> {
    let piece = |p: &PlanPiece| {
        let points = p.points.iter().map(|&[x, y]| Vec2::new(x, y)).collect();
        let weights = (!p.weights.is_empty()).then(|| p.weights.clone());
        Curve2::try_new(p.degree, p.knots.clone(), points, weights)
    };
    let pieces: Result<Vec<Curve2>, _> = pieces.iter().map(piece).collect();
    let allowed = "pieces that are B-splines";
    let pieces = pieces.map_err(|e| RegionError::Curve { found: e.to_string(), allowed })?;
    PlanCurve::of_pieces(pieces)
}

/// The chosen faces inside (or outside) a curve. Parts of split faces beyond the first get the numbers from `next` on.
pub(super) fn by_region(
    chosen: &Chosen,
    pieces: &[PlanPiece],
    inside: bool,
    next: &mut usize,
) -> Result<Chosen, SelectError> {
    let curve = curve_of(pieces)?;
    let found =
        split(&chosen.model, &curve, inside).map_err(|error| numbered(error, &chosen.kept))?;
    let own: Vec<usize> = (0..found.inside.len()).filter(|&f| found.inside[f] == inside).collect();
    if own.is_empty() {
        let bounds = curve.bounds();
        let low = [bounds.min.x, bounds.min.y];
        let high = [bounds.max.x, bounds.max.y];
        return Err(SelectError::NothingInRegion { inside, low, high });
    }
    let number = |&f: &usize| match chosen.kept.get(f) {
        Some(&number) => number,
        None => {
            *next += 1;
            *next - 1
        }
    };
    let kept = own.iter().map(number).collect();
    Ok(Chosen::new(&found.model, &own, kept))
}

/// The error with the number of the face in the complete model.
fn numbered(error: RegionError, kept: &[usize]) -> SelectError {
    SelectError::Region(match error {
        RegionError::Face { face, source_entity, reason } => RegionError::Face {
            face: kept.get(face).copied().unwrap_or(face),
            source_entity,
            reason,
        },
        other => other,
    })
}

//! Choice of faces of a model by body, number, entity, name, layer, colour, place and direction.
//!
//! Every list of a [`FaceSelection`] chooses the union of its items without those that begin with `!`; the faces chosen
//! are those that all lists choose. The faces keep their numbers in the complete model: [`Chosen::kept`].
//!
//! Regions in plan come last: faces that their curves cross are split. The first part of a face has its number, other
//! parts have numbers above those of the complete model.

mod chosen;
mod error;
mod items;
mod nearest;
mod pattern;
mod reference;
mod region;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

pub use self::chosen::Chosen;
pub use self::error::SelectError;
pub use self::reference::ChosenReference;
pub use self::region::plan_pieces;

use self::items::{Chooser, ITEM_LENGTH_MAX, ITEMS_MAX, by_items};
use self::region::by_region;
use kanagata_cad::Model;
use kanagata_cad::model::Face;
use kanagata_geometry::Vec3;
use kanagata_tool::selection::{FaceSelection, Facing, SelectionBox};

/// Vector area of a face relative to its area below which it has no mean normal: closed faces.
const MEAN_NORMAL_MIN_REL: f64 = 1e-6;

/// Chooses faces of `model`.
///
/// # Errors
/// [`SelectError`] for an item that is malformed or chooses no face, and when the lists have no face in common.
pub fn choose(model: &Model, selection: &FaceSelection) -> Result<Chosen, SelectError> {
    let chosen = chosen_faces(model, selection)?;
    let kept: Vec<usize> = (0..model.faces.len()).filter(|&f| chosen[f]).collect();
    let mut chosen = Chosen::new(model, &kept.clone(), kept);
    let mut next = model.faces.len();
    for (pieces, inside) in [(&selection.within, true), (&selection.outside, false)] {
        if !pieces.is_empty() {
            chosen = by_region(&chosen, pieces, inside, &mut next)?;
        }
    }
    Ok(chosen)
}

/// Whether each face of `model` is chosen.
fn chosen_faces(model: &Model, selection: &FaceSelection) -> Result<Vec<bool>, SelectError> {
    let mut lists: Vec<(&'static str, Vec<bool>)> = Vec::new();
    for (chooser, items) in [
        (Chooser::Bodies, &selection.bodies),
        (Chooser::Faces, &selection.faces),
        (Chooser::Layers, &selection.layers),
        (Chooser::Colours, &selection.colours),
    ] {
        if !items.is_empty() {
            lists.push((chooser.plural(), by_items(model, chooser, items)?));
        }
    }
    if !selection.boxes.is_empty() {
        lists.push(("boxes", by_boxes(model, &selection.boxes)?));
    }
    if let Some(facing) = &selection.facing {
        lists.push(("direction", by_direction(model, facing)?));
    }
    let all = vec![true; model.faces.len()];
    let both = |mut sum: Vec<bool>, (_, list): &(&str, Vec<bool>)| {
        sum.iter_mut().zip(list).for_each(|(a, b)| *a &= b);
        sum
    };
    let chosen = lists.iter().fold(all, both);
    if chosen.contains(&true) {
        return Ok(chosen);
    }
    let count = |(name, list): &(&str, Vec<bool>)| {
        format!("{name}: {}", list.iter().filter(|c| **c).count())
    };
    let counts = lists.iter().map(count).collect::<Vec<_>>().join(", ");
    Err(SelectError::Nothing { faces: model.faces.len(), counts })
}

/// Faces whose bounding box is inside a box, with a margin of the joining tolerance.
fn by_boxes(model: &Model, boxes: &[SelectionBox]) -> Result<Vec<bool>, SelectError> {
    if boxes.len() > ITEMS_MAX {
        let (what, found) = ("boxes", boxes.len());
        return Err(SelectError::TooLong { what, found, max: ITEMS_MAX, length: ITEM_LENGTH_MAX });
    }
    if let Some(bad) = boxes.iter().find(|b| !(0..3).all(|k| b.min[k] <= b.max[k])) {
        return Err(SelectError::EmptyBox { min: bad.min, max: bad.max });
    }
    let bounds: Vec<_> = model.faces.par_iter().map(Face::bbox).collect();
    let near = model.join_tolerance.max(0.0);
    let inside = |f: usize, b: &SelectionBox| {
        let own = &bounds[f];
        (0..3).all(|k| own.min[k] >= b.min[k] - near && own.max[k] <= b.max[k] + near)
    };
    let mut chosen = vec![boxes.iter().all(|b| b.excluded); model.faces.len()];
    for (excluded, value) in [(false, true), (true, false)] {
        for b in boxes.iter().filter(|b| b.excluded == excluded) {
            let found: Vec<usize> = (0..bounds.len()).filter(|&f| inside(f, b)).collect();
            if found.is_empty() {
                let all = model.bbox();
                let (low, high) = (all.min.into(), all.max.into());
                return Err(SelectError::NothingInside { min: b.min, max: b.max, low, high });
            }
            found.into_iter().for_each(|f| chosen[f] = value);
        }
    }
    Ok(chosen)
}

/// Faces whose mean normal is within the angle of the direction.
fn by_direction(model: &Model, facing: &Facing) -> Result<Vec<bool>, SelectError> {
    let direction = Vec3::from(facing.direction);
    let angle = facing.angle_deg.to_radians();
    if !(direction.norm() > 0.0
        && direction.norm().is_finite()
        && (0.0..=180.0).contains(&facing.angle_deg))
    {
        return Err(SelectError::Direction {
            direction: facing.direction,
            angle: facing.angle_deg,
        });
    }
    let looks = |face: &Face| {
        let n = face.vector_area(1e-9);
        let has_mean = n.norm() > MEAN_NORMAL_MIN_REL * face.area(1e-9);
        has_mean && n.cross(&direction).norm().atan2(n.dot(&direction)) <= angle
    };
    let chosen: Vec<bool> = model.faces.par_iter().map(looks).collect();
    if chosen.contains(&true) {
        return Ok(chosen);
    }
    Err(SelectError::NothingFacing { direction: facing.direction, angle: facing.angle_deg })
}

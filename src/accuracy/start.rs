//! The first mesh of a sequence.

use super::model::{Model, PlanMesh};
use kanagata_run::advice::longest_element;
use kanagata_scene::Plan;
use kanagata_scene::types::BlankShape;
use kanagata_solver::SimulationSetup;
use kanagata_solver::sheet::refine::plan_elements;

/// Fewest elements along a direction of the blank, other than a strip's single one. Half as many leave four points on a side
/// of the border; twice as many are four times the elements.
const ELEMENTS_MIN: f64 = 6.0;

/// The first mesh over that of the scene, at most: a radius that needs more is a small one beside a large sheet, where further
/// meshes are refined. With twice as much the first run may take four times as long.
const FINER_MAX: f64 = 4.0;
/// Elements in plan up to which the first mesh may be finer than that of the scene. With four times as many it takes more
/// memory and time than the scene leads to expect, before any limit can stop it.
const FINER_ELEMENTS_MAX: f64 = 2_500.0;

/// The model of the first run: elements of the longest length with which they do not invert over the smallest radius that
/// the sheet can touch, in the scene's proportions; solid-shells in one layer of at most six points, increments with the error
/// `increment_error`.
pub(super) fn start(plan: &Plan, setup: &SimulationSetup, increment_error: f64) -> Option<Model> {
    let model = Model::of(&plan.scene.blank, increment_error)?.with_fewest();
    let wanted = longest_element(setup);
    let factor = longest_length(&plan.scene.blank.shape) / wanted;
    let counts = model.mesh.counts();
    let fewest = counts.iter().filter(|n| **n > 1).min().map_or(1.0, |&n| ELEMENTS_MIN / n as f64);
    // Strips of one element across are divided along their length only.
    let strip = counts.contains(&1);
    let room = FINER_ELEMENTS_MAX / plan_elements(setup.body.mesh()).len().max(1) as f64;
    let finer = if strip { room } else { room.sqrt() }.clamp(1.0, FINER_MAX);
    let factor = factor.max(fewest).min(finer);
    Some(Model { mesh: model.mesh.scaled(factor), ..model })
}

/// Length of the longest element of a blank [mm], without the single elements across a strip.
fn longest_length(shape: &BlankShape) -> f64 {
    match (PlanMesh::of(shape), shape) {
        (Some(mesh), BlankShape::Rectangle { size_mm, .. }) => {
            let lengths = size_mm.iter().zip(mesh.counts());
            let along = |several: bool| {
                lengths.clone().filter(move |(_, n)| !several || *n > 1).map(|(l, n)| l / n as f64)
            };
            along(true).reduce(f64::max).or(along(false).reduce(f64::max)).unwrap_or(0.0)
        }
        (
            Some(mesh),
            BlankShape::QuarterDisc { radius_mm, .. } | BlankShape::Disc { radius_mm, .. },
        ) => {
            // The core takes about 0.4 of the radius.
            let [core, rings] = mesh.counts().map(|n| n as f64);
            (0.4 * radius_mm / core).max(0.6 * radius_mm / rings)
        }
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_element_of_a_strip_is_along_it() {
        let strip =
            BlankShape::Rectangle { corner_mm: [0.0; 2], size_mm: [70.0, 5.0], elements: [70, 1] };
        assert_eq!(longest_length(&strip), 1.0);
        let plate = BlankShape::Rectangle {
            corner_mm: [0.0; 2],
            size_mm: [70.0, 50.0],
            elements: [70, 10],
        };
        assert_eq!(longest_length(&plate), 5.0);
        let disc = BlankShape::Disc { radius_mm: 50.0, core: 10, rings: 10 };
        assert!((longest_length(&disc) - 3.0).abs() < 1e-12);
    }
}

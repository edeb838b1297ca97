//! Increments, points and layers: the error that each leaves, measured by refining it alone on the first mesh.

use std::collections::BTreeMap;

use super::distance::Quantity;
use super::model::{Model, POINTS};
use super::quantities::Results;
use kanagata_report::record::HistoryRow;

/// A numerical choice besides the mesh in plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Choice {
    /// Length of the increments.
    Increments,
    /// Points through the thickness of a layer of solid-shells.
    Points,
    /// Layers of elements.
    Layers,
}

/// Most points through the thickness of a solid-shell.
const POINTS_MAX: u8 = 10;
/// Most layers that are tried. One layer has the bending moment (`docs/guide/elements-layers-points.md`); the effect of further layers is that of shear and of contact.
const LAYERS_MAX: usize = 4;
/// Shortest increments that are tried, over those of the first run. Each further half doubles the time.
const INCREMENTS_MIN: f64 = 0.25;

/// Part of the allowed error up to which increments and points stay as they are. With half of it runs get shorter increments
/// that do not need them.
const CHOICE_SHARE: f64 = 0.3;
/// The same for layers: each doubling more than doubles the time of all further runs, where a mesh that is finer by 1.2 takes
/// half as much more. All three together then make 0.8 of what is allowed.
const LAYERS_SHARE: f64 = 0.7;

impl Choice {
    /// Part of the allowed error up to which this choice is not refined.
    pub(super) fn share(self) -> f64 {
        if self == Self::Layers { LAYERS_SHARE } else { CHOICE_SHARE }
    }

    /// Name in records.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Increments => "increments",
            Self::Points => "points",
            Self::Layers => "layers",
        }
    }

    /// The model with this choice refined once; `None` where it cannot be. `first`: largest increment of each stage of the
    /// first run.
    pub(super) fn refined(self, model: &Model, first: &[f64]) -> Option<Model> {
        match self {
            Self::Increments => {
                let now = model.increments.as_deref().unwrap_or(first);
                let next: Vec<f64> = now.iter().map(|x| 0.5 * x).collect();
                let shortest = next.iter().zip(first).map(|(a, b)| a / b).fold(1.0, f64::min);
                let fits = shortest >= INCREMENTS_MIN && !next.is_empty();
                fits.then(|| Model { increments: Some(next), ..model.clone() })
            }
            Self::Points => {
                let now = model.points()?;
                (now < POINTS_MAX).then(|| model.with_points(POINTS_MAX))
            }
            Self::Layers => {
                let next = 2 * model.layers;
                (next <= LAYERS_MAX).then(|| Model { layers: next, ..model.clone() })
            }
        }
    }

    /// The model with this choice one step coarser; `None` for the first one.
    pub(super) fn coarsened(self, model: &Model, first: &[f64]) -> Option<Model> {
        match self {
            Self::Increments => {
                let now = model.increments.as_ref()?;
                let before: Vec<f64> = now.iter().map(|x| 2.0 * x).collect();
                let increments = before.iter().zip(first).any(|(a, b)| a < b).then_some(before);
                Some(Model { increments, ..model.clone() })
            }
            Self::Points => (model.points()? == POINTS_MAX).then(|| model.with_points(POINTS)),
            Self::Layers => {
                (model.layers > 1).then(|| Model { layers: model.layers / 2, ..model.clone() })
            }
        }
    }

    /// What the error is proportional to: the length of the increments (backward Euler), the inverse squares of the points
    /// and of the layers. From 6 to 10 points errors fall as the first power where tension moves the neutral surface at one
    /// place; their mean over a sheet falls faster.
    fn scale(self, model: &Model, first: &[f64]) -> f64 {
        match self {
            Self::Increments => {
                let now = model.increments.as_deref().unwrap_or(first);
                now.iter().zip(first).map(|(a, b)| a / b).fold(0.0, f64::max)
            }
            Self::Points => model.points().map_or(1.0, |points| 1.0 / f64::from(points).powi(2)),
            Self::Layers => 1.0 / (model.layers as f64).powi(2),
        }
    }

    /// Errors of `coarse` and `fine` over the change between them.
    pub(super) fn errors_over_change(
        self,
        coarse: &Model,
        fine: &Model,
        first: &[f64],
    ) -> [f64; 2] {
        let (a, b) = (self.scale(coarse, first), self.scale(fine, first));
        [a / (a - b), b / (a - b)]
    }
}

/// Largest increment of each of `stages` stages in a history, as a fraction of the stage.
pub(super) fn largest_increments(rows: &[HistoryRow], stages: usize) -> Vec<f64> {
    let mut largest = vec![0.0_f64; stages];
    let mut before = 0.0;
    for row in rows {
        // An increment that ends a stage has its whole number as process time.
        let stage = ((row.time.ceil() - 1.0).max(0.0) as usize).min(stages.saturating_sub(1));
        if let Some(largest) = largest.get_mut(stage) {
            *largest = largest.max(row.time - before);
        }
        before = row.time;
    }
    largest.iter().map(|x| if *x > 0.0 { x.min(1.0) } else { 1.0 }).collect()
}

/// Error of every quantity by choice.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Parts(BTreeMap<String, BTreeMap<&'static str, f64>>);

impl Parts {
    /// Sets the part of a choice from the change between two runs. False where a quantity cannot be compared.
    pub(super) fn set(&mut self, choice: Choice, factor: f64, runs: (&Results, &Results)) -> bool {
        let mut complete = true;
        for quantity in Quantity::of(runs.0) {
            let Some(change) = quantity.distance(runs.0, runs.1) else {
                complete = false;
                continue;
            };
            self.0.entry(quantity.name()).or_default().insert(choice.name(), factor * change);
        }
        complete
    }

    /// The parts of a quantity by choice.
    pub(super) fn of(&self, quantity: &Quantity) -> BTreeMap<&'static str, f64> {
        self.0.get(&quantity.name()).cloned().unwrap_or_default()
    }

    /// The error that they make together.
    pub(super) fn together(&self, quantity: &Quantity) -> f64 {
        together(self.of(quantity).into_values())
    }
}

/// Error of several sources: the root of the sum of the squares, as for errors of independent signs.
pub(super) fn together(parts: impl Iterator<Item = f64>) -> f64 {
    parts.map(|part| part * part).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::model::PlanMesh;
    use super::*;
    use kanagata_solver::element::ElementKind;

    fn model() -> Model {
        Model {
            mesh: PlanMesh::Rectangle([4, 4]),
            levels: None,
            layers: 1,
            element: ElementKind::default(),
            increments: None,
        }
    }

    #[test]
    fn choices_are_refined_to_their_ends() {
        let first = [0.1, 0.5];
        let finer = Choice::Increments.refined(&model(), &first).unwrap();
        assert_eq!(finer.increments, Some(vec![0.05, 0.25]));
        let finest = Choice::Increments.refined(&finer, &first).unwrap();
        assert_eq!(Choice::Increments.refined(&finest, &first), None);
        assert_eq!(Choice::Increments.coarsened(&finest, &first), Some(finer.clone()));
        assert_eq!(Choice::Increments.coarsened(&finer, &first), Some(model()));
        assert_eq!(Choice::Increments.coarsened(&model(), &first), None);
        assert_eq!(Choice::Increments.errors_over_change(&model(), &finer, &first), [2.0, 1.0]);
        let most = Choice::Points.refined(&model(), &first).unwrap();
        assert_eq!((most.points(), Choice::Points.refined(&most, &first)), (Some(10), None));
        assert_eq!(Choice::Points.coarsened(&most, &first), Some(model().with_points(POINTS)));
        let two = Choice::Layers.refined(&model(), &first).unwrap();
        assert_eq!(Choice::Layers.coarsened(&two, &first), Some(model()));
        assert_eq!(Choice::Layers.coarsened(&model(), &first), None);
        let errors = Choice::Layers.errors_over_change(&model(), &two, &first);
        assert!((errors[0] - 4.0 / 3.0).abs() < 1e-12 && (errors[1] - 1.0 / 3.0).abs() < 1e-12);
        let hexahedra = Model { element: ElementKind::Hex8, ..model() };
        assert_eq!(Choice::Points.refined(&hexahedra, &first), None);
    }

    #[test]
    fn increments_are_those_of_their_stage() {
        let row = |time: f64| HistoryRow {
            increment: 1,
            stage: String::new(),
            time,
            travel_mm: Vec::new(),
            force_n: Vec::new(),
            pressure_mpa: Vec::new(),
            iterations: 1,
            contacts: [0; 2],
            energy: Default::default(),
        };
        let rows = [row(0.5), row(1.0), row(1.1), row(1.35), row(2.0)];
        let largest = largest_increments(&rows, 3);
        assert!((largest[0] - 0.5).abs() < 1e-12 && (largest[1] - 0.65).abs() < 1e-12);
        assert_eq!(largest[2], 1.0);
    }
}

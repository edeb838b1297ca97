//! Points and layers: the error that each leaves, measured by refining it alone on a coarse mesh. Increments: the error that
//! a run estimates of its own.

use std::collections::BTreeMap;

use super::distance::Quantity;
use super::model::{Model, POINTS};
use super::quantities::Results;
use kanagata_scene::accuracy::Accuracy;

/// A numerical choice besides the mesh in plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Choice {
    /// Points through the thickness of a layer of solid-shells.
    Points,
    /// Layers of elements.
    Layers,
}

/// Most points through the thickness of a solid-shell.
const POINTS_MAX: u8 = 10;
/// Most layers that are tried. One layer has the bending moment (`docs/guide/elements-layers-points.md`); the effect of further layers is that of shear and of contact.
const LAYERS_MAX: usize = 4;
/// Part of the allowed error up to which points stay as they are, and which the increments may have. With half of it runs get
/// shorter increments that they do not need.
pub(super) const CHOICE_SHARE: f64 = 0.3;
/// Name of the part of the increments in records.
const INCREMENTS: &str = "increments";
/// The same for layers: each doubling more than doubles the time of all further runs, where a mesh that is finer by 1.2 takes
/// half as much more. All three together then make 0.8 of what is allowed.
const LAYERS_SHARE: f64 = 0.7;

/// Smallest and largest error of the increments that a run may be given.
const INCREMENT_ERRORS: [f64; 2] = [1e-4, 0.05];
/// The error of the increments in the first run where errors are asked for as lengths only, or of the thickness. Runs after it
/// follow from what it finds. With it the force of P1 is off by 1.7 % at most, 0.3 % in the mean (docs/results/solver.md).
const INCREMENT_ERROR_UNKNOWN: f64 = 0.01;

/// The error of the increments that is small beside the allowed error `fraction` of all quantities.
pub(super) fn increment_error_within(fraction: f64) -> f64 {
    (CHOICE_SHARE * fraction).clamp(INCREMENT_ERRORS[0], INCREMENT_ERRORS[1])
}

/// The error of the increments that the first run may have. The thickness is not among the quantities: its error is over the
/// thickness, not over the change that the process makes.
pub(super) fn first_increment_error(asked: &Accuracy) -> f64 {
    let fractions = [asked.force, asked.draw_in, asked.springback];
    let smallest = fractions.into_iter().flatten().reduce(f64::min);
    smallest.map_or(INCREMENT_ERROR_UNKNOWN, increment_error_within)
}

impl Choice {
    /// Part of the allowed error up to which this choice is not refined.
    pub(super) fn share(self) -> f64 {
        if self == Self::Layers { LAYERS_SHARE } else { CHOICE_SHARE }
    }

    /// Name in records.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Points => "points",
            Self::Layers => "layers",
        }
    }

    /// The model with this choice refined once; `None` where it cannot be.
    pub(super) fn refined(self, model: &Model) -> Option<Model> {
        match self {
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
    pub(super) fn coarsened(self, model: &Model) -> Option<Model> {
        match self {
            Self::Points => (model.points()? == POINTS_MAX).then(|| model.with_points(POINTS)),
            Self::Layers => {
                (model.layers > 1).then(|| Model { layers: model.layers / 2, ..model.clone() })
            }
        }
    }

    /// What the error is proportional to: the inverse squares of the points and of the layers. From 6 to 10 points errors fall as the first power where tension moves the neutral surface at one
    /// place; their mean over a sheet falls faster.
    fn scale(self, model: &Model) -> f64 {
        match self {
            Self::Points => model.points().map_or(1.0, |points| 1.0 / f64::from(points).powi(2)),
            Self::Layers => 1.0 / (model.layers as f64).powi(2),
        }
    }

    /// Errors of `coarse` and `fine` over the change between them.
    pub(super) fn errors_over_change(self, coarse: &Model, fine: &Model) -> [f64; 2] {
        let (a, b) = (self.scale(coarse), self.scale(fine));
        [a / (a - b), b / (a - b)]
    }
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

    /// Sets the part of the increments: every quantity lacks the fraction `of_work` of what the process makes of it.
    pub(super) fn set_increments(&mut self, of_work: f64, results: &Results) {
        for quantity in Quantity::of(results) {
            let part = of_work * quantity.effect(results).unwrap_or(0.0);
            self.0.entry(quantity.name()).or_default().insert(INCREMENTS, part);
        }
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
            increment_error: 0.01,
        }
    }

    #[test]
    fn choices_are_refined_to_their_ends() {
        let most = Choice::Points.refined(&model()).unwrap();
        assert_eq!((most.points(), Choice::Points.refined(&most)), (Some(10), None));
        assert_eq!(Choice::Points.coarsened(&most), Some(model().with_points(POINTS)));
        let two = Choice::Layers.refined(&model()).unwrap();
        assert_eq!(Choice::Layers.coarsened(&two), Some(model()));
        assert_eq!(Choice::Layers.coarsened(&model()), None);
        let errors = Choice::Layers.errors_over_change(&model(), &two);
        assert!((errors[0] - 4.0 / 3.0).abs() < 1e-12 && (errors[1] - 1.0 / 3.0).abs() < 1e-12);
        let hexahedra = Model { element: ElementKind::Hex8, ..model() };
        assert_eq!(Choice::Points.refined(&hexahedra), None);
    }

    /// A force of 200 N, a sheet of 0.8 mm that thins to 0.7 mm, a border that moves by 5 mm: 1 % of each, of the thickness 1 %
    /// of the change.
    #[test]
    fn increments_have_a_part_of_what_the_process_makes() {
        use super::super::quantities::ForceCurve;
        use kanagata_geometry::Vec2;
        let force = ForceCurve {
            tool: "punch".into(),
            stages: vec![[0.0, 1.0]],
            points: vec![[0.0, 0.0], [1.0, 200.0]],
        };
        let results = Results {
            forces: vec![force],
            initial_mm: 0.8,
            border: vec![(0.0, Vec2::new(3.0, 4.0))],
            ..Results::default()
        };
        let mut parts = Parts::default();
        parts.set_increments(0.01, &results);
        let of = |quantity: Quantity| parts.together(&quantity);
        assert_eq!(of(Quantity::Force("punch".into())), 2.0);
        assert_eq!(of(Quantity::DrawIn), 0.05);
    }
}

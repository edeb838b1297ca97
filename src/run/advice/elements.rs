//! Layers of elements and points through the thickness, compared with what bending requires.

use super::finding::Finding;
use crate::cost::{Cost, TIME_EXPONENT};
use kanagata_report::doubt::DoubtCode;
use kanagata_scene::Plan;
use kanagata_solver::element::ElementKind;
use kanagata_solver::{Motion, SimulationSetup};

/// Ratio of in-plane size to layer thickness above which fully integrated hexahedra lock in bending.
const HEX8_SLENDERNESS_MAX: f64 = 4.0;
/// Tool radius over the thickness below which cross-sections of a wiped sheet do not remain straight, as found at 2 and
/// 5 (docs/results/solver.md).
const ONE_LAYER_RADIUS_MIN_REL: f64 = 6.0;
/// Tool radius over the thickness below which bending strains of a drawn sheet are as large as membrane strains, as
/// found at 5.
const BENDING_RADIUS_REL: f64 = 10.0;

fn layers(setup: &SimulationSetup) -> usize {
    setup.body.mesh().nodes_per_column.saturating_sub(1).max(1)
}

/// A doubt about one layer of hexahedra, which has two points through the thickness (docs/results/solver.md).
pub(super) fn too_few_points(plan: &Plan, setup: &SimulationSetup) -> Option<Finding> {
    let (name, off) = match plan.scene.blank.element {
        ElementKind::Hex8 => ("hex8", "a third low and springback a fifth high"),
        ElementKind::Hex8Enhanced => ("hex8-enhanced", "a seventh high and springback an eighth"),
        ElementKind::SolidShell { .. } => return None,
    };
    (layers(setup) == 1).then(|| {
        Finding::doubt(
            DoubtCode::TooFewPoints,
            "blank.layers".into(),
            format!(
                "One layer of {name} has two points through the thickness: where the sheet bends, its moment is {off}."
            ),
            "Use two layers of \"hex8-enhanced\", or one of \"solid-shell\" (within 2 %)."
                .into(),
        )
        .exceeds([2.0, 3.0])
    })
}

/// Notes on layers and points. Arguments: element size and smallest tool radius [mm].
pub(super) fn findings(
    plan: &Plan,
    setup: &SimulationSetup,
    (size, sharpest): (f64, f64),
    cost: &Cost,
    out: &mut Vec<Finding>,
) {
    let springs_back = springs_back(setup);
    let thickness = setup.body.mesh().mean_thickness();
    let bending = Bending { layers: layers(setup), thickness, size, sharpest, springs_back, cost };
    match plan.scene.blank.element {
        ElementKind::Hex8 => out.extend(bending.too_stiff()),
        ElementKind::Hex8Enhanced => out.extend(bending.layers_of_enhanced()),
        ElementKind::SolidShell { points, .. } => {
            out.extend(bending.layers_of_solid_shell());
            if bending.layers == 1 {
                let for_springback = bending.points_for_springback(points);
                out.extend(bending.points_for_thinning(points));
                // Seven points are less accurate than six: one note says both.
                out.extend(for_springback.or_else(|| bending.points_too_many(points)));
            }
        }
    }
}

fn springs_back(setup: &SimulationSetup) -> bool {
    let released = |m: &Motion| matches!(m, Motion::Release | Motion::Absent);
    setup.stages.iter().skip(1).any(|s| s.motions.iter().any(released))
}

/// The bending of a sheet and the resolution of its mesh.
struct Bending<'a> {
    layers: usize,
    /// Mean thickness of the sheet [mm].
    thickness: f64,
    /// Mean in-plane size of the elements [mm].
    size: f64,
    /// Smallest radius of the tools [mm].
    sharpest: f64,
    springs_back: bool,
    cost: &'a Cost,
}

/// Points through the thickness required for bending, and for thinning over a sharp radius.
const POINTS_NEEDED: [u8; 2] = [6, 10];

impl Bending<'_> {
    /// Run time with `layers` over the run time with the current number.
    fn time_with(&self, layers: u8) -> f64 {
        (f64::from(layers + 1) / (self.layers + 1) as f64).powf(TIME_EXPONENT)
    }

    /// Smallest tool radius over the thickness.
    fn radius_rel(&self) -> f64 {
        self.sharpest / self.thickness
    }

    /// Note: locking of hex8 in bending.
    fn too_stiff(&self) -> Option<Finding> {
        let slender = self.size / (self.thickness / self.layers as f64);
        (slender > HEX8_SLENDERNESS_MAX).then(|| {
            Finding::note(
                format!(
                    "hex8 elements of {:.2} mm are {slender:.0} times as long as thick and too stiff where the sheet bends",
                    self.size
                ),
                if self.layers > 1 {
                    let percent = 100.0 * self.time_with(1);
                    format!("solid-shell bends with one layer, for about {percent:.0} % of the time")
                } else {
                    "solid-shell bends with one layer".into()
                },
            )
        })
    }

    fn layers_of_enhanced(&self) -> Option<Finding> {
        (self.layers > 3).then(|| {
            Finding::note(
                format!("{} layers of hex8-enhanced: two bend within a few per cent", self.layers),
                format!("two take about {}", self.cost.times(self.time_with(2))),
            )
        })
    }

    /// Note: one layer is too few for a flange wiped over a sharp radius; several are more than needed elsewhere.
    fn layers_of_solid_shell(&self) -> Option<Finding> {
        let sharp = self.springs_back && self.sharpest < ONE_LAYER_RADIUS_MIN_REL * self.thickness;
        if self.layers == 1 && sharp {
            return Some(Finding::note(
                format!(
                    "one layer of solid-shell over a radius of {:.2} mm, {:.1} thicknesses, and a stage that releases tools: a flange wiped over such a radius springs back by up to twice what several layers find",
                    self.sharpest,
                    self.radius_rel()
                ),
                format!(
                    "two layers take about {}, three or four agree with hexahedra",
                    self.cost.times(self.time_with(2))
                ),
            ));
        }
        (self.layers > 1 && !sharp).then(|| {
            let [one, now] = [self.time_with(1), 1.0].map(|share| self.cost.times(share));
            Finding::note(
                format!("{} layers of solid-shell: one bends as well", self.layers),
                format!("one takes {one} in place of {now}"),
            )
        })
    }

    /// Run time with `wanted` points through the thickness in place of `points`.
    fn cost_of_points(&self, wanted: u8, points: u8) -> String {
        let cost = self.cost;
        let share = cost.elements_s * cost.iterations[0] / cost.seconds[0].max(1e-300);
        let change = 1.0 + share * (f64::from(wanted) / f64::from(points) - 1.0);
        format!("{wanted} take about {}", cost.times(change))
    }

    /// Note: too few points through one layer of solid-shell elements for springback.
    fn points_for_springback(&self, points: u8) -> Option<Finding> {
        // Integration of bilinear and Swift laws in pure bending, R/t 5 to 100 (docs/results/solver.md).
        let off = match points {
            ..=3 => "10 to 12 % low",
            4 => {
                "right in pure bending, and up to a third off where tension moves the neutral surface"
            }
            5 => "4 to 6 % low",
            7 => "2 to 3 % low",
            _ => return None,
        };
        self.springs_back.then(|| {
            Finding::note(
                format!(
                    "{points} points through the thickness and a stage that releases tools: the moment of bending, and springback with it, is {off}"
                ),
                self.cost_of_points(POINTS_NEEDED[0], points),
            )
        })
    }

    /// Note: too few points for thinning over a sharp radius.
    fn points_for_thinning(&self, points: u8) -> Option<Finding> {
        let radius = self.radius_rel();
        (radius < BENDING_RADIUS_REL && points < POINTS_NEEDED[1] - 1).then(|| {
            Finding::note(
                format!(
                    "{points} points through the thickness, over a radius of {radius:.1} thicknesses: thinning of a sheet drawn over it may have an error of a third (by 5 points at 5 thicknesses)"
                ),
                self.cost_of_points(POINTS_NEEDED[1], points),
            )
        })
    }

    fn points_too_many(&self, points: u8) -> Option<Finding> {
        let drawn = self.radius_rel() < BENDING_RADIUS_REL;
        let enough = POINTS_NEEDED[usize::from(drawn)];
        (points > enough).then(|| {
            Finding::note(
                format!("{points} points through the thickness: {enough} are enough here"),
                self.cost_of_points(enough, points),
            )
        })
    }
}

//! Layers of elements, and points through their thickness, against what bending needs.

use super::finding::Finding;
use crate::report::doubt::DoubtCode;
use crate::run::cost::{Cost, GROWTH};
use crate::scene::Plan;
use crate::solver::element::ElementKind;
use crate::solver::{Motion, SimulationSetup};

/// In-plane size over layer thickness from which fully integrated hexahedra are far too stiff in bending.
const SLENDER: f64 = 4.0;
/// Radius of a tool over the thickness below which sections of a sheet that is wiped over it do not stay straight: so at 2 and 5
/// (docs/results/solver.md).
const SHARP: f64 = 6.0;
/// Radius over the thickness below which a sheet that is drawn over it is bent as much as it is stretched: seen at 5.
const DRAWN: f64 = 10.0;

fn layers(setup: &SimulationSetup) -> usize {
    setup.body.mesh().nodes_per_column.saturating_sub(1).max(1)
}

/// A remark on one layer of hexahedra, which have two points through it (docs/results/solver.md).
pub(super) fn too_few(plan: &Plan, setup: &SimulationSetup) -> Option<Finding> {
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
            "Use two layers of \"hex8-enhanced\", or one of \"solid-shell\" with 7 points (within 3 %)."
                .into(),
        )
        .exceeds([2.0, 3.0])
    })
}

/// Remarks on layers and points; `size` of the elements and sharpest radius of the tools [mm].
pub(super) fn remarks(
    plan: &Plan,
    setup: &SimulationSetup,
    (size, sharpest): (f64, f64),
    cost: &Cost,
    out: &mut Vec<Finding>,
) {
    let blank = &plan.scene.blank;
    let (layers, thickness) = (layers(setup), setup.body.mesh().mean_thickness());
    let slender = size / (thickness / layers as f64);
    let springs_back = springs_back(setup);
    let sharp = springs_back && sharpest < SHARP * thickness;
    let fewer = (2.0 / (layers + 1) as f64).powf(GROWTH);
    match blank.element {
        ElementKind::Hex8 if slender > SLENDER => out.push(Finding::note(
            format!(
                "hex8 elements of {size:.2} mm are {slender:.0} times as long as thick and too stiff where the sheet bends"
            ),
            if layers > 1 {
                format!("solid-shell bends with one layer, for about {:.0} % of the time", 100.0 * fewer)
            } else {
                "solid-shell bends with one layer".into()
            },
        )),
        ElementKind::SolidShell { .. } if layers == 1 && sharp => out.push(Finding::note(
            format!(
                "one layer of solid-shell over a radius of {sharpest:.2} mm, {:.1} thicknesses, and a stage that releases tools: a flange wiped over such a radius springs back by up to twice what several layers find",
                sharpest / thickness
            ),
            format!("two layers take about {}, three or four agree with hexahedra", cost.times(1.5_f64.powf(GROWTH))),
        )),
        ElementKind::SolidShell { .. } if layers > 1 && !sharp => out.push(Finding::note(
            format!("{layers} layers of solid-shell: one bends as well"),
            format!("one takes {} in place of {}", cost.times(fewer), cost.times(1.0)),
        )),
        ElementKind::Hex8Enhanced if layers > 3 => out.push(Finding::note(
            format!("{layers} layers of hex8-enhanced: two bend within a few per cent"),
            format!("two take about {}", cost.times((3.0 / (layers + 1) as f64).powf(GROWTH))),
        )),
        _ => {}
    }
    if let ElementKind::SolidShell { points, .. } = blank.element
        && layers == 1
    {
        points_remarks(points, springs_back, sharpest / thickness, cost, out);
    }
}

fn springs_back(setup: &SimulationSetup) -> bool {
    let released = |m: &Motion| matches!(m, Motion::Release | Motion::Absent);
    setup.stages.iter().skip(1).any(|s| s.motions.iter().any(released))
}

/// Remarks on the points through the thickness of one layer of solid-shells, drawn over `radius` thicknesses.
fn points_remarks(
    points: u8,
    springs_back: bool,
    radius: f64,
    cost: &Cost,
    out: &mut Vec<Finding>,
) {
    /// Points that bending, springback, and thinning over a sharp radius want.
    const WANTED: [u8; 3] = [5, 7, 9];
    let share = cost.elements_s * cost.iterations[0] / cost.seconds[0].max(1e-300);
    let cost_of = |wanted: u8| {
        let change = 1.0 + share * (f64::from(wanted) / f64::from(points) - 1.0);
        format!("{wanted} take about {}", cost.times(change))
    };
    // Measured at R/t 28 and 7 (docs/results/solver.md): what the rule of Gauss misses of |z|.
    let off = match points {
        ..=3 => "10 to 12 % low",
        4 => "2 to 3 % high",
        5 => "3 to 8 % low",
        _ => "1 to 2 % high",
    };
    if springs_back && points < WANTED[1] {
        out.push(Finding::note(
            format!(
                "{points} points through the thickness and a stage that releases tools: the moment of bending, and springback with it, is {off}"
            ),
            cost_of(WANTED[1]),
        ));
    }
    if radius < DRAWN && points < WANTED[2] {
        out.push(Finding::note(
            format!(
                "{points} points through the thickness, over a radius of {radius:.1} thicknesses: thinning of a sheet drawn over it may have an error of a third (by 5 points at 5 thicknesses)"
            ),
            cost_of(WANTED[2]),
        ));
    }
    let enough = WANTED[if radius < DRAWN { 2 } else { usize::from(springs_back) }];
    if points > enough {
        out.push(Finding::note(
            format!("{points} points through the thickness: {enough} are enough here"),
            cost_of(enough),
        ));
    }
}

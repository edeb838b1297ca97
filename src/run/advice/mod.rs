//! Findings about a scene before it runs: errors, doubts, and choices that cost accuracy or time.

pub(crate) mod accuracy;
mod clamping;
mod clearance;
mod coincident_nodes;
mod constrained_nodes;
mod curvature;
mod element_size;
mod elements;
mod finding;
mod free_border;
pub mod holder;
mod holder_stop;
mod initial_penetration;
mod magnitudes;
mod material;
pub(crate) mod mirror;
mod missed_sheet;
mod patches;
mod quality;
pub(crate) mod radii;
mod refinement;
mod sections;
mod shape_error;
mod sharp_edge;
mod symmetry;
mod travel;
mod unconstrained;
mod units;
mod unopposed;

use self::clamping::Clamping;
use self::element_size::Sizes;
use self::sharp_edge::Opposite;
use super::cost::Cost;
use kanagata_report::doubt::DoubtCode;
use kanagata_scene::Plan;
use kanagata_solver::reach::reachable;
use kanagata_solver::{Motion, SimulationSetup};

pub use finding::{Conversion, Finding, Level, sort};
pub use radii::longest_element;

/// Findings of a scene with placed tools that make the result of a run doubtful, and errors. `ratio` as in [`advice`].
#[must_use]
pub fn doubts(plan: &Plan, setup: &SimulationSetup, ratio: f64) -> Vec<Finding> {
    doubts_at(plan, setup, &Sizes::new(setup.body.mesh(), ratio), &reachable(setup))
}

/// [`doubts`] for given element sizes and reachable patches.
fn doubts_at(
    plan: &Plan,
    setup: &SimulationSetup,
    sizes: &Sizes,
    kept: &[Vec<bool>],
) -> Vec<Finding> {
    let mut out: Vec<Finding> = material::finding(&plan.card).into_iter().collect();
    quality::findings(plan, &mut out);
    accuracy::findings(plan, &mut out);
    sections::findings(plan, setup, &mut out);
    units::findings(setup, &mut out);
    out.extend(magnitudes::friction_not_given(plan));
    magnitudes::findings(plan, setup, &mut out);
    constrained_nodes::findings(setup, &mut out);
    out.extend(elements::too_few_points(plan, setup));
    out.extend(symmetry::oblique_rolling(plan));
    out.extend(coincident_nodes::finding(setup.body.mesh()));
    out.extend(symmetry::missing(plan, setup));
    out.extend(symmetry::asymmetric_tools(plan, setup));
    unopposed::findings(setup, &mut out);
    out.extend(unconstrained::finding(setup));
    out.extend(setup.tools.iter().filter_map(patches::without_area));
    out.extend(idle(setup));
    let part = symmetry::modelled_region(plan, setup);
    holder::findings(setup, &holder::holders(setup), &mut out);
    for (k, tool) in setup.tools.iter().enumerate() {
        let opposite = Opposite::new(setup, k, &kept[k], sizes);
        let clamping = Clamping::new(setup, k, &opposite);
        out.extend(radii::inverting(tool, &kept[k], (&part, &clamping), sizes));
    }
    out
}

/// A doubt about a scene in which no tool moves and no load acts.
fn idle(setup: &SimulationSetup) -> Option<Finding> {
    let stands = |m: &Motion| matches!(m, Motion::Hold | Motion::Release | Motion::Absent);
    let idle = setup.stages.iter().flat_map(|stage| &stage.motions).all(stands);
    (idle && setup.loads.iter().all(|&force| force == 0.0)).then(|| {
        Finding::doubt(
            DoubtCode::NothingMoves,
            String::new(),
            "No stage moves a tool and no load acts: the sheet stays as it is.".into(),
            "Give in `drive` of a stage what moves.".into(),
        )
    })
}

/// All findings of a scene with placed tools, sorted by level, then by effect.
///
/// `ratio`: element length of the set-up over that of the sheet it represents (1 if it is that sheet).
#[must_use]
pub fn advice(plan: &Plan, setup: &SimulationSetup, ratio: f64, cost: &Cost) -> Vec<Finding> {
    let sizes = Sizes::new(setup.body.mesh(), ratio);
    let (kept, part) = (reachable(setup), symmetry::modelled_region(plan, setup));
    let mut out = doubts_at(plan, setup, &sizes, &kept);
    out.extend(symmetry::unused(plan, setup, cost));
    out.extend(quality::thick_blank(plan));
    out.extend(accuracy::note(plan));
    out.extend(refinement::raised(plan));
    let sharpest = radii::sharpest(setup, &kept);
    elements::findings(plan, setup, (sizes.mean, sharpest), cost, &mut out);
    for (k, tool) in setup.tools.iter().enumerate() {
        let opposite = Opposite::new(setup, k, &kept[k], &sizes);
        let clamping = Clamping::new(setup, k, &opposite);
        patches::findings(tool, &kept[k], plan.tools[k].reachable_only, &sizes, &mut out);
        out.extend(radii::coarse(tool, &kept[k], (&part, &clamping), (&sizes, cost)));
        // Unreachable tools have a note already.
        out.extend(kept[k].contains(&true).then(|| missed_sheet::finding(setup, k)).flatten());
        out.extend(initial_penetration::finding(setup, k, &sizes));
        out.extend(sharp_edge::finding(setup, k, &kept[k], &sizes));
        out.extend(free_border::finding(setup, k, &kept, &sizes));
    }
    clearance::findings(plan, setup, &kept, &mut out);
    holder_stop::findings(setup, &mut out);
    sort(&mut out);
    out
}

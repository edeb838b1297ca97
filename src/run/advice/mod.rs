//! What a scene has too much or too little of, said before it runs, each with what it costs.

mod amounts;
mod away;
mod border;
mod clamping;
mod clearance;
mod coarse;
mod curvature;
mod elements;
mod finding;
mod fixed;
pub mod holder;
mod inside;
mod material;
mod radii;
mod seam;
mod sharp;
mod size;
mod stops;
mod symmetry;
mod tools;
mod travel;
mod unheld;
mod units;
mod unopposed;

use self::clamping::Clamping;
use self::sharp::Opposite;
use self::size::Sizes;
use super::cost::Cost;
use crate::report::doubt::DoubtCode;
use crate::scene::Plan;
use crate::solver::reach::reachable;
use crate::solver::{Motion, SimulationSetup};

pub use finding::{Conversion, Finding, Level, sort};

/// Findings of the scene, its tools placed, that make the result of a run doubtful, errors among them. `ratio` as in [`advice`].
#[must_use]
pub fn doubts(plan: &Plan, setup: &SimulationSetup, ratio: f64) -> Vec<Finding> {
    doubts_at(plan, setup, &Sizes::new(setup.body.mesh(), ratio), &reachable(setup))
}

/// [`doubts`] of elements of these sizes and patches within reach.
fn doubts_at(
    plan: &Plan,
    setup: &SimulationSetup,
    sizes: &Sizes,
    kept: &[Vec<bool>],
) -> Vec<Finding> {
    let mut out: Vec<Finding> = material::remark(&plan.card).into_iter().collect();
    units::findings(setup, &mut out);
    out.extend(amounts::friction_not_given(plan));
    amounts::remarks(plan, setup, &mut out);
    fixed::findings(setup, &mut out);
    out.extend(elements::too_few(plan, setup));
    out.extend(symmetry::askew(plan));
    out.extend(seam::remark(setup.body.mesh()));
    out.extend(symmetry::missing(plan, setup));
    out.extend(symmetry::wrong(plan, setup));
    unopposed::remarks(setup, &mut out);
    out.extend(unheld::remark(setup));
    out.extend(setup.tools.iter().filter_map(tools::without_area));
    out.extend(idle(setup));
    let part = symmetry::part(plan, setup);
    holder::findings(setup, &holder::holders(setup, kept), &mut out);
    for (k, tool) in setup.tools.iter().enumerate() {
        let opposite = Opposite::new(setup, k, &kept[k], sizes);
        let clamping = Clamping::new(setup, k, &kept[k], &opposite);
        out.extend(radii::folding(tool, &kept[k], (&part, &clamping), sizes));
    }
    out
}

/// A scene in which nothing is to happen.
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

/// All findings of a scene whose tools have been placed, sorted by level, then by effect. `ratio`: length of the set-up's elements
/// over those of the sheet that they stand for (1 where it is that sheet).
#[must_use]
pub fn advice(plan: &Plan, setup: &SimulationSetup, ratio: f64, cost: &Cost) -> Vec<Finding> {
    let sizes = Sizes::new(setup.body.mesh(), ratio);
    let (kept, part) = (reachable(setup), symmetry::part(plan, setup));
    let mut out = doubts_at(plan, setup, &sizes, &kept);
    out.extend(symmetry::unused(plan, setup, cost));
    let sharpest = radii::sharpest(setup, &kept);
    elements::remarks(plan, setup, (sizes.mean, sharpest), cost, &mut out);
    for (k, tool) in setup.tools.iter().enumerate() {
        let opposite = Opposite::new(setup, k, &kept[k], &sizes);
        let clamping = Clamping::new(setup, k, &kept[k], &opposite);
        tools::remarks(tool, &kept[k], &sizes, &mut out);
        out.extend(radii::coarse(tool, &kept[k], (&part, &clamping), (&sizes, cost)));
        // Of a tool that is out of reach that has been said.
        out.extend(kept[k].contains(&true).then(|| away::remark(setup, k)).flatten());
        out.extend(inside::remark(setup, k, &sizes));
        out.extend(sharp::remark(setup, k, &kept[k], &sizes));
        out.extend(border::remark(setup, k, &kept, &sizes));
    }
    clearance::remarks(plan, setup, &kept, &mut out);
    stops::remarks(setup, &mut out);
    sort(&mut out);
    out
}

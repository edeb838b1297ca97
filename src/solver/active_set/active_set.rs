//! The active set of a system: what is predicted at an iterate and of its linearisation, and the changes that follow.

use super::approach::TOUCHING_GAP_REL;
use super::driven_tools::{keep_pushed_tools, opposed, switch};
use super::update::{Changes, Gap, Pivoting, Predicted, Tolerances, update};
use crate::geometry::Vec3;
use crate::solver::contact::candidate::Candidate;
use crate::solver::limits::Limits;
use crate::solver::linear::LinearError;
use crate::solver::system::correction::{Correction, Foretold};
use crate::solver::system::system::System;

/// Travel past a stop that is rounding, over the shortest edge.
const TRAVEL_ROUNDING_REL: f64 = 1e-10;

/// Updates the active set at a new iterate, after the search; returns how many pairs and tools were wrong. Forces are those
/// that the last correction predicted; gaps, travels and pushes are those of the iterate.
pub(in crate::solver) fn revise(
    sys: &mut System,
    last: Option<&Correction>,
    near_balance: bool,
    limits: &Limits,
    pivoting: &mut Pivoting,
) -> usize {
    sys.contact.candidates.iter_mut().for_each(|c| c.newly_active = false);
    let lost: Vec<usize> =
        sys.contact.active().map(|(k, _)| k).filter(|&k| !sys.can_touch(k)).collect();
    lost.iter().for_each(|&k| switch(sys, k, false));
    // The first iterate is a guess, from which nothing is predicted: what penetrates there need not after the first correction.
    let Some(last) = last else {
        changes(sys, &Predicted::default(), Tolerances::default(), pivoting);
        return lost.len() + keep_pushed_tools(sys);
    };
    let mut predicted = Predicted {
        forces: forces(sys, last),
        gaps: gaps(sys, gap_tolerance(sys, limits), |c| c.foot.gap),
        tools: sys.stopped_tools(|sys, tool| (sys.tools[tool].travel, sys.push_of(tool))),
    };
    if near_balance {
        predicted.forces.retain(|&(k, _)| sys.lambda(k) < 0.0);
    }
    let changes = changes(sys, &predicted, tolerances(sys, last, limits), pivoting);
    lost.len() + apply(sys, &changes) + keep_pushed_tools(sys)
}

/// Iterates the active set on the linearised system, where plasticity cannot interfere: corrects again until the predicted
/// forces push and the predicted gaps are open, or `rounds` times. Returns the last correction and how often the system was
/// solved again.
pub(in crate::solver) fn settle(
    sys: &mut System,
    mut correction: Correction,
    limits: &Limits,
    rounds: usize,
) -> Result<(Correction, usize), LinearError> {
    let mut pivoting = Pivoting::new();
    for solves in 0..rounds {
        let predicted = of_linearisation(sys, &correction, gap_tolerance(sys, limits));
        let tolerances = tolerances(sys, &correction, limits);
        let changes = changes(sys, &predicted, tolerances, &mut pivoting);
        if apply(sys, &changes) == 0 {
            return Ok((correction, solves));
        }
        keep_pushed_tools(sys);
        sys.assemble();
        let found = sys.correct_again();
        correction = opposed(sys, found)?;
    }
    Ok((correction, rounds))
}

/// What a correction of the present iterate predicts.
fn of_linearisation(sys: &System, correction: &Correction, open: f64) -> Predicted {
    let mut moves = vec![0.0; sys.tools.len()];
    correction.travels.iter().for_each(|&(tool, travel)| moves[tool] = travel);
    let gap = |c: &Candidate| {
        let du = Vec3::from_column_slice(&correction.u[3 * c.node..3 * c.node + 3]);
        let tool = sys.tools[c.tool].setup.direction * moves[c.tool];
        c.foot.gap + c.foot.normal.dot(&(du - tool))
    };
    let tools = sys.stopped_tools(|sys, tool| {
        let direction = sys.tools[tool].setup.direction;
        let of_tool = correction.foretold.iter().filter(|f| {
            let c = &sys.contact.candidates[f.candidate];
            c.tool == tool && c.active
        });
        let push = of_tool.map(|f| f.force.dot(&direction)).sum();
        (sys.tools[tool].travel + moves[tool], push)
    });
    Predicted { forces: forces(sys, correction), gaps: gaps(sys, open, gap), tools }
}

/// Gap below which a node penetrates [mm].
fn gap_tolerance(sys: &System, limits: &Limits) -> f64 {
    -0.5 * limits.gap_tolerance * sys.lengths.shortest_edge
}

fn tolerances(sys: &System, correction: &Correction, limits: &Limits) -> Tolerances {
    let largest = correction.foretold.iter().fold(0.0, |m: f64, f| m.max(f.lambda.abs()));
    // A sheet that tools alone carry along is not pushed at all: of the forces there is only rounding, but with dampers.
    let rounding = if sys.regime.is_loose() { sys.rounding_of_forces() } else { 0.0 };
    Tolerances {
        tension: -(1e-10 * largest).max(rounding),
        travel: TRAVEL_ROUNDING_REL * sys.lengths.shortest_edge,
        gap: gap_tolerance(sys, limits),
    }
}

fn changes(
    sys: &System,
    predicted: &Predicted,
    tolerances: Tolerances,
    pivoting: &mut Pivoting,
) -> Changes {
    update(predicted, |node| sys.neighbours(node), tolerances, pivoting)
}

/// Makes changes; returns how many pairs and tools were wrong.
fn apply(sys: &mut System, changes: &Changes) -> usize {
    sys.timings.cycling += usize::from(changes.cycles);
    changes.release.iter().for_each(|&k| switch(sys, k, false));
    changes.add.iter().for_each(|&k| switch(sys, k, true));
    changes.stops.iter().for_each(|&(tool, reached)| sys.stops[tool].reached = reached);
    changes.wrong
}

/// Touching pairs with the normal forces that a correction predicts.
fn forces(sys: &System, correction: &Correction) -> Vec<(usize, f64)> {
    let unloaded = !sys.regime.is_loose() && sys.is_without_loads();
    let counts = |f: &&Foretold| {
        let is_rounding = unloaded && sys.scales.of_note(f.lambda) == 0.0;
        sys.contact.candidates[f.candidate].active && !is_rounding
    };
    correction.foretold.iter().filter(counts).map(|f| (f.candidate, f.lambda)).collect()
}

/// Pairs of free nodes whose `gap` is below `open` [mm].
fn gaps(sys: &System, open: f64, gap: impl Fn(&Candidate) -> f64) -> Vec<Gap> {
    let mut busy = vec![false; sys.node_count()];
    for (_, c) in sys.contact.active() {
        busy[c.node] = true;
    }
    let free = sys.contact.candidates.iter().enumerate();
    free.filter(|(_, c)| !c.active && !busy[c.node])
        .map(|(pair, c)| Gap { pair, node: c.node, gap: gap(c) })
        .filter(|g| g.gap < open && sys.can_touch(g.pair))
        .collect()
}

/// Adds every free node that touches.
pub(in crate::solver) fn take_in(sys: &mut System) {
    let gap = TOUCHING_GAP_REL * sys.lengths.shortest_edge;
    let gaps = gaps(sys, gap, |c| c.foot.gap);
    let predicted = Predicted { forces: Vec::new(), gaps, tools: Vec::new() };
    let tolerances = Tolerances { tension: 0.0, travel: 0.0, gap };
    let changes = changes(sys, &predicted, tolerances, &mut Pivoting::new());
    apply(sys, &changes);
}

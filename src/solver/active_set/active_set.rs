//! Active set of a system: prediction from an iterate and its linearisation, and the resulting changes.

use super::driven_tools::{keep_pushed_tools, opposed, set_contact};
use super::update::{Changes, Gap, Pivoting, Predicted, Tolerances, update};
use crate::contact::candidate::Candidate;
use crate::limits::Limits;
use crate::linear::LinearError;
use crate::numbers::tolerances::{ACCURACY_REL, ROUNDING_REL};
use crate::system::correction::{Correction, Foretold};
use crate::system::system::System;
use kanagata_geometry::Vec3;

/// Updates the active set at a new iterate, after the contact search; returns the number of wrong pairs and tools.
/// Forces are those predicted by the last correction; gaps, travels and pushes are those of the iterate.
pub(crate) fn revise(
    sys: &mut System,
    last: Option<&Correction>,
    near_equilibrium: bool,
    limits: &Limits,
    pivoting: &mut Pivoting,
) -> usize {
    sys.contact.candidates.iter_mut().for_each(|c| c.newly_active = false);
    let inadmissible: Vec<usize> =
        sys.contact.active().map(|(k, _)| k).filter(|&k| !sys.can_touch(k)).collect();
    inadmissible.iter().for_each(|&k| set_contact(sys, k, false));
    // Nothing is predicted from the first iterate: nodes that penetrate there may not after the first correction.
    let Some(last) = last else {
        changes(sys, &Predicted::default(), Tolerances::default(), pivoting);
        return inadmissible.len() + keep_pushed_tools(sys);
    };
    let mut predicted = Predicted {
        forces: forces(sys, last),
        gaps: gaps(sys, gap_tolerance(sys, limits), |c| c.foot.gap),
        tools: sys.stopped_tools(|sys, tool| (sys.tools[tool].travel, sys.push_of(tool))),
    };
    if near_equilibrium {
        predicted.forces.retain(|&(k, _)| sys.lambda(k) < 0.0);
    }
    let changes = changes(sys, &predicted, tolerances(sys, last, limits), pivoting);
    inadmissible.len() + apply(sys, &changes) + keep_pushed_tools(sys)
}

/// Active-set iteration on the linearised system, which excludes the effect of plasticity. Corrections are repeated
/// until the predicted forces are compressive and the predicted gaps open, at most `max_iterations` times. Returns the last
/// correction and the number of repeated solves.
pub(crate) fn iterate_active_set(
    sys: &mut System,
    mut correction: Correction,
    limits: &Limits,
    max_iterations: usize,
) -> Result<(Correction, usize), LinearError> {
    let mut pivoting = Pivoting::new();
    for solves in 0..max_iterations {
        let predicted = predicted_by(sys, &correction, gap_tolerance(sys, limits));
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
    Ok((correction, max_iterations))
}

/// Prediction of a correction of the current iterate.
fn predicted_by(sys: &System, correction: &Correction, open: f64) -> Predicted {
    let mut tool_travels = vec![0.0; sys.tools.len()];
    correction.travels.iter().for_each(|&(tool, travel)| tool_travels[tool] = travel);
    let gap = |c: &Candidate| {
        let du = Vec3::from_column_slice(&correction.u[3 * c.node..3 * c.node + 3]);
        let tool = sys.tools[c.tool].setup.direction * tool_travels[c.tool];
        c.foot.gap + c.foot.normal.dot(&(du - tool))
    };
    let tools = sys.stopped_tools(|sys, tool| {
        let direction = sys.tools[tool].setup.direction;
        let of_tool = correction.foretold.iter().filter(|f| {
            let c = &sys.contact.candidates[f.candidate];
            c.tool == tool && c.active
        });
        let push = of_tool.map(|f| f.force.dot(&direction)).sum();
        (sys.tools[tool].travel + tool_travels[tool], push)
    });
    Predicted { forces: forces(sys, correction), gaps: gaps(sys, open, gap), tools }
}

/// Gap below which a node counts as penetrating [mm].
fn gap_tolerance(sys: &System, limits: &Limits) -> f64 {
    -0.5 * limits.gap_tolerance * sys.lengths.shortest_edge
}

fn tolerances(sys: &System, correction: &Correction, limits: &Limits) -> Tolerances {
    let largest = correction.foretold.iter().fold(0.0, |m: f64, f| m.max(f.lambda.abs()));
    // A sheet that is carried only by its tools has no contact forces except rounding and those of the dampers.
    let rounding = if sys.regime.is_loose() { sys.rounding_of_forces() } else { 0.0 };
    Tolerances {
        tension: -(ROUNDING_REL * largest).max(rounding),
        travel: ROUNDING_REL * sys.lengths.shortest_edge,
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

/// Applies changes; returns the number of wrong pairs and tools.
fn apply(sys: &mut System, changes: &Changes) -> usize {
    sys.timings.cycling += usize::from(changes.cycles);
    changes.release.iter().for_each(|&k| set_contact(sys, k, false));
    changes.add.iter().for_each(|&k| set_contact(sys, k, true));
    changes.stops.iter().for_each(|&(tool, reached)| sys.stops[tool].reached = reached);
    changes.wrong
}

/// Pairs in contact with the normal forces predicted by a correction.
fn forces(sys: &System, correction: &Correction) -> Vec<(usize, f64)> {
    let unloaded = !sys.regime.is_loose() && sys.is_without_loads();
    let counts = |f: &&Foretold| {
        let is_rounding = unloaded && sys.scales.of_note(f.lambda) == 0.0;
        sys.contact.candidates[f.candidate].active && !is_rounding
    };
    correction.foretold.iter().filter(counts).map(|f| (f.candidate, f.lambda)).collect()
}

/// Pairs of nodes without contact whose `gap` is below `open` [mm].
fn gaps(sys: &System, open: f64, gap: impl Fn(&Candidate) -> f64) -> Vec<Gap> {
    let mut in_contact = vec![false; sys.node_count()];
    for (_, c) in sys.contact.active() {
        in_contact[c.node] = true;
    }
    let free = sys.contact.candidates.iter().enumerate();
    free.filter(|(_, c)| !c.active && !in_contact[c.node])
        .map(|(pair, c)| Gap { pair, node: c.node, gap: gap(c) })
        .filter(|g| g.gap < open && sys.can_touch(g.pair))
        .collect()
}

/// Adds every node without contact that touches a tool.
pub(crate) fn take_in(sys: &mut System) {
    let gap = ACCURACY_REL * sys.lengths.shortest_edge;
    let gaps = gaps(sys, gap, |c| c.foot.gap);
    let predicted = Predicted { forces: Vec::new(), gaps, tools: Vec::new() };
    let tolerances = Tolerances { tension: 0.0, travel: 0.0, gap };
    let changes = changes(sys, &predicted, tolerances, &mut Pivoting::new());
    apply(sys, &changes);
}

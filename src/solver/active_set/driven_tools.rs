//! Tools driven by force: each keeps at least one contact.

use crate::contact::candidate::Candidate;
use crate::linear::LinearError;
use crate::numbers::tolerances::ACCURACY_REL;
use crate::system::correction::Correction;
use crate::system::system::System;
use crate::tools::role::Role;
use crate::tools::way::FACING_COS_MIN;

/// A tool driven by force needs resistance: the first node along its direction, or its stop if that is closer. A
/// distant tool, or one that only passes close nodes, is moved to the sheet. Returns the number of changes.
pub(crate) fn keep_pushed_tools(sys: &mut System) -> usize {
    let mut changes = 0;
    for tool in unopposed(sys, |_| true) {
        let first_candidate = first_along_direction(sys, tool);
        let reachable = first_candidate.filter(|&(k, distance)| sys.meets(k, distance));
        let clear_travel = if reachable.is_none() { sys.clear_travel(tool) } else { None };
        let near = if clear_travel.is_none() { first_candidate } else { None };
        let distance = near.map(|n| n.1).or(clear_travel).unwrap_or(f64::INFINITY);
        if sys.stops[tool].at - sys.tools[tool].travel < distance {
            sys.stops[tool].reached = true;
            changes += 1;
            continue;
        }
        if let Some(clear_travel) = clear_travel {
            sys.tools[tool].travel += clear_travel;
            sys.search_again(tool);
        }
        if let Some((k, _)) = near.or_else(|| first_along_direction(sys, tool)) {
            set_contact(sys, k, true);
            changes += 1;
        }
    }
    changes
}

/// The correction; recomputed if a tool had no resistance and a further node or stop along its direction is found.
pub(crate) fn opposed(
    sys: &mut System,
    found: Result<Correction, LinearError>,
) -> Result<Correction, LinearError> {
    match found {
        Err(LinearError::Unopposed { .. }) if oppose(sys) => {
            sys.assemble();
            sys.correct_again()
        }
        found => found,
    }
}

/// Adds resistance to tools driven by force whose contacts are only walls along their direction, for example where a
/// node has slid around an edge into a bore. The first node along the direction is added; a tool that meets none
/// moves to its stop. Returns whether there were any.
pub(crate) fn oppose(sys: &mut System) -> bool {
    let mut any = false;
    let faces =
        |c: &Candidate| c.foot.normal.dot(&sys.tools[c.tool].setup.direction) > FACING_COS_MIN;
    for tool in unopposed(sys, faces) {
        if let Some((k, _)) =
            first_along_direction(sys, tool).filter(|&(k, distance)| sys.meets(k, distance))
        {
            set_contact(sys, k, true);
            any = true;
        } else if sys.stops[tool].at.is_finite() {
            sys.stops[tool].reached = true;
            any = true;
        }
    }
    any
}

/// Tools driven by force that are not at their stop and have no contact for which `opposes` holds.
fn unopposed(sys: &System, opposes: impl Fn(&Candidate) -> bool) -> Vec<usize> {
    let pushed =
        |tool: &usize| matches!(sys.roles[*tool], Role::Force(_)) && !sys.stops[*tool].reached;
    let opposed = |tool: usize| sys.contact.active().any(|(_, c)| c.tool == tool && opposes(c));
    (0..sys.tools.len()).filter(pushed).filter(|&tool| !opposed(tool)).collect()
}

/// First candidate along the direction of a tool according to the contact search, and its distance [mm].
pub(crate) fn first_along_direction(sys: &System, tool: usize) -> Option<(usize, f64)> {
    let in_contact: Vec<usize> = sys.contact.active().map(|(_, c)| c.node).collect();
    let direction = sys.tools[tool].setup.direction;
    let distance = |k: usize| {
        let foot = &sys.contact.candidates[k].foot;
        let facing = foot.normal.dot(&direction);
        let ahead = foot.gap.is_finite() && facing > FACING_COS_MIN;
        ahead.then(|| foot.gap / facing).filter(|_| sys.can_touch(k))
    };
    let is_eligible = |k: &usize| {
        let c = &sys.contact.candidates[*k];
        c.tool == tool && in_contact.binary_search(&c.node).is_err()
    };
    let candidates = || {
        let of_tool = (0..sys.contact.candidates.len()).filter(is_eligible);
        of_tool.filter_map(|k| Some((k, distance(k)?)))
    };
    // Among candidates equally close up to rounding, the first.
    let near = candidates().map(|w| w.1).fold(f64::INFINITY, f64::min)
        + ACCURACY_REL * sys.lengths.shortest_edge;
    candidates().find(|w| w.1 <= near)
}

pub(crate) fn set_contact(sys: &mut System, k: usize, active: bool) {
    let c = &mut sys.contact.candidates[k];
    c.active = active;
    c.sliding = true;
    c.newly_active = active;
    c.expected = None;
    c.push = 0.0;
}

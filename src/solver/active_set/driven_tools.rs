//! Tools that are driven by force: they keep a node in contact.

use super::approach::TOUCHING_GAP_REL;
use crate::solver::contact::candidate::Candidate;
use crate::solver::linear::LinearError;
use crate::solver::system::correction::Correction;
use crate::solver::system::system::System;
use crate::solver::tools::role::Role;
use crate::solver::tools::way::FACING_COS_MIN;

/// A tool moved by force needs something to push against: the node that it comes to first, or its stop where that is nearer.
/// One that is far away, or only passes by the nodes near it, is brought to the sheet.
pub(in crate::solver) fn keep_pushed_tools(sys: &mut System) -> usize {
    let mut changes = 0;
    for tool in unopposed(sys, |_| true) {
        let seen = first_ahead(sys, tool);
        let met = seen.filter(|&(k, way)| sys.meets(k, way));
        let far = if met.is_none() { sys.way_ahead(tool) } else { None };
        let near = if far.is_none() { seen } else { None };
        let way = near.map(|n| n.1).or(far).unwrap_or(f64::INFINITY);
        if sys.stops[tool].at - sys.tools[tool].travel < way {
            sys.stops[tool].reached = true;
            changes += 1;
            continue;
        }
        if let Some(far) = far {
            sys.tools[tool].travel += far;
            sys.search_again(tool);
        }
        if let Some((k, _)) = near.or_else(|| first_ahead(sys, tool)) {
            switch(sys, k, true);
            changes += 1;
        }
    }
    changes
}

/// A correction, found anew where a tool had nothing to push against, if it comes to a node that it has not pushed so far.
pub(in crate::solver) fn opposed(
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

/// Takes in the nodes that those tools come to first which a force pushes and which touch the sheet with nothing but walls along
/// their way, as where a node has slid round an edge into a bore; one that meets none and that friction holds no longer goes to its
/// stop. Whether there are any.
pub(in crate::solver) fn oppose(sys: &mut System) -> bool {
    let mut any = false;
    let faces =
        |c: &Candidate| c.foot.normal.dot(&sys.tools[c.tool].setup.direction) > FACING_COS_MIN;
    for tool in unopposed(sys, faces) {
        if let Some((k, _)) = first_ahead(sys, tool).filter(|&(k, way)| sys.meets(k, way)) {
            switch(sys, k, true);
            any = true;
        } else if sys.stops[tool].at.is_finite() {
            sys.stops[tool].reached = true;
            any = true;
        }
    }
    any
}

/// Tools that a force pushes, that do not rest on their stop, and that touch no node whose pair `opposes` them.
fn unopposed(sys: &System, opposes: impl Fn(&Candidate) -> bool) -> Vec<usize> {
    let pushed =
        |tool: &usize| matches!(sys.roles[*tool], Role::Force(_)) && !sys.stops[*tool].reached;
    let opposed = |tool: usize| sys.contact.active().any(|(_, c)| c.tool == tool && opposes(c));
    (0..sys.tools.len()).filter(pushed).filter(|&tool| !opposed(tool)).collect()
}

/// The candidate that a tool comes to first by what the search has found, and the way there [mm].
pub(in crate::solver) fn first_ahead(sys: &System, tool: usize) -> Option<(usize, f64)> {
    let busy: Vec<usize> = sys.contact.active().map(|(_, c)| c.node).collect();
    let direction = sys.tools[tool].setup.direction;
    let way = |k: usize| {
        let foot = &sys.contact.candidates[k].foot;
        let facing = foot.normal.dot(&direction);
        let ahead = foot.gap.is_finite() && facing > FACING_COS_MIN;
        ahead.then(|| foot.gap / facing).filter(|_| sys.can_touch(k))
    };
    let may = |k: &usize| {
        let c = &sys.contact.candidates[*k];
        c.tool == tool && busy.binary_search(&c.node).is_err()
    };
    let ways = || {
        let of_tool = (0..sys.contact.candidates.len()).filter(may);
        of_tool.filter_map(|k| Some((k, way(k)?)))
    };
    // Of those that are as near but for rounding the first.
    let near = ways().map(|w| w.1).fold(f64::INFINITY, f64::min)
        + TOUCHING_GAP_REL * sys.lengths.shortest_edge;
    ways().find(|w| w.1 <= near)
}

pub(in crate::solver) fn switch(sys: &mut System, k: usize, active: bool) {
    let c = &mut sys.contact.candidates[k];
    c.active = active;
    c.sliding = true;
    c.newly_active = active;
    c.expected = None;
    c.push = 0.0;
}

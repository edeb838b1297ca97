//! The update of the active set: which pairs touch and which tools rest on their stops, from what is predicted of their
//! forces, gaps, travels and pushes.
//!
//! A primal-dual active set method in blocks: every pair that is in tension is released and every node that penetrates is
//! added, at once; when that no longer brings fewer wrong pairs, only the worst of them (block principal pivoting, Judice &
//! Pires 1994), which ends active-set cycling of large blocks.

use crate::solver::tools::stop::Stop;

/// Share of its force by which a tool may push more than required before it leaves its stop.
const PUSH_TOLERANCE_REL: f64 = 1e-9;

/// Iterations without fewer wrong pairs before only a part of them is changed.
const FULL_BLOCK_UPDATES: usize = 4;
/// Smallest part of the wrong pairs that is changed at once: one in so many.
const SMALLEST_BLOCK: usize = 6;

/// Share of the depth of the deepest neighbour that a node has to have to be added.
const CREST_DEPTH_RATIO: f64 = 0.999;

/// What is predicted of pairs and tools. Pairs are indices of candidates; their lists rise.
#[derive(Debug, Default)]
pub(in crate::solver) struct Predicted {
    /// Touching pairs and their normal forces [N]; positive: compression.
    pub(in crate::solver) forces: Vec<(usize, f64)>,
    /// Pairs that may touch, of nodes that touch no tool, with a gap below [`Tolerances::gap`].
    pub(in crate::solver) gaps: Vec<Gap>,
    /// Tools with a stop.
    pub(in crate::solver) tools: Vec<StoppedTool>,
}

/// A pair that does not touch.
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct Gap {
    /// The pair.
    pub(in crate::solver) pair: usize,
    /// Its node.
    pub(in crate::solver) node: usize,
    /// Its gap [mm].
    pub(in crate::solver) gap: f64,
}

/// A tool that a force or a spring moves no farther than its stop.
#[derive(Debug)]
pub(in crate::solver) struct StoppedTool {
    /// The tool.
    pub(in crate::solver) tool: usize,
    /// Its stop.
    pub(in crate::solver) stop: Stop,
    /// Travel [mm].
    pub(in crate::solver) travel: f64,
    /// Force on the sheet along its direction [N].
    pub(in crate::solver) push: f64,
    /// Force with which it has to push at its stop [N].
    pub(in crate::solver) required: f64,
}

/// What is rounding.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::solver) struct Tolerances {
    /// Normal force below which a pair is in tension, at most 0 [N].
    pub(in crate::solver) tension: f64,
    /// Travel past a stop [mm].
    pub(in crate::solver) travel: f64,
    /// Gap that depths are counted from [mm].
    pub(in crate::solver) gap: f64,
}

/// Changes of the active set.
#[derive(Debug, Default, PartialEq)]
pub(in crate::solver) struct Changes {
    /// Pairs to release.
    pub(in crate::solver) release: Vec<usize>,
    /// Pairs to add.
    pub(in crate::solver) add: Vec<usize>,
    /// Tools whose stop changes, and whether they rest on it now.
    pub(in crate::solver) stops: Vec<(usize, bool)>,
    /// Wrong pairs and stops, also those that are not changed yet.
    pub(in crate::solver) wrong: usize,
    /// Blocks of wrong pairs cycle and are cut down.
    pub(in crate::solver) cycles: bool,
}

/// How the updates of one increment went.
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct Pivoting {
    /// Fewest wrong pairs so far.
    fewest: usize,
    /// Updates since.
    since: usize,
}

impl Pivoting {
    pub(in crate::solver) fn new() -> Self {
        Self { fewest: usize::MAX, since: 0 }
    }

    /// How many of `wrong` pairs (of one kind) to change now.
    fn block(&self, wrong: usize) -> usize {
        if self.since <= FULL_BLOCK_UPDATES {
            wrong
        } else {
            wrong.div_ceil(self.since.min(SMALLEST_BLOCK))
        }
    }

    /// Takes the number of wrong pairs; whether blocks of them cycle and are cut down now.
    fn count(&mut self, wrong: usize) -> bool {
        if wrong < self.fewest {
            (self.fewest, self.since) = (wrong, 0);
        } else if wrong > 0 {
            self.since += 1;
        }
        wrong > 0 && self.since > FULL_BLOCK_UPDATES
    }
}

/// The changes that what is predicted asks for; `neighbours`: nodes that share an element with a node.
pub(in crate::solver) fn update<I: Iterator<Item = usize>>(
    predicted: &Predicted,
    neighbours: impl Fn(usize) -> I,
    tolerances: Tolerances,
    pivoting: &mut Pivoting,
) -> Changes {
    let tension = |&&(_, force): &&(usize, f64)| force < tolerances.tension;
    let mut release: Vec<(usize, f64)> = predicted.forces.iter().filter(tension).copied().collect();
    let mut add = penetrating(&predicted.gaps, neighbours, tolerances.gap.max(0.0));
    let wrong = release.len() + add.len();
    let cycles = pivoting.count(wrong);
    for kind in [&mut release, &mut add] {
        worst_first(kind);
        kind.truncate(pivoting.block(kind.len()));
    }
    let pairs = |kind: Vec<(usize, f64)>| kind.into_iter().map(|(pair, _)| pair).collect();
    let stops = changed_stops(&predicted.tools, tolerances.travel);
    let wrong = wrong + stops.len();
    Changes { release: pairs(release), add: pairs(add), stops, wrong, cycles }
}

/// Sorts wrong pairs, the worst in front. Of those that are as wrong as each other but for rounding, as symmetric ones are, the
/// first in order comes first, whatever the axes of the model.
fn worst_first(wrong: &mut [(usize, f64)]) {
    wrong.sort_by(|a, b| (a.1 as f32).total_cmp(&(b.1 as f32)).then(a.0.cmp(&b.0)));
}

/// Of nodes that penetrate those that are as deep as the deepest of their neighbours, each in the tool that it is deepest in.
/// Where a stretch of the sheet dips into a tool its crest is what touches; all of it at once would have to be released again
/// one row of nodes after the other. Depths are counted from the gap `from` [mm], so that nodes that just touch have one
/// whatever their rounding.
fn penetrating<I: Iterator<Item = usize>>(
    gaps: &[Gap],
    neighbours: impl Fn(usize) -> I,
    from: f64,
) -> Vec<(usize, f64)> {
    let mut inside = gaps.to_vec();
    inside.sort_by(|a, b| a.node.cmp(&b.node).then(a.gap.total_cmp(&b.gap)));
    inside.dedup_by_key(|gap| gap.node);
    let depth = |node: usize| {
        let at = inside.binary_search_by_key(&node, |gap| gap.node);
        at.map_or(0.0, |at| from - inside[at].gap)
    };
    let deepest = |node: usize| neighbours(node).map(depth).fold(0.0, f64::max);
    let crests = inside.iter().filter(|g| from - g.gap >= CREST_DEPTH_RATIO * deepest(g.node));
    crests.map(|g| (g.pair, g.gap)).collect()
}

/// Tools that have passed their stop, and those on it that push more than required: `travel <= stop`, `push <= required`,
/// one of them equal.
fn changed_stops(tools: &[StoppedTool], rounding: f64) -> Vec<(usize, bool)> {
    let changed = |t: &StoppedTool| {
        let now = if t.stop.reached {
            t.push - t.required <= PUSH_TOLERANCE_REL * t.required.abs()
        } else {
            t.travel > t.stop.at + rounding
        };
        (now != t.stop.reached).then_some((t.tool, now))
    };
    tools.iter().filter_map(changed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXACT: Tolerances = Tolerances { tension: 0.0, travel: 1e-9, gap: 0.0 };

    /// Neighbours in a row of nodes.
    fn row(node: usize) -> impl Iterator<Item = usize> {
        node.saturating_sub(1)..node + 2
    }

    fn of(forces: &[(usize, f64)], gaps: &[(usize, usize, f64)]) -> Predicted {
        let gaps = gaps.iter().map(|&(pair, node, gap)| Gap { pair, node, gap }).collect();
        Predicted { forces: forces.to_vec(), gaps, tools: Vec::new() }
    }

    #[test]
    fn pairs_in_tension_are_released_and_crests_added() {
        let predicted =
            of(&[(0, 2.0), (3, -1.0), (5, -4.0)], &[(7, 10, -0.1), (8, 11, -0.3), (9, 12, -0.2)]);
        let mut pivoting = Pivoting::new();
        let changes = update(&predicted, row, EXACT, &mut pivoting);
        assert_eq!((&changes.release[..], &changes.add[..]), (&[5, 3][..], &[8][..]));
        assert_eq!((changes.wrong, changes.cycles), (3, false));
        // Nothing is wrong: nothing changes.
        let still = update(&of(&[(0, 2.0)], &[]), row, EXACT, &mut pivoting);
        assert_eq!(still, Changes::default());
    }

    #[test]
    fn a_node_between_two_tools_is_added_to_the_one_it_is_deeper_in() {
        let predicted = of(&[], &[(1, 4, -0.1), (2, 4, -0.2)]);
        let changes = update(&predicted, row, EXACT, &mut Pivoting::new());
        assert_eq!(changes.add, [2]);
    }

    #[test]
    fn a_tool_rests_on_its_stop_or_pushes_as_it_has_to() {
        let tool = |reached, travel, push| StoppedTool {
            tool: 0,
            stop: Stop { at: 5.0, reached },
            travel,
            push,
            required: 100.0,
        };
        let changed = |tool| changed_stops(&[tool], 1e-9);
        assert_eq!(changed(tool(false, 4.9, 0.0)), []);
        assert_eq!(changed(tool(false, 5.1, 0.0)), [(0, true)]);
        assert_eq!(changed(tool(true, 5.0, 80.0)), []);
        assert_eq!(changed(tool(true, 5.0, 101.0)), [(0, false)]);
    }

    #[test]
    fn blocks_that_cycle_are_cut_down() {
        let mut pivoting = Pivoting::new();
        for _ in 0..=FULL_BLOCK_UPDATES {
            assert!(!pivoting.count(12));
            assert_eq!(pivoting.block(12), 12);
        }
        assert!(pivoting.count(12));
        assert_eq!(pivoting.block(12), 3);
        assert!(pivoting.count(13));
        assert_eq!(pivoting.block(12), 2);
        // Fewer than ever: whole blocks again.
        assert!(!pivoting.count(5));
        assert_eq!(pivoting.block(5), 5);
        assert!(!pivoting.count(0));
    }
}

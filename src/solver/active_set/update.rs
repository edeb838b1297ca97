//! Update of the active set: contact pairs and tools at their stops, from predicted forces, gaps, travels and pushes.
//!
//! Primal-dual active set method with blocks: all pairs in tension are released and all penetrating nodes are added
//! at once. If the number of wrong pairs no longer decreases, only the worst of them are changed (block principal
//! pivoting, Judice & Pires 1994), which ends active-set cycling of large blocks.

use crate::numbers::tolerances::{NEGLIGIBLE_REL, ROUNDING_REL};
use crate::tools::stop::Stop;

/// Updates without a decrease of the number of wrong pairs before only a part of them is changed. With two, iterations
/// rise by 1 %; with eight they fall by 1 %, but blocks that cycle do so longer.
const FULL_BLOCK_UPDATES_MAX: usize = 4;
/// Smallest part of the wrong pairs changed at once, as its inverse. Smaller parts end cycling as well, but need more
/// updates than an increment has.
const BLOCK_DIVISOR_MAX: usize = 6;

/// Predicted state of pairs and tools. Pairs are indices of candidates, in ascending order.
#[derive(Debug, Default)]
pub(crate) struct Predicted {
    /// Pairs in contact and their normal forces [N]; positive in compression.
    pub(crate) forces: Vec<(usize, f64)>,
    /// Admissible pairs of nodes without contact, with a gap below [`Tolerances::gap`].
    pub(crate) gaps: Vec<Gap>,
    /// Tools with a stop.
    pub(crate) tools: Vec<StoppedTool>,
}

/// A pair without contact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gap {
    /// Index of the pair.
    pub(crate) pair: usize,
    /// Node of the pair.
    pub(crate) node: usize,
    /// Gap of the pair [mm].
    pub(crate) gap: f64,
}

/// A tool with a stop, driven by a force or a spring.
#[derive(Debug)]
pub(crate) struct StoppedTool {
    /// Index of the tool.
    pub(crate) tool: usize,
    /// Stop of the tool.
    pub(crate) stop: Stop,
    /// Travel [mm].
    pub(crate) travel: f64,
    /// Force on the sheet along its direction [N].
    pub(crate) push: f64,
    /// Required force at the stop [N].
    pub(crate) required: f64,
}

/// Rounding tolerances.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Tolerances {
    /// Normal force below which a pair is in tension, at most 0 [N].
    pub(crate) tension: f64,
    /// Travel past a stop [mm].
    pub(crate) travel: f64,
    /// Reference gap of depths [mm].
    pub(crate) gap: f64,
}

/// Changes of the active set.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Changes {
    /// Pairs to release.
    pub(crate) release: Vec<usize>,
    /// Pairs to add.
    pub(crate) add: Vec<usize>,
    /// Tools whose stop state changes, and whether they are at their stop.
    pub(crate) stops: Vec<(usize, bool)>,
    /// Wrong pairs and stops, including those not changed yet.
    pub(crate) wrong: usize,
    /// The active set cycles, and blocks are reduced.
    pub(crate) cycles: bool,
}

/// State of block principal pivoting in one increment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pivoting {
    /// Smallest number of wrong pairs so far.
    fewest: usize,
    /// Updates since then.
    since: usize,
}

impl Pivoting {
    pub(crate) fn new() -> Self {
        Self { fewest: usize::MAX, since: 0 }
    }

    /// Number of `wrong` pairs (of one kind) to change.
    fn block_size(&self, wrong: usize) -> usize {
        if self.since <= FULL_BLOCK_UPDATES_MAX {
            wrong
        } else {
            wrong.div_ceil(self.since.min(BLOCK_DIVISOR_MAX))
        }
    }

    /// Registers the number of wrong pairs; returns whether the active set cycles and blocks are reduced.
    fn register(&mut self, wrong: usize) -> bool {
        if wrong < self.fewest {
            (self.fewest, self.since) = (wrong, 0);
        } else if wrong > 0 {
            self.since += 1;
        }
        wrong > 0 && self.since > FULL_BLOCK_UPDATES_MAX
    }
}

/// Changes required by the prediction. `neighbours`: nodes that share an element with a node.
pub(crate) fn update<I: Iterator<Item = usize>>(
    predicted: &Predicted,
    neighbours: impl Fn(usize) -> I,
    tolerances: Tolerances,
    pivoting: &mut Pivoting,
) -> Changes {
    let tension = |&&(_, force): &&(usize, f64)| force < tolerances.tension;
    let mut release: Vec<(usize, f64)> = predicted.forces.iter().filter(tension).copied().collect();
    let mut add = crest_nodes(&predicted.gaps, neighbours, tolerances.gap.max(0.0));
    let wrong = release.len() + add.len();
    let cycles = pivoting.register(wrong);
    for kind in [&mut release, &mut add] {
        sort_worst_first(kind);
        kind.truncate(pivoting.block_size(kind.len()));
    }
    let pairs = |kind: Vec<(usize, f64)>| kind.into_iter().map(|(pair, _)| pair).collect();
    let stops = changed_stops(&predicted.tools, tolerances.travel);
    let wrong = wrong + stops.len();
    Changes { release: pairs(release), add: pairs(add), stops, wrong, cycles }
}

/// Sorts wrong pairs by decreasing error. Errors equal up to rounding, as of symmetric pairs, are ordered by index,
/// independent of the axes of the model.
fn sort_worst_first(wrong: &mut [(usize, f64)]) {
    wrong.sort_by(|a, b| (a.1 as f32).total_cmp(&(b.1 as f32)).then(a.0.cmp(&b.0)));
}

/// Penetrating nodes that are as deep as their deepest neighbour, each with the tool in which it is deepest. Where a
/// part of the sheet penetrates a tool, its crest comes into contact; the rest would have to be released again row by
/// row. Depths are relative to the gap `from` [mm], so that nodes in contact have one regardless of rounding.
fn crest_nodes<I: Iterator<Item = usize>>(
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
    let crests = inside.iter().filter(|g| from - g.gap >= (1.0 - NEGLIGIBLE_REL) * deepest(g.node));
    crests.map(|g| (g.pair, g.gap)).collect()
}

/// Tools past their stop, and tools at their stop that push more than required: `travel <= stop`, `push <= required`,
/// one with equality.
fn changed_stops(tools: &[StoppedTool], rounding: f64) -> Vec<(usize, bool)> {
    let changed = |t: &StoppedTool| {
        let now = if t.stop.reached {
            t.push - t.required <= ROUNDING_REL * t.required.abs()
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
        // No wrong pair: no change.
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
        for _ in 0..=FULL_BLOCK_UPDATES_MAX {
            assert!(!pivoting.register(12));
            assert_eq!(pivoting.block_size(12), 12);
        }
        assert!(pivoting.register(12));
        assert_eq!(pivoting.block_size(12), 3);
        assert!(pivoting.register(13));
        assert_eq!(pivoting.block_size(12), 2);
        // Fewer than ever: full blocks again.
        assert!(!pivoting.register(5));
        assert_eq!(pivoting.block_size(5), 5);
        assert!(!pivoting.register(0));
    }
}

//! Which nodes may touch which tools, where, and since when; the conditions they then obey are in
//! [`super::condition`].

use rayon::prelude::*;

use crate::contact::Projection;
use crate::contact::friction::COULOMB_SLIP_RATIO;
use crate::geometry::Vec3;
use crate::solver::sheet::hex_mesh::HexMesh;
use crate::solver::tools::tool::Tool;

/// A node and a tool it may touch.
#[derive(Debug, Clone)]
pub(in crate::solver) struct Candidate {
    pub(in crate::solver) node: usize,
    pub(in crate::solver) tool: usize,
    pub(in crate::solver) active: bool,
    /// It touched in this very iteration.
    pub(in crate::solver) fresh: bool,
    /// Times its foot changed patches in this increment while it touched.
    pub(in crate::solver) swings: u32,
    /// It slid in the last iteration (a node that has just touched counts as sliding).
    pub(in crate::solver) sliding: bool,
    pub(in crate::solver) foot: Projection,
    /// How far the node lies past the tool's border, along the surface, over what a touching node may [1].
    pub(in crate::solver) overshoot: f64,
    /// Where the node was at the last converged increment, in the tool's frame; `None` while the tool was not there.
    pub(in crate::solver) before: Option<Vec3>,
    /// It touched at the last converged increment.
    touched: bool,
    /// Foot at the last converged increment, in the tool's frame; of a node that did not touch then, the foot it has when it
    /// comes to touch, back along the tool by what they have moved past each other.
    pub(in crate::solver) start: Vec3,
    /// Where friction measures slip from: `start`, less the slip that the law still remembers.
    pub(in crate::solver) anchor: Vec3,
    /// Tangential force over the normal one at the last balance.
    pub(in crate::solver) rubbed: Vec3,
    /// Force of the tool that friction is linearised about, if not the one of the iterate.
    pub(in crate::solver) expected: Option<Expected>,
    /// Force at which the spring of an augmented method has no length [N].
    pub(in crate::solver) push: f64,
}

/// A force of a tool on a node, as expected before equilibrium says what it is [N].
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) enum Expected {
    /// That of the last balance; friction goes with the slip.
    AsLast(Vec3),
    /// What the last correction foretold.
    Foretold(Vec3),
}

/// What a restored increment needs of a candidate.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(in crate::solver) struct SavedContact {
    active: bool,
    sliding: bool,
    patch: u32,
    before: Option<[f64; 3]>,
    start: [f64; 3],
    anchor: [f64; 3],
    push: f64,
    force: Force,
}

/// Force of a tool on a node, across its surface and along it [N]; zero where they do not touch.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(in crate::solver) struct Force {
    normal: [f64; 3],
    tangential: [f64; 3],
}

impl Force {
    pub(in crate::solver) fn of(c: &Candidate, force: &Vec3) -> Self {
        if !c.active {
            return Self::default();
        }
        let normal = c.foot.normal * c.foot.normal.dot(force);
        Self { normal: normal.into(), tangential: (force - normal).into() }
    }

    pub(in crate::solver) fn normal(&self) -> Vec3 {
        self.normal.into()
    }

    pub(in crate::solver) fn tangential(&self) -> Vec3 {
        self.tangential.into()
    }

    /// Tangential force over the normal one.
    fn rubbing(&self) -> Vec3 {
        let normal = self.normal().norm();
        if normal > 0.0 { self.tangential() / normal } else { Vec3::zeros() }
    }
}

/// All candidates, by node and tool.
#[derive(Debug, Clone)]
pub(in crate::solver) struct ContactSet {
    pub(in crate::solver) candidates: Vec<Candidate>,
    saved: Vec<SavedContact>,
}

/// How far past a tool's border a touching node goes on touching, over the reach of the search. Without it a node at
/// the very border, where sheet and tool often end together, would be lost and found for ever.
const OVERHANG_REL: f64 = 0.05;

/// Changes of patch in an increment after which a touching node stays on its patch.
const MAX_PATCH_CHANGES: u32 = 3;

impl SavedContact {
    /// That of a node that has not touched its tool yet.
    fn untouched() -> Self {
        Self {
            active: false,
            sliding: true,
            patch: u32::MAX,
            before: None,
            start: [0.0; 3],
            anchor: [0.0; 3],
            push: 0.0,
            force: Force::default(),
        }
    }
}

impl Candidate {
    /// A node that has not touched the tool yet.
    fn untouched(node: usize, tool: usize) -> Self {
        Self {
            node,
            tool,
            active: false,
            fresh: false,
            swings: 0,
            sliding: true,
            foot: Projection::nowhere(),
            overshoot: 0.0,
            before: None,
            touched: false,
            start: Vec3::zeros(),
            anchor: Vec3::zeros(),
            rubbed: Vec3::zeros(),
            expected: None,
            push: 0.0,
        }
    }

    /// Projects anew, as far as `reach` [mm] and what node and tool have moved past each other since the last balance, so that
    /// no step takes one through the other unseen. A touching node
    /// that swings between two patches, whose normals never agree quite, is held to the last one, carried on smoothly, until the increment is done.
    fn follow(&mut self, x: &Vec3, tool: &Tool, reach: f64) {
        if self.active
            && self.swings >= MAX_PATCH_CHANGES
            && let Some(foot) = tool.extended_projection(x, &self.foot)
        {
            self.foot = foot;
            return;
        }
        let hint = (self.foot.patch != u32::MAX).then_some(self.foot.patch);
        let foot = tool.within(x, hint, reach + self.way(x, tool).norm());
        self.swings += u32::from(self.active && foot.patch != self.foot.patch);
        self.foot = foot;
        if !self.active && !self.touched {
            let way = self.way(x, tool);
            self.start = foot.point - (way - foot.normal * foot.normal.dot(&way));
            self.anchor = self.start;
        }
        self.overshoot = if foot.past_border {
            let off = x - tool.shift() - foot.point;
            (off - foot.normal * foot.normal.dot(&off)).norm() / (OVERHANG_REL * reach)
        } else {
            0.0
        };
    }

    /// How node and tool have moved past each other since the last balance [mm]; not at all where there is none.
    pub(in crate::solver) fn way(&self, x: &Vec3, tool: &Tool) -> Vec3 {
        self.before.map_or_else(Vec3::zeros, |before| x - tool.shift() - before)
    }

    /// The part of the slip that goes back when the force does: as far as it rises by it. Without it a node that sticks would creep by about the
    /// transition in every increment, to be held anew.
    fn remembered(&self, transition: f64) -> Vec3 {
        let from_anchor = self.foot.point - self.anchor;
        let slip = from_anchor - self.foot.normal * self.foot.normal.dot(&from_anchor);
        let (size, most) = (slip.norm(), COULOMB_SLIP_RATIO * transition);
        if size > most { slip * (most / size) } else { slip }
    }
}

impl ContactSet {
    /// Candidates for every tool: the nodes of the faces it may touch.
    pub(in crate::solver) fn new(mesh: &HexMesh, tools: &[Tool]) -> Self {
        let mut pairs: Vec<(usize, usize)> = Vec::new();
        for (tool, t) in tools.iter().enumerate() {
            pairs.extend(t.setup.side.nodes(mesh).into_iter().map(|n| (n as usize, tool)));
        }
        pairs.sort_unstable();
        pairs.dedup();
        let candidates: Vec<_> =
            pairs.into_iter().map(|(node, tool)| Candidate::untouched(node, tool)).collect();
        let saved = vec![SavedContact::untouched(); candidates.len()];
        Self { candidates, saved }
    }

    /// Closest points of all candidates of tools that are present, as far as `reach` [mm] beyond what they have moved.
    pub(in crate::solver) fn search(
        &mut self,
        x: &[Vec3],
        tools: &[Tool],
        present: &[bool],
        reach: f64,
    ) {
        self.candidates.par_iter_mut().with_min_len(64).for_each(|c| {
            if present[c.tool] {
                c.follow(&x[c.node], &tools[c.tool], reach);
            }
        });
    }

    /// Makes the present feet those that the next increment starts from, of nodes at `x` and tools that are `present`;
    /// friction with this `transition` [mm] and these forces at the candidates [N], of which `least` is none: without a force
    /// nothing remembers the slip.
    pub(in crate::solver) fn commit(
        &mut self,
        x: &[Vec3],
        (tools, present): (&[Tool], &[bool]),
        transition: f64,
        forces: &[Force],
        least: f64,
    ) {
        let candidates = self.candidates.iter_mut().zip(&mut self.saved);
        for ((c, saved), &force) in candidates.zip(forces) {
            c.before = present[c.tool].then(|| x[c.node] - tools[c.tool].shift());
            c.touched = c.active;
            c.start = c.foot.point;
            let pushed = force.normal().norm() > least;
            let goes_on = c.active && saved.active && pushed;
            let kept = if goes_on { c.remembered(transition) } else { Vec3::zeros() };
            c.anchor = c.start - kept;
            c.rubbed = force.rubbing();
            c.fresh = false;
            c.swings = 0;
            *saved = SavedContact {
                active: c.active,
                sliding: c.sliding,
                patch: c.foot.patch,
                before: c.before.map(Into::into),
                start: c.start.into(),
                anchor: c.anchor.into(),
                push: c.push,
                force,
            };
        }
    }

    /// Whether each candidate touched at the last commit, and with which force.
    pub(in crate::solver) fn before(&self) -> impl Iterator<Item = (bool, Force)> {
        self.saved.iter().map(|saved| (saved.active, saved.force))
    }

    /// States of the last commit.
    pub(in crate::solver) fn saved(&self) -> &[SavedContact] {
        &self.saved
    }

    /// Takes over states saved by the same set-up; false when they are of another.
    pub(in crate::solver) fn resume(&mut self, saved: &[SavedContact]) -> bool {
        if saved.len() != self.candidates.len() {
            return false;
        }
        self.saved = saved.to_vec();
        self.restore();
        true
    }

    /// Takes back the states of the last commit.
    pub(in crate::solver) fn restore(&mut self) {
        for (c, saved) in self.candidates.iter_mut().zip(&self.saved) {
            c.active = saved.active;
            c.sliding = saved.sliding;
            c.foot.patch = saved.patch;
            c.before = saved.before.map(Into::into);
            c.touched = saved.active;
            c.start = saved.start.into();
            c.anchor = saved.anchor.into();
            c.rubbed = saved.force.rubbing();
            c.push = saved.push;
            c.fresh = false;
            c.swings = 0;
        }
    }

    /// Nodes in contact, and of one tool.
    pub(in crate::solver) fn active(&self) -> impl Iterator<Item = (usize, &Candidate)> {
        self.candidates.iter().enumerate().filter(|(_, c)| c.active)
    }
}

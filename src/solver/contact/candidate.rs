//! Contact candidates: pairs of node and tool, with foot point, slip anchor and history. The contact conditions are
//! in [`super::condition`].

use rayon::prelude::*;

use crate::numbers::tolerances::REPETITIONS_MAX;
use crate::sheet::hex_mesh::HexMesh;
use crate::tools::tool::Tool;
use kanagata_contact::Projection;
use kanagata_contact::friction::COULOMB_SLIP_RATIO;
use kanagata_geometry::Vec3;

/// Distance past the border of a tool, over the search radius, up to which a node stays in contact. Without this
/// tolerance, contact of a node on the border (where sheet and tool often end together) would alternate. It is
/// far less than an element, and more than a node moves along the border in an increment.
const OVERHANG_REL: f64 = 0.05;

/// A node and a tool with which it may come into contact.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub(crate) node: usize,
    pub(crate) tool: usize,
    pub(crate) active: bool,
    /// The node came into contact in this iteration.
    pub(crate) newly_active: bool,
    /// Changes of patch of the foot point in this increment while in contact.
    pub(crate) patch_changes: usize,
    /// The node slid in the last iteration; a node that has just come into contact counts as sliding.
    pub(crate) sliding: bool,
    pub(crate) foot: Projection,
    /// Distance of the node past the border of the tool, along the surface, over the tolerance for nodes in contact
    /// [1].
    pub(crate) overshoot: f64,
    /// Position at the last converged increment in the frame of the tool; `None` if the tool was absent.
    pub(crate) before: Option<Vec3>,
    /// The node was in contact at the last converged increment.
    touched: bool,
    /// Foot point at the last converged increment in the frame of the tool. For a node without contact then: its foot
    /// point at first contact, shifted back along the tool by the relative displacement.
    pub(crate) start: Vec3,
    /// Reference point of the slip: `start` minus the slip that friction remembers.
    pub(crate) anchor: Vec3,
    /// Ratio of tangential to normal force at the last equilibrium.
    pub(crate) friction_ratio: Vec3,
    /// Tool force about which friction is linearised, if not the force of the iterate.
    pub(crate) expected: Option<Expected>,
    /// Multiplier of the augmented Lagrangian method: force at which its spring is unstretched [N].
    pub(crate) push: f64,
}

/// Estimate of the force of a tool on a node before equilibrium is reached [N].
#[derive(Debug, Clone, Copy)]
pub(crate) enum Expected {
    /// Force of the last equilibrium, of which the normal part is used; friction follows from the slip.
    AsLast(Vec3),
    /// Force predicted by the last correction.
    Foretold(Vec3),
}

/// State of a candidate in a saved increment.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct SavedContact {
    active: bool,
    sliding: bool,
    patch: u32,
    before: Option<[f64; 3]>,
    start: [f64; 3],
    anchor: [f64; 3],
    push: f64,
    force: Force,
}

/// Normal and tangential force of a tool on a node [N]; zero without contact.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Force {
    normal: [f64; 3],
    tangential: [f64; 3],
}

impl Force {
    pub(crate) fn of(c: &Candidate, force: &Vec3) -> Self {
        if !c.active {
            return Self::default();
        }
        let normal = c.foot.normal * c.foot.normal.dot(force);
        Self { normal: normal.into(), tangential: (force - normal).into() }
    }

    pub(crate) fn normal(&self) -> Vec3 {
        self.normal.into()
    }

    pub(crate) fn tangential(&self) -> Vec3 {
        self.tangential.into()
    }

    /// Ratio of tangential to normal force.
    fn friction_ratio(&self) -> Vec3 {
        let normal = self.normal().norm();
        if normal > 0.0 { self.tangential() / normal } else { Vec3::zeros() }
    }
}

/// All candidates, sorted by node and tool.
#[derive(Debug, Clone)]
pub(crate) struct ContactSet {
    pub(crate) candidates: Vec<Candidate>,
    saved: Vec<SavedContact>,
}

impl SavedContact {
    /// Initial state: no contact so far.
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
    /// Initial state: no contact so far.
    fn untouched(node: usize, tool: usize) -> Self {
        Self {
            node,
            tool,
            active: false,
            newly_active: false,
            patch_changes: 0,
            sliding: true,
            foot: Projection::nowhere(),
            overshoot: 0.0,
            before: None,
            touched: false,
            start: Vec3::zeros(),
            anchor: Vec3::zeros(),
            friction_ratio: Vec3::zeros(),
            expected: None,
            push: 0.0,
        }
    }

    /// Updates the foot point. The search radius is `reach` [mm] plus the relative displacement since the last
    /// equilibrium, so that no step passes the node through the tool undetected. The normals of two patches differ
    /// slightly at their common side. A node in contact that alternates between them is projected onto the smooth
    /// extension of the last patch until the end of the increment.
    fn follow(&mut self, x: &Vec3, tool: &Tool, reach: f64) {
        if self.active
            && self.patch_changes >= REPETITIONS_MAX
            && let Some(foot) = tool.extended_projection(x, &self.foot)
        {
            self.foot = foot;
            return;
        }
        let hint = (self.foot.patch != u32::MAX).then_some(self.foot.patch);
        let foot = tool.within(x, hint, reach + self.relative_displacement(x, tool).norm());
        self.patch_changes += usize::from(self.active && foot.patch != self.foot.patch);
        self.foot = foot;
        if !self.active && !self.touched {
            let relative_displacement = self.relative_displacement(x, tool);
            self.start = foot.point
                - (relative_displacement - foot.normal * foot.normal.dot(&relative_displacement));
            self.anchor = self.start;
        }
        self.overshoot = if foot.past_border {
            let offset = x - tool.shift() - foot.point;
            (offset - foot.normal * foot.normal.dot(&offset)).norm() / (OVERHANG_REL * reach)
        } else {
            0.0
        };
    }

    /// Displacement of the node relative to the tool since the last equilibrium [mm]; zero without one.
    pub(crate) fn relative_displacement(&self, x: &Vec3, tool: &Tool) -> Vec3 {
        self.before.map_or_else(Vec3::zeros, |before| x - tool.shift() - before)
    }

    /// Elastic part of the slip, which is recovered when the force is removed; at most the length over which friction
    /// rises. Without it a sticking node would creep by about the transition length in every increment.
    fn elastic_slip(&self, transition: f64) -> Vec3 {
        let from_anchor = self.foot.point - self.anchor;
        let slip = from_anchor - self.foot.normal * self.foot.normal.dot(&from_anchor);
        let (size, elastic_max) = (slip.norm(), COULOMB_SLIP_RATIO * transition);
        if size > elastic_max { slip * (elastic_max / size) } else { slip }
    }
}

impl ContactSet {
    /// Candidates of every tool: the nodes of the faces it may touch. A hanging node has no contact condition: its masters
    /// carry the force between them.
    pub(crate) fn new(mesh: &HexMesh, tools: &[Tool]) -> Self {
        let mut pairs: Vec<(usize, usize)> = Vec::new();
        for (tool, t) in tools.iter().enumerate() {
            pairs.extend(t.setup.side.nodes(mesh).into_iter().map(|n| (n as usize, tool)));
        }
        pairs.retain(|&(node, _)| mesh.masters(node).is_none());
        pairs.sort_unstable();
        pairs.dedup();
        let candidates: Vec<_> =
            pairs.into_iter().map(|(node, tool)| Candidate::untouched(node, tool)).collect();
        let saved = vec![SavedContact::untouched(); candidates.len()];
        Self { candidates, saved }
    }

    /// Updates the foot points of all candidates of tools that are `present`. The search radius is `reach` [mm] plus
    /// the relative displacement.
    pub(crate) fn search(&mut self, x: &[Vec3], tools: &[Tool], present: &[bool], reach: f64) {
        self.candidates.par_iter_mut().with_min_len(64).for_each(|c| {
            if present[c.tool] {
                c.follow(&x[c.node], &tools[c.tool], reach);
            }
        });
    }

    /// Makes the current foot points the reference of the next increment. Friction has the given `transition` [mm]
    /// and `forces` at the candidates [N]. Forces up to `force_min` count as zero; without a force no slip is remembered.
    pub(crate) fn commit(
        &mut self,
        x: &[Vec3],
        (tools, present): (&[Tool], &[bool]),
        transition: f64,
        forces: &[Force],
        force_min: f64,
    ) {
        let candidates = self.candidates.iter_mut().zip(&mut self.saved);
        for ((c, saved), &force) in candidates.zip(forces) {
            c.before = present[c.tool].then(|| x[c.node] - tools[c.tool].shift());
            c.touched = c.active;
            c.start = c.foot.point;
            let is_loaded = force.normal().norm() > force_min;
            let remains_loaded = c.active && saved.active && is_loaded;
            let remembered_slip =
                if remains_loaded { c.elastic_slip(transition) } else { Vec3::zeros() };
            c.anchor = c.start - remembered_slip;
            c.friction_ratio = force.friction_ratio();
            c.newly_active = false;
            c.patch_changes = 0;
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

    /// Contact state and force of each candidate at the last commit.
    pub(crate) fn before(&self) -> impl Iterator<Item = (bool, Force)> {
        self.saved.iter().map(|saved| (saved.active, saved.force))
    }

    /// States of the last commit.
    pub(crate) fn saved(&self) -> &[SavedContact] {
        &self.saved
    }

    /// Sets states saved by the same model; returns false if the number of candidates differs.
    pub(crate) fn resume(&mut self, saved: &[SavedContact]) -> bool {
        if saved.len() != self.candidates.len() {
            return false;
        }
        self.saved = saved.to_vec();
        self.restore();
        true
    }

    /// Restores the states of the last commit.
    pub(crate) fn restore(&mut self) {
        for (c, saved) in self.candidates.iter_mut().zip(&self.saved) {
            c.active = saved.active;
            c.sliding = saved.sliding;
            c.foot.patch = saved.patch;
            c.before = saved.before.map(Into::into);
            c.touched = saved.active;
            c.start = saved.start.into();
            c.anchor = saved.anchor.into();
            c.friction_ratio = saved.force.friction_ratio();
            c.push = saved.push;
            c.newly_active = false;
            c.patch_changes = 0;
        }
    }

    /// Candidates in contact with their indices.
    pub(crate) fn active(&self) -> impl Iterator<Item = (usize, &Candidate)> {
        self.candidates.iter().enumerate().filter(|(_, c)| c.active)
    }
}

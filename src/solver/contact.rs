//! Node to smooth rigid tool: which nodes touch, and the conditions a touching node puts in the place of its
//! equilibrium. Exact, no penalty; the multiplier is what its equilibrium leaves over.
//!
//! | symbol | meaning |
//! |---|---|
//! | `r` | internal minus applied force at the node = force of the tool on it [N] |
//! | `p` | position of the node in the tool's frame; `anchor` its foot at the last converged increment, less remembered slip |
//! | `n` | the tool's normal at the foot, within the node's free directions |
//! | `g` | gap; `lambda = n . r`; `r_t = P r` with `P` the tangential projector |
//! | `h` | curvature of the surface through `p` parallel to the tool: `dn = -h dp` |
//! | `s` | slip `P (p - anchor)` |
//!
//! A touching node's three equations, as one vector in space: `k g n + R_t = 0`, where `R_t = k s` while it
//! sticks and Coulomb's residual while it slips. Its linearisation is
//! `A K du + B dp + residual = 0` with the node's rows `K` of the tangent: the pattern of the mesh is kept.
//!
//! To compare, a spring may stand between node and tool ([`super::stages::ContactMethod`]): `g` is then
//! `g + (lambda - push) / stiffness`, with the force `push` known from outside (zero for a penalty).

use rayon::prelude::*;

use super::tools::{SheetSide, Tool};
use crate::contact::Projection;
use crate::contact::friction::{Coulomb, Friction, FrictionPoint};
use crate::geometry::{Mat3, Vec3};

/// A node and a tool it may touch.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub(super) node: usize,
    pub(super) tool: usize,
    pub(super) active: bool,
    /// It touched in this very iteration.
    pub(super) fresh: bool,
    /// Times its foot changed patches in this increment while it touched.
    pub(super) swings: u32,
    /// It slid in the last iteration (a node that has just touched counts as sliding).
    pub(super) sliding: bool,
    pub(super) foot: Projection,
    /// How far the node lies past the tool's border, along the surface, over what a touching node may [1].
    pub(super) overshoot: f64,
    /// Foot at the last converged increment, in the tool's frame.
    pub(super) start: Vec3,
    /// Where friction measures slip from: `start`, less the slip that the law still remembers.
    pub(super) anchor: Vec3,
    /// Force at which the spring of an augmented method has no length [N].
    pub(super) push: f64,
}

/// What a restored increment needs of a candidate.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct SavedContact {
    active: bool,
    sliding: bool,
    patch: u32,
    start: [f64; 3],
    anchor: [f64; 3],
    #[serde(default)]
    push: f64,
}

/// All candidates, by node and tool.
#[derive(Debug, Clone)]
pub(super) struct ContactSet {
    pub(super) candidates: Vec<Candidate>,
    saved: Vec<SavedContact>,
}

/// The conditions of one node: `a` acts on its rows of the tangent, `b` on its own displacement.
#[derive(Debug, Clone)]
pub(super) struct Condition {
    pub(super) node: usize,
    /// Touching candidate, if any.
    pub(super) candidate: Option<usize>,
    pub(super) a: Mat3,
    pub(super) b: Mat3,
    /// Part of `b` that acts on the displacement relative to the tool.
    pub(super) b_tool: Mat3,
    pub(super) residual: Vec3,
    /// Residual in newtons (equilibrium, Coulomb's law), without the scaled lengths.
    pub(super) force: Vec3,
    /// Violation of gap and stick [mm].
    pub(super) length: f64,
    /// Normal used.
    pub(super) normal: Vec3,
    pub(super) slipping: bool,
}

/// Stiffnesses that scale the conditions [N/mm]; from the elastic tangent, so that units cancel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scales {
    pub(super) normal: f64,
    pub(super) tangential: f64,
    /// Slip that is nothing but rounding [mm].
    pub(super) rounding: f64,
    /// One over the stiffness of the spring between node and tool [mm/N]; 0: none.
    pub(super) compliance: f64,
}

/// How far past a tool's border a touching node goes on touching, over the reach of the search. Without it a node at
/// the very border, where sheet and tool often end together, would be lost and found for ever.
const OVERHANG: f64 = 0.05;

/// Slip that friction remembers from one increment to the next, over its transition: the law is within a fiftieth of
/// Coulomb's force there.
const REMEMBERED: f64 = 5.0;

/// Changes of patch in an increment after which a touching node stays on its patch.
const SWINGS: u32 = 3;

impl Candidate {
    /// Projects anew. A touching node that swings between two patches, whose normals never agree quite, is
    /// held to the last one, carried on smoothly, until the increment is done.
    fn follow(&mut self, x: &Vec3, tool: &Tool, reach: f64) {
        if self.active
            && self.swings >= SWINGS
            && let Some(foot) = tool.carried_on(x, &self.foot)
        {
            self.foot = foot;
            return;
        }
        let hint = (self.foot.patch != u32::MAX).then_some(self.foot.patch);
        let foot = tool.within(x, hint, reach);
        self.swings += u32::from(self.active && foot.patch != self.foot.patch);
        self.foot = foot;
        self.overshoot = if foot.past_border {
            let off = x - tool.shift() - foot.point;
            (off - foot.normal * foot.normal.dot(&off)).norm() / (OVERHANG * reach)
        } else {
            0.0
        };
    }
}

impl Candidate {
    /// The part of the slip that goes back when the force does. Without it a node that sticks would creep by about the
    /// transition in every increment, to be held anew.
    fn remembered(&self, transition: f64) -> Vec3 {
        let from_anchor = self.foot.point - self.anchor;
        let slip = from_anchor - self.foot.normal * self.foot.normal.dot(&from_anchor);
        let (size, most) = (slip.norm(), REMEMBERED * transition);
        if size > most { slip * (most / size) } else { slip }
    }
}

impl ContactSet {
    /// Candidates for every tool: the nodes of the faces it may touch.
    pub(super) fn new(top: &[u32], bottom: &[u32], tools: &[Tool]) -> Self {
        let mut pairs: Vec<(usize, usize)> = Vec::new();
        for (tool, t) in tools.iter().enumerate() {
            if matches!(t.setup.side, SheetSide::Top | SheetSide::Both) {
                pairs.extend(top.iter().map(|&n| (n as usize, tool)));
            }
            if matches!(t.setup.side, SheetSide::Bottom | SheetSide::Both) {
                pairs.extend(bottom.iter().map(|&n| (n as usize, tool)));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let candidates: Vec<_> = pairs
            .into_iter()
            .map(|(node, tool)| Candidate {
                node,
                tool,
                active: false,
                fresh: false,
                swings: 0,
                sliding: true,
                foot: Projection::nowhere(),
                overshoot: 0.0,
                start: Vec3::zeros(),
                anchor: Vec3::zeros(),
                push: 0.0,
            })
            .collect();
        let saved = candidates
            .iter()
            .map(|_| SavedContact {
                active: false,
                sliding: true,
                patch: u32::MAX,
                start: [0.0; 3],
                anchor: [0.0; 3],
                push: 0.0,
            })
            .collect();
        Self { candidates, saved }
    }

    /// Closest points of all candidates of tools that are present, as far as `reach` [mm].
    pub(super) fn search(&mut self, x: &[Vec3], tools: &[Tool], present: &[bool], reach: f64) {
        self.candidates.par_iter_mut().with_min_len(64).for_each(|c| {
            if present[c.tool] {
                c.follow(&x[c.node], &tools[c.tool], reach);
            }
        });
    }

    /// Makes the present feet those that the next increment starts from; friction with this `transition` [mm].
    pub(super) fn commit(&mut self, transition: f64) {
        for (c, saved) in self.candidates.iter_mut().zip(&mut self.saved) {
            c.start = c.foot.point;
            let kept =
                if c.active && saved.active { c.remembered(transition) } else { Vec3::zeros() };
            c.anchor = c.start - kept;
            c.fresh = false;
            c.swings = 0;
            *saved = SavedContact {
                active: c.active,
                sliding: c.sliding,
                patch: c.foot.patch,
                start: c.start.into(),
                anchor: c.anchor.into(),
                push: c.push,
            };
        }
    }

    /// States of the last commit.
    pub(super) fn saved(&self) -> &[SavedContact] {
        &self.saved
    }

    /// Takes over states saved by the same set-up; false when they are of another.
    pub(super) fn resume(&mut self, saved: &[SavedContact]) -> bool {
        if saved.len() != self.candidates.len() {
            return false;
        }
        self.saved = saved.to_vec();
        self.restore();
        true
    }

    /// Takes back the states of the last commit.
    pub(super) fn restore(&mut self) {
        for (c, saved) in self.candidates.iter_mut().zip(&self.saved) {
            c.active = saved.active;
            c.sliding = saved.sliding;
            c.foot.patch = saved.patch;
            c.start = saved.start.into();
            c.anchor = saved.anchor.into();
            c.push = saved.push;
            c.fresh = false;
            c.swings = 0;
        }
    }

    /// Nodes in contact, and of one tool.
    pub(super) fn active(&self) -> impl Iterator<Item = (usize, &Candidate)> {
        self.candidates.iter().enumerate().filter(|(_, c)| c.active)
    }
}

/// Geometry of a touching node within its free directions.
struct Frame {
    normal: Vec3,
    gap: f64,
    /// Tangential projector.
    tangent: Mat3,
    /// Curvature at the node.
    curvature: Mat3,
}

/// A node whose free directions hold less than this share of the normal cannot be pushed by the tool.
const PUSHABLE: f64 = 0.3;

fn frame(foot: &Projection, free: &Mat3) -> Option<Frame> {
    let along = free * foot.normal;
    let share = along.norm();
    if share.is_nan() || share <= PUSHABLE {
        return None;
    }
    let normal = along / share;
    let tangent = free - normal * normal.transpose();
    let parallel = (Mat3::identity() - foot.curvature * foot.gap)
        .try_inverse()
        .map_or(foot.curvature, |inverse| foot.curvature * inverse);
    Some(Frame { normal, gap: foot.gap / share, tangent, curvature: tangent * parallel * tangent })
}

/// True when the tool can push this node where it is: the foot is not past the tool's border (or, for a node that
/// touches already, not far past it) and the normal lies in the node's free directions.
pub(super) fn can_touch(c: &Candidate, free: &Mat3) -> bool {
    let over_the_tool = !c.foot.past_border || (c.active && c.overshoot <= 1.0);
    over_the_tool && (free * c.foot.normal).norm() > PUSHABLE
}

/// Normal of a touching node within its free directions, or zero when it cannot be pushed.
pub(super) fn contact_normal(c: &Candidate, free: &Mat3) -> Vec3 {
    frame(&c.foot, free).map_or_else(Vec3::zeros, |f| f.normal)
}

/// Conditions of a touching node: `p` its position in the tool's frame, `r` the force at it, `free` the
/// projector on its free directions. `None` when the tool cannot push it.
pub(super) fn touching(
    c: &Candidate,
    p: &Vec3,
    r: &Vec3,
    free: &Mat3,
    law: Coulomb,
    scales: Scales,
) -> Option<Condition> {
    let Frame { normal, gap, tangent, curvature } = frame(&c.foot, free)?;
    let gap = gap + (normal.dot(r) - c.push) * scales.compliance;
    let from_anchor = p - c.anchor;
    let slip = tangent * from_anchor;
    let rise = normal.dot(&from_anchor);
    let by_motion = tangent + curvature * rise;
    let lambda = normal.dot(r);
    let traction = tangent * r;
    // Pulled, not pushed (an iterate on its way): no friction. A node that has just touched has no normal
    // force yet, but its coupling to friction.
    let law = if lambda > 0.0 || c.fresh { law } else { Coulomb { mu: 0.0, transition: 0.0 } };
    let bound = law.mu * lambda;
    let moved = slip.norm() > scales.rounding;
    let backward = bound > 0.0 && moved && traction.dot(&slip) > 0.25 * bound * slip.norm();
    let stiffness = if c.sliding && !backward {
        slip_stiffness(bound.max(traction.norm()), slip.norm(), scales.tangential)
    } else {
        scales.tangential
    };
    let at = FrictionPoint { lambda, traction, slip, stiffness };
    let exact = law.transition == 0.0;
    let answer = if exact && c.sliding && backward { Friction::Stick } else { law.law(&at) };
    let spring = scales.normal * scales.compliance;
    let mut out = Condition {
        node: c.node,
        candidate: None,
        a: normal * normal.transpose() * spring,
        b: Mat3::zeros(),
        b_tool: (normal * normal.transpose() - curvature * gap) * scales.normal
            - normal * (curvature * r).transpose() * spring,
        residual: normal * (gap * scales.normal),
        force: Vec3::zeros(),
        length: gap.abs(),
        normal,
        slipping: exact || slip.norm() > REMEMBERED * law.transition,
    };
    match answer {
        Friction::Stick => {
            let turn = normal * (curvature * slip).transpose();
            out.b_tool += (by_motion + turn) * scales.tangential;
            out.residual += slip * scales.tangential;
            out.length = out.length.max(slip.norm());
            out.slipping = false;
        }
        Friction::Slip { residual, by_traction, by_slip, by_lambda } => {
            out.a += tangent * (by_traction * tangent + by_lambda * normal.transpose());
            let bend = by_traction * curvature * lambda
                - by_lambda * (curvature * traction).transpose()
                + by_slip * by_motion;
            out.force = tangent * residual;
            out.b_tool += tangent * bend + normal * (curvature * out.force).transpose();
            out.residual += out.force;
        }
    }
    Some(out)
}

/// The stiffness `c` of the trial force `r_t - c s` of a node that slid (any positive value has the same
/// solution).
///
/// With `c |s| = 1.5` times the friction force a node that slid goes on, and one that has no friction force
/// yet begins to slide. A stiffness of the mesh would be too large wherever a whole part of the sheet moves
/// together: its nodes would turn back and forth for ever.
fn slip_stiffness(force: f64, slip: f64, mesh: f64) -> f64 {
    // Never so large that the rounding of `s` would show.
    let most = 10.0 * mesh;
    if force > 0.0 && most * slip > 1.5 * force { 1.5 * force / slip } else { mesh }
}

/// Adds the held directions of a node to its condition: `k (u - held) = 0` along them.
pub(super) fn hold(out: &mut Condition, free: &Mat3, offset: &Vec3, scales: Scales) {
    let held = Mat3::identity() - free;
    out.b += held * scales.normal;
    out.residual += held * offset * scales.normal;
}

/// Condition of a node that touches nothing: equilibrium in its free directions.
pub(super) fn untouched(node: usize, r: &Vec3, free: &Mat3) -> Condition {
    let force = free * r;
    Condition {
        node,
        candidate: None,
        a: *free,
        b: Mat3::zeros(),
        b_tool: Mat3::zeros(),
        residual: force,
        force,
        length: 0.0,
        normal: Vec3::zeros(),
        slipping: false,
    }
}

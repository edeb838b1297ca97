//! Node to smooth rigid tool: the conditions a touching node puts in the place of its equilibrium. Exact, no penalty; the
//! multiplier is what its equilibrium leaves over.
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
//! A touching node's equations are `g = 0` along the normal and `R_t = 0` across it, where `R_t = k s` while it sticks and
//! Coulomb's residual while it slips; as one vector `k g n + R_t`. They are linearised one by one,
//! `k n dg + P dR_t + residual = 0`, which is `A K du + B dp + residual = 0` with the node's rows `K` of the tangent: the
//! pattern of the mesh is kept. What the turning normal does to the vector's length, `k g dn` and `n (n . dR_t)`, is left
//! out: a node that has yet to come to the tool would have to glide by it, by as much as `k` says.
//!
//! To compare, a spring may stand between node and tool ([`crate::solver::limits::ContactMethod`]): `g` is then
//! `g + (lambda - push) / stiffness`, with the force `push` known from outside (zero for a penalty).

use super::candidate::{Candidate, Expected};
use super::frame::{Frame, Scales, frame};
use super::held_friction::HeldFriction;
use crate::contact::friction::{COULOMB_SLIP_RATIO, Coulomb, FrictionPoint, Slip};
use crate::geometry::{Mat3, Vec3};

/// The conditions of one node: `a` acts on its rows of the tangent, `b` on its own displacement.
#[derive(Debug, Clone)]
pub(in crate::solver) struct Condition {
    pub(in crate::solver) node: usize,
    /// Touching candidate, if any.
    pub(in crate::solver) candidate: Option<usize>,
    pub(in crate::solver) a: Mat3,
    pub(in crate::solver) b: Mat3,
    /// Part of `b` that acts on the displacement relative to the tool.
    pub(in crate::solver) b_tool: Mat3,
    pub(in crate::solver) residual: Vec3,
    /// Residual in newtons (equilibrium, Coulomb's law), without the scaled lengths.
    pub(in crate::solver) force: Vec3,
    /// Violation of gap and stick [mm].
    pub(in crate::solver) length: f64,
    /// Normal used.
    pub(in crate::solver) normal: Vec3,
    /// It slides: by more than the slip that friction remembers.
    pub(in crate::solver) slipping: bool,
    /// It sticks as the law without a transition has it.
    pub(in crate::solver) stuck: bool,
    /// Friction where the node is held.
    pub(in crate::solver) held: Option<HeldFriction>,
}

/// What resists the motion of a node at `p` along the surface of a tool that pushes it with the force `r` [N/mm]: the
/// surface's curvature, and friction's own derivative by the slip.
pub(in crate::solver) fn resistance(
    c: &Candidate,
    p: &Vec3,
    r: &Vec3,
    free: &Mat3,
    law: Coulomb,
    scales: Scales,
) -> Mat3 {
    let Some(frame) = frame(&c.foot, free) else { return Mat3::zeros() };
    let from_anchor = p - c.anchor;
    let law = law.over(frame.share);
    let lambda = frame.normal.dot(r);
    let slip = frame.slip(&from_anchor, scales);
    let (weight, gradient) = law.weight(&slip);
    let weight = weight.max(scales.rounding);
    let along = frame.tangent * slip / weight;
    let turn = frame.tangent - along * (frame.tangent * gradient).transpose();
    frame.curvature * lambda + turn * (law.mu * scales.of_note(lambda).max(0.0) / weight)
}

/// Conditions of a touching node: `p` its position in the tool's frame, `r` the force at it, `free` the
/// projector on its free directions; `idle`: no tool pushes the sheet yet. `None` when the tool cannot push it.
pub(in crate::solver) fn touching(
    c: &Candidate,
    p: &Vec3,
    r: &Vec3,
    free: &Mat3,
    law: Coulomb,
    scales: Scales,
    idle: bool,
) -> Option<Condition> {
    let frame = frame(&c.foot, free)?;
    let from_anchor = p - c.anchor;
    let Frame { normal, gap, share, tangent, curvature, .. } = &frame;
    let law = law.over(*share);
    let gap = gap + (normal.dot(r) - c.push) * scales.compliance;
    let slip = frame.slip(&from_anchor, scales);
    let rise = normal.dot(&from_anchor);
    let by_motion = tangent + curvature * rise;
    let lambda = normal.dot(r);
    let traction = tangent * r;
    let (pushed, held) = expected(c, &frame, r);
    let about = (scales.of_note(pushed), held);
    let at = FrictionPoint { lambda, traction, slip, stiffness: 0.0, about };
    // Forces that are still to come hold a sheet that lies between its tools as soon as they push it.
    let rests = idle && law.mu > 0.0 && slip.norm() <= scales.rounding;
    let answer = if rests { None } else { friction(c, law, at, &frame, scales) };
    let all_slip = law.transition == 0.0 || lambda <= 0.0;
    let mut out = closed(c.node, &frame, gap, r, scales);
    out.slipping = all_slip || slip.norm() > COULOMB_SLIP_RATIO * law.transition;
    match answer {
        None => out.stick(&by_motion, &slip, scales),
        Some(answer) => out.slide(&answer, &frame, &by_motion, &at),
    }
    Some(out)
}

/// The condition of a closed gap, without anything along the tool.
fn closed(node: usize, frame: &Frame, gap: f64, r: &Vec3, scales: Scales) -> Condition {
    let Frame { normal, curvature, .. } = frame;
    let spring = scales.normal * scales.compliance;
    Condition {
        node,
        candidate: None,
        a: normal * normal.transpose() * spring,
        b: Mat3::zeros(),
        b_tool: normal * normal.transpose() * scales.normal
            - normal * (curvature * r).transpose() * spring,
        residual: normal * (gap * scales.normal),
        force: Vec3::zeros(),
        length: gap.abs(),
        normal: *normal,
        slipping: false,
        stuck: false,
        held: None,
    }
}

/// What the last increment or the last correction has the node be pushed with, and what holds it along the tool.
fn expected(c: &Candidate, frame: &Frame, r: &Vec3) -> (f64, Option<Vec3>) {
    let Frame { normal, tangent, across, .. } = frame;
    match c.expected {
        None => (normal.dot(r), Some(tangent * r)),
        Some(Expected::AsLast(force)) => (normal.dot(&force), None),
        Some(Expected::Foretold(force)) => (normal.dot(&force), Some((tangent + across) * force)),
    }
}

impl Condition {
    /// No slip across the normal.
    fn stick(&mut self, by_motion: &Mat3, slip: &Vec3, scales: Scales) {
        self.b_tool += by_motion * scales.tangential;
        self.residual += slip * scales.tangential;
        self.length = self.length.max(slip.norm());
        (self.slipping, self.stuck) = (false, true);
    }

    /// What friction answers across the normal at a point.
    fn slide(&mut self, answer: &Slip, frame: &Frame, by_motion: &Mat3, at: &FrictionPoint) {
        let Frame { normal, tangent, across, curvature, .. } = frame;
        let Slip { residual, linear, by_traction, by_slip, by_lambda } = answer;
        self.a += tangent * (by_traction * tangent + by_lambda * normal.transpose());
        let bend = by_traction * curvature * at.lambda
            - by_lambda * (curvature * at.traction).transpose()
            + by_slip * (by_motion + across);
        self.force = tangent * residual;
        self.held = HeldFriction::of(answer, frame, at.lambda);
        self.b_tool += tangent * bend;
        self.residual += tangent * linear;
    }
}

impl Coulomb {
    /// The law by the part of the normal force in a node's free directions, of which it is this share.
    fn over(self, share: f64) -> Self {
        Self { mu: self.mu / share, ..self }
    }
}

/// Whether friction up to `bound` [N] holds a node that slid and has not moved since. One that slid until the last balance
/// has Coulomb's force exactly, and one that has just touched may have none at all: of both rounding would say whether they stick.
fn is_held(traction: &Vec3, bound: f64, scales: Scales) -> bool {
    /// Share by which the force may be over Coulomb's.
    const FRICTION_EXCESS_REL: f64 = 1e-6;
    scales.of_note(traction.norm()) <= (1.0 + FRICTION_EXCESS_REL) * bound.max(0.0)
}

/// What the law asks of a touching node, `None` to stick.
fn friction(
    c: &Candidate,
    law: Coulomb,
    at: FrictionPoint,
    frame: &Frame,
    scales: Scales,
) -> Option<Slip> {
    if law.transition > 0.0 || frame.across * at.slip != Vec3::zeros() {
        Some(law.smoothed(&at))
    } else {
        stick_or_slip(c, law, at, scales)
    }
}

/// The same by the law without a transition; the stiffness of its trial force is chosen here.
fn stick_or_slip(c: &Candidate, law: Coulomb, at: FrictionPoint, scales: Scales) -> Option<Slip> {
    let FrictionPoint { lambda, traction, slip, .. } = at;
    // Pulled, not pushed (an iterate on its way): no friction. A node that has just touched has no normal
    // force yet, but its coupling to friction.
    let pushed = scales.of_note(lambda) > 0.0;
    let law = if pushed || c.fresh { law } else { Coulomb { mu: 0.0, transition: 0.0 } };
    let bound = law.mu * lambda;
    let moved = slip.norm() > scales.rounding;
    let at_rest = c.sliding && !moved && law.mu > 0.0 && is_held(&traction, bound, scales);
    let backward = bound > 0.0 && moved && traction.dot(&slip) > 0.25 * bound * slip.norm();
    let stiffness = if c.sliding && !backward {
        slip_stiffness(bound.max(traction.norm()), slip.norm(), scales.tangential)
    } else {
        scales.tangential
    };
    if (c.sliding && backward) || at_rest {
        None
    } else {
        law.law(&FrictionPoint { stiffness, ..at })
    }
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
pub(in crate::solver) fn hold(out: &mut Condition, free: &Mat3, offset: &Vec3, scales: Scales) {
    let held = Mat3::identity() - free;
    out.b += held * scales.normal;
    out.residual += held * offset * scales.normal;
}

/// Condition of a node that touches nothing: equilibrium in its free directions.
pub(in crate::solver) fn untouched(node: usize, r: &Vec3, free: &Mat3) -> Condition {
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
        stuck: false,
        held: None,
    }
}

//! Contact conditions of a node on a smooth rigid tool; they replace its equilibrium equations. They are exact (no
//! penalty): the multiplier is the residual of equilibrium.
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
//! The equations of a node in contact are `g = 0` along the normal and `R_t = 0` in the tangent plane. `R_t = k s`
//! for stick and the Coulomb residual for slip; in vector form `k g n + R_t = 0`. The linearisation is
//! `k n dg + P dR_t + residual = 0`, i.e. `A K du + B dp + residual = 0` with the rows `K` of the tangent at the
//! node, so the pattern of the mesh is preserved.
//!
//! The terms `k g dn` and `n (n . dR_t)` due to the rotation of the normal are omitted. They would make a node that
//! has not reached the tool slide by an amount proportional to `k`.
//!
//! For comparison a spring may be placed between node and tool ([`crate::limits::ContactMethod`]). `g` is
//! then `g + (lambda - push) / stiffness` with a given force `push` (zero for the penalty method).

use super::candidate::{Candidate, Expected};
use super::frame::{Frame, Scales, frame};
use super::held_friction::HeldFriction;
use crate::numbers::tolerances::ACCURACY_REL;
use kanagata_contact::friction::{COULOMB_SLIP_RATIO, Coulomb, FrictionPoint, Slip};
use kanagata_geometry::{Mat3, Vec3};

/// Conditions of one node: `a` multiplies its rows of the tangent, `b` its displacement.
#[derive(Debug, Clone)]
pub(crate) struct Condition {
    pub(crate) node: usize,
    /// Candidate in contact, if any.
    pub(crate) candidate: Option<usize>,
    pub(crate) a: Mat3,
    pub(crate) b: Mat3,
    /// Part of `b` that multiplies the displacement relative to the tool.
    pub(crate) b_tool: Mat3,
    pub(crate) residual: Vec3,
    /// Residual force (equilibrium, Coulomb's law) [N], without the scaled lengths.
    pub(crate) force: Vec3,
    /// Violation of the gap and stick conditions [mm].
    pub(crate) length: f64,
    /// Contact normal used.
    pub(crate) normal: Vec3,
    /// Slip exceeds the slip that friction remembers.
    pub(crate) slipping: bool,
    /// The node sticks according to the law without transition.
    pub(crate) stuck: bool,
    /// Friction in the constrained directions of the node.
    pub(crate) held: Option<HeldFriction>,
}

/// Tangential stiffness of contact at `p` with the tool force `r` [N/mm]: curvature of the surface, and derivative of
/// friction by the slip.
pub(crate) fn resistance(
    c: &Candidate,
    p: &Vec3,
    r: &Vec3,
    free: &Mat3,
    law: Coulomb,
    scales: Scales,
) -> Mat3 {
    let Some(frame) = frame(&c.foot, free) else { return Mat3::zeros() };
    let from_anchor = p - c.anchor;
    let law = law.with_normal_fraction(frame.normal_fraction);
    let lambda = frame.normal.dot(r);
    let slip = frame.slip(&from_anchor, scales);
    let (weight, gradient) = law.weight(&slip);
    let weight = weight.max(scales.rounding);
    let along = frame.tangent * slip / weight;
    let slip_direction_rate = frame.tangent - along * (frame.tangent * gradient).transpose();
    frame.curvature * lambda
        + slip_direction_rate * (law.mu * scales.of_note(lambda).max(0.0) / weight)
}

/// Conditions of a node in contact. `p` is its position in the frame of the tool, `r` the force at the node, `free`
/// the projector onto its free directions. `idle`: no tool pushes the sheet yet. `None` if the normal lies outside
/// the free directions.
pub(crate) fn touching(
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
    let Frame { normal, gap, normal_fraction, tangent, curvature, .. } = &frame;
    let law = law.with_normal_fraction(*normal_fraction);
    let gap = gap + (normal.dot(r) - c.push) * scales.compliance;
    let slip = frame.slip(&from_anchor, scales);
    let rise = normal.dot(&from_anchor);
    let by_motion = tangent + curvature * rise;
    let lambda = normal.dot(r);
    let traction = tangent * r;
    let (pushed, held) = expected(c, &frame, r);
    let about = (scales.of_note(pushed), held);
    let at = FrictionPoint { lambda, traction, slip, stiffness: 0.0, about };
    // While no tool pushes yet, nodes in contact stick, so that a sheet lying between its tools is held by friction
    // that develops later.
    let sticks_idle = idle && law.mu > 0.0 && slip.norm() <= scales.rounding;
    let response = if sticks_idle { None } else { friction(c, law, at, &frame, scales) };
    let all_slip = law.transition == 0.0 || lambda <= 0.0;
    let mut out = closed(c.node, &frame, gap, r, scales);
    out.slipping = all_slip || slip.norm() > COULOMB_SLIP_RATIO * law.transition;
    match response {
        None => out.stick(&by_motion, &slip, scales),
        Some(response) => out.slide(&response, &frame, &by_motion, &at),
    }
    Some(out)
}

/// Condition of a closed gap, without tangential part.
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

/// Estimates of the normal force and, if known, of the tangential force of the node.
fn expected(c: &Candidate, frame: &Frame, r: &Vec3) -> (f64, Option<Vec3>) {
    let Frame { normal, tangent, across, .. } = frame;
    match c.expected {
        None => (normal.dot(r), Some(tangent * r)),
        Some(Expected::AsLast(force)) => (normal.dot(&force), None),
        Some(Expected::Foretold(force)) => (normal.dot(&force), Some((tangent + across) * force)),
    }
}

impl Condition {
    /// Stick: no slip in the tangent plane.
    fn stick(&mut self, by_motion: &Mat3, slip: &Vec3, scales: Scales) {
        self.b_tool += by_motion * scales.tangential;
        self.residual += slip * scales.tangential;
        self.length = self.length.max(slip.norm());
        (self.slipping, self.stuck) = (false, true);
    }

    /// Slip: friction law in the tangent plane.
    fn slide(&mut self, response: &Slip, frame: &Frame, by_motion: &Mat3, at: &FrictionPoint) {
        let Frame { normal, tangent, across, curvature, .. } = frame;
        let Slip { residual, linear, by_traction, by_slip, by_lambda } = response;
        self.a += tangent * (by_traction * tangent + by_lambda * normal.transpose());
        let bend = by_traction * curvature * at.lambda
            - by_lambda * (curvature * at.traction).transpose()
            + by_slip * (by_motion + across);
        self.force = tangent * residual;
        self.held = HeldFriction::of(response, frame, at.lambda);
        self.b_tool += tangent * bend;
        self.residual += tangent * linear;
    }
}

/// Whether friction up to `bound` [N] holds a node that slid and has not moved since. A node that slid until the last
/// equilibrium has the Coulomb force within [`ACCURACY_REL`], and a node that has just come into contact may have none. Without a
/// tolerance rounding would decide on stick or slip.
fn is_within_friction(traction: &Vec3, bound: f64, scales: Scales) -> bool {
    scales.of_note(traction.norm()) <= (1.0 + ACCURACY_REL) * bound.max(0.0)
}

/// Friction law of a node in contact; `None` for stick.
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

/// Law without transition; chooses the stiffness of the trial force.
fn stick_or_slip(c: &Candidate, law: Coulomb, at: FrictionPoint, scales: Scales) -> Option<Slip> {
    let FrictionPoint { lambda, traction, slip, .. } = at;
    // Tensile normal force (an intermediate iterate): no friction. A node that has just come into contact has no
    // normal force yet, but its friction is coupled to it.
    let pushed = scales.of_note(lambda) > 0.0;
    let law = if pushed || c.newly_active { law } else { Coulomb { mu: 0.0, transition: 0.0 } };
    let bound = law.mu * lambda;
    let moved = slip.norm() > scales.rounding;
    let at_rest =
        c.sliding && !moved && law.mu > 0.0 && is_within_friction(&traction, bound, scales);
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

/// Stiffness `c` of the trial force `r_t - c s` of a node that slid; the solution does not depend on its positive
/// value.
///
/// With `c |s|` equal to 1.5 times the friction force, a sliding node continues to slide, and a node without friction
/// force begins to slide. The stiffness of the mesh would be too large if a whole part of the sheet moves together:
/// its nodes would alternate in direction.
fn slip_stiffness(force: f64, slip: f64, mesh: f64) -> f64 {
    // Limited, so that rounding of `s` has no effect.
    let stiffness_max = 10.0 * mesh;
    if force > 0.0 && stiffness_max * slip > 1.5 * force { 1.5 * force / slip } else { mesh }
}

/// Adds the constrained directions of a node to its condition: `k (u - held) = 0`.
pub(crate) fn hold(out: &mut Condition, free: &Mat3, offset: &Vec3, scales: Scales) {
    let held = Mat3::identity() - free;
    out.b += held * scales.normal;
    out.residual += held * offset * scales.normal;
}

/// Condition of a node without contact: equilibrium in its free directions.
pub(crate) fn untouched(node: usize, r: &Vec3, free: &Mat3) -> Condition {
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

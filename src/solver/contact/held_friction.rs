//! Friction of a tool on a node in the directions in which that is held: it slides there as the tool moves, and what rubs it goes
//! to what holds it. Equilibrium does not say how much that is; Coulomb's law does, by the slip in all directions.

use super::candidate::Candidate;
use super::frame::{Frame, Scales, frame};
use crate::contact::friction::{Coulomb, Slip};
use crate::geometry::{Mat3, Vec3};

/// Friction where a node is held, linearised as the law is in its free directions.
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct HeldFriction {
    /// What the linearised law has at the iterate [N].
    linear: Vec3,
    /// Derivative by the normal force.
    by_lambda: Vec3,
    /// Derivative by the slip [N/mm].
    by_slip: Mat3,
}

impl HeldFriction {
    /// Of a law's answer to a node with the normal force `lambda` [N]; none where no direction that is held is a tangent of the
    /// tool.
    pub(in crate::solver) fn of(answer: &Slip, frame: &Frame, lambda: f64) -> Option<Self> {
        let Slip { by_lambda, by_slip, .. } = answer;
        let by_lambda = frame.across * by_lambda * -1.0;
        let slides = frame.tangent + frame.across;
        let by_slip = frame.across * by_slip * slides * -1.0;
        let any = frame.across != Mat3::zeros();
        any.then_some(Self { linear: by_lambda * lambda, by_lambda, by_slip })
    }

    /// By how much a solution changes it that changes the force at the node by `force` [N] and moves it by `way` [mm] past the
    /// tool.
    pub(in crate::solver) fn change(&self, normal: &Vec3, force: &Vec3, way: &Vec3) -> Vec3 {
        self.by_lambda * normal.dot(force) + self.by_slip * way
    }

    /// What the linearised law lacks at the iterate beside the law as it is, `force` [N].
    pub(in crate::solver) fn missing(&self, force: &Vec3) -> Vec3 {
        self.linear - force
    }
}

/// Friction in the directions in which a node is held: `p` its position in the tool's frame, `force` the part of the tool's force in
/// its free directions [N].
pub(in crate::solver) fn held_friction(
    c: &Candidate,
    p: &Vec3,
    force: &Vec3,
    free: &Mat3,
    law: Coulomb,
    scales: Scales,
) -> Vec3 {
    let Some(frame) = frame(&c.foot, free).filter(|_| law.mu > 0.0) else { return Vec3::zeros() };
    let pushed = scales.of_note(frame.normal.dot(force)).max(0.0) / frame.share;
    let slip = frame.slip(&(p - c.anchor), scales);
    let (weight, _) = law.weight(&slip);
    // Without a transition friction is what it was where nothing has moved since the last balance.
    let unmoved = weight <= scales.rounding;
    let direction = if unmoved { c.rubbed } else { slip * (-law.mu / weight) };
    frame.across * direction * pushed
}

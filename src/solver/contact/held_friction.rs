//! Friction in the constrained directions of a node: the tool slides along them, and the support carries the
//! friction. Equilibrium does not determine this force; Coulomb's law does, from the slip in all directions.

use super::candidate::Candidate;
use super::frame::{Frame, Scales, frame};
use kanagata_contact::friction::{Coulomb, Slip};
use kanagata_geometry::{Mat3, Vec3};

/// Friction in constrained directions, linearised as in the free directions.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeldFriction {
    /// Force of the linearised law at the iterate [N].
    linear: Vec3,
    /// Derivative with respect to the normal force.
    by_lambda: Vec3,
    /// Derivative with respect to the slip [N/mm].
    by_slip: Mat3,
}

impl HeldFriction {
    /// From the response of the law at a node with normal force `lambda` [N]; `None` if no constrained direction is a
    /// tangent of the tool.
    pub(crate) fn of(response: &Slip, frame: &Frame, lambda: f64) -> Option<Self> {
        let Slip { by_lambda, by_slip, .. } = response;
        let by_lambda = frame.across * by_lambda * -1.0;
        let slides = frame.tangent + frame.across;
        let by_slip = frame.across * by_slip * slides * -1.0;
        let any = frame.across != Mat3::zeros();
        any.then_some(Self { linear: by_lambda * lambda, by_lambda, by_slip })
    }

    /// Change for a change `force` [N] of the nodal force and a relative displacement `relative_displacement` [mm].
    pub(crate) fn change(&self, normal: &Vec3, force: &Vec3, relative_displacement: &Vec3) -> Vec3 {
        self.by_lambda * normal.dot(force) + self.by_slip * relative_displacement
    }

    /// Difference between the linearised law and the given `force` [N] of the law at the iterate.
    pub(crate) fn missing(&self, force: &Vec3) -> Vec3 {
        self.linear - force
    }
}

/// Friction in the constrained directions of a node [N]. `p` is its position in the frame of the tool, `force` the
/// part of the tool force in its free directions.
pub(crate) fn held_friction(
    c: &Candidate,
    p: &Vec3,
    force: &Vec3,
    free: &Mat3,
    law: Coulomb,
    scales: Scales,
) -> Vec3 {
    let Some(frame) = frame(&c.foot, free).filter(|_| law.mu > 0.0) else { return Vec3::zeros() };
    let pushed = scales.of_note(frame.normal.dot(force)).max(0.0) / frame.normal_fraction;
    let slip = frame.slip(&(p - c.anchor), scales);
    let (weight, _) = law.weight(&slip);
    // Without transition, a node that has not moved keeps the friction of the last equilibrium.
    let is_unmoved = weight <= scales.rounding;
    let direction = if is_unmoved { c.friction_ratio } else { slip * (-law.mu / weight) };
    frame.across * direction * pushed
}

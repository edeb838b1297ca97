//! Normal and tangent plane at a node in contact, and the stiffnesses that scale its conditions.

use super::candidate::Candidate;
use crate::numbers::tolerances::ACCURACY_REL;
use kanagata_contact::Projection;
use kanagata_geometry::{Mat3, Vec3};

/// Minimum fraction of the normal in the free directions of a node for contact; below, the node has no contact with
/// the tool. Travel of the tool moves the node by up to the inverse of it, three times the travel.
pub(crate) const NORMAL_FRACTION_MIN: f64 = 0.3;

/// Scaling stiffnesses of the conditions [N/mm], from the elastic tangent, so that units cancel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scales {
    pub(crate) normal: f64,
    pub(crate) tangential: f64,
    /// Slip below which it is rounding [mm].
    pub(crate) rounding: f64,
    /// Compliance of the spring between node and tool [mm/N]; 0: no spring.
    pub(crate) compliance: f64,
}

impl Scales {
    /// A force [N], or zero if it is rounding, whose sign must not decide anything.
    pub(crate) fn of_note(self, force: f64) -> f64 {
        if force.abs() > self.least() { force } else { 0.0 }
    }

    /// Force that rounding may produce [N].
    pub(crate) fn least(self) -> f64 {
        self.normal * self.rounding
    }
}

/// Geometry of a node in contact within its free directions.
pub(crate) struct Frame {
    pub(crate) normal: Vec3,
    pub(crate) gap: f64,
    /// Fraction of the normal of the tool in the free directions.
    pub(crate) normal_fraction: f64,
    /// Tangential projector.
    pub(crate) tangent: Mat3,
    /// Projector onto the constrained directions of the node, if they are tangents of the tool.
    pub(crate) across: Mat3,
    /// Curvature at the node.
    pub(crate) curvature: Mat3,
}

impl Frame {
    /// Slip in the constrained directions of the node; zero if it is rounding.
    fn across_slip(&self, from_anchor: &Vec3, scales: Scales) -> Vec3 {
        let across = self.across * from_anchor;
        if across.norm() > scales.rounding { across } else { Vec3::zeros() }
    }

    /// Slip along the tool in the free and constrained directions.
    pub(crate) fn slip(&self, from_anchor: &Vec3, scales: Scales) -> Vec3 {
        self.tangent * from_anchor + self.across_slip(from_anchor, scales)
    }
}

pub(crate) fn frame(foot: &Projection, free: &Mat3) -> Option<Frame> {
    let along = free * foot.normal;
    let normal_fraction = along.norm();
    if normal_fraction.is_nan() || normal_fraction <= NORMAL_FRACTION_MIN {
        return None;
    }
    let normal = along / normal_fraction;
    let tangent = free - normal * normal.transpose();
    // A normal with a component outside the free directions, by more than the accuracy of the geometry, has no
    // constrained tangent directions.
    let across =
        if normal_fraction > 1.0 - ACCURACY_REL { Mat3::identity() - free } else { Mat3::zeros() };
    let parallel = (Mat3::identity() - foot.curvature * foot.gap)
        .try_inverse()
        .map_or(foot.curvature, |inverse| foot.curvature * inverse);
    let curvature = tangent * parallel * tangent;
    Some(Frame {
        normal,
        gap: foot.gap / normal_fraction,
        normal_fraction,
        tangent,
        across,
        curvature,
    })
}

/// Whether contact is admissible: the foot point is not past the border of the tool (for a node in contact: within a
/// tolerance), and the normal lies sufficiently in the free directions.
pub(crate) fn can_touch(c: &Candidate, free: &Mat3) -> bool {
    let over_the_tool = !c.foot.past_border || (c.active && c.overshoot <= 1.0);
    over_the_tool && (free * c.foot.normal).norm() > NORMAL_FRACTION_MIN
}

/// Normal of a node in contact within its free directions; zero if contact is not admissible.
pub(crate) fn contact_normal(c: &Candidate, free: &Mat3) -> Vec3 {
    frame(&c.foot, free).map_or_else(Vec3::zeros, |f| f.normal)
}

/// Total force of a tool on a node from its part `force` in the free directions. If the normal has a component
/// outside the free directions, the support carries the rest.
pub(crate) fn whole_force(foot: &Projection, free: &Mat3, force: Vec3) -> Vec3 {
    let (along, held, square) = parts(foot, free);
    if square > NORMAL_FRACTION_MIN * NORMAL_FRACTION_MIN {
        force + held * (along.dot(&force) / square)
    } else {
        force
    }
}

/// Displacement in the free directions of a node with the same effect on the gap as the tool displacement `tool_displacement`. It
/// transfers the travel of a tool to the conditions of the node, and their response to the force of the tool.
pub(crate) fn seen_from(foot: &Projection, free: &Mat3, tool_displacement: Vec3) -> Vec3 {
    let (along, held, square) = parts(foot, free);
    if square > NORMAL_FRACTION_MIN * NORMAL_FRACTION_MIN {
        tool_displacement + along * (held.dot(&tool_displacement) / square)
    } else {
        tool_displacement
    }
}

/// Components of the normal in and outside the free directions of a node, and the squared norm of the first.
pub(crate) fn parts(foot: &Projection, free: &Mat3) -> (Vec3, Vec3, f64) {
    let along = free * foot.normal;
    (along, foot.normal - along, along.norm_squared())
}

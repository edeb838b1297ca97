//! Normal and tangential directions at a node in contact, and the stiffnesses that scale its conditions.

use super::candidate::Candidate;
use crate::contact::Projection;
use crate::geometry::{Mat3, Vec3};

/// Share of a normal in a node's free directions from which the directions in which that is held are tangents of the tool.
const UPRIGHT: f64 = 1.0 - 1e-6;
/// A node whose free directions hold less than this share of the normal cannot be pushed by the tool.
pub(in crate::solver) const PUSHABLE: f64 = 0.3;

/// Stiffnesses that scale the conditions [N/mm]; from the elastic tangent, so that units cancel.
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct Scales {
    pub(in crate::solver) normal: f64,
    pub(in crate::solver) tangential: f64,
    /// Slip that is nothing but rounding [mm].
    pub(in crate::solver) rounding: f64,
    /// One over the stiffness of the spring between node and tool [mm/N]; 0: none.
    pub(in crate::solver) compliance: f64,
}

impl Scales {
    /// A force [N], or zero where it is nothing but rounding: which sign that has must decide nothing.
    pub(in crate::solver) fn of_note(self, force: f64) -> f64 {
        if force.abs() > self.least() { force } else { 0.0 }
    }

    /// The force that rounding makes of nothing [N].
    pub(in crate::solver) fn least(self) -> f64 {
        self.normal * self.rounding
    }
}

/// Geometry of a touching node within its free directions.
pub(in crate::solver) struct Frame {
    pub(in crate::solver) normal: Vec3,
    pub(in crate::solver) gap: f64,
    /// Share of the tool's normal that lies in them.
    pub(in crate::solver) share: f64,
    /// Tangential projector.
    pub(in crate::solver) tangent: Mat3,
    /// Projector on the directions in which the node is held, where they are tangents of the tool.
    pub(in crate::solver) across: Mat3,
    /// Curvature at the node.
    pub(in crate::solver) curvature: Mat3,
}

impl Frame {
    /// Slip in the directions in which the node is held; nothing where that is rounding.
    fn across_slip(&self, from_anchor: &Vec3, scales: Scales) -> Vec3 {
        let across = self.across * from_anchor;
        if across.norm() > scales.rounding { across } else { Vec3::zeros() }
    }

    /// Slip along the tool, where the node is free and where it is held.
    pub(in crate::solver) fn slip(&self, from_anchor: &Vec3, scales: Scales) -> Vec3 {
        self.tangent * from_anchor + self.across_slip(from_anchor, scales)
    }
}

pub(in crate::solver) fn frame(foot: &Projection, free: &Mat3) -> Option<Frame> {
    let along = free * foot.normal;
    let share = along.norm();
    if share.is_nan() || share <= PUSHABLE {
        return None;
    }
    let normal = along / share;
    let tangent = free - normal * normal.transpose();
    // A normal that leans out of the free directions has no tangent that is held and nothing else.
    let across = if share > UPRIGHT { Mat3::identity() - free } else { Mat3::zeros() };
    let parallel = (Mat3::identity() - foot.curvature * foot.gap)
        .try_inverse()
        .map_or(foot.curvature, |inverse| foot.curvature * inverse);
    let curvature = tangent * parallel * tangent;
    Some(Frame { normal, gap: foot.gap / share, share, tangent, across, curvature })
}

/// True when the tool can push this node where it is: the foot is not past the tool's border (or, for a node that
/// touches already, not far past it) and the normal lies in the node's free directions.
pub(in crate::solver) fn can_touch(c: &Candidate, free: &Mat3) -> bool {
    let over_the_tool = !c.foot.past_border || (c.active && c.overshoot <= 1.0);
    over_the_tool && (free * c.foot.normal).norm() > PUSHABLE
}

/// Normal of a touching node within its free directions, or zero when it cannot be pushed.
pub(in crate::solver) fn contact_normal(c: &Candidate, free: &Mat3) -> Vec3 {
    frame(&c.foot, free).map_or_else(Vec3::zeros, |f| f.normal)
}

/// The whole force of a tool on a node, of which this is the part in the node's free directions: what pushes it along a tool's
/// normal that leans out of them pushes it against what holds it too.
pub(in crate::solver) fn whole_force(foot: &Projection, free: &Mat3, force: Vec3) -> Vec3 {
    let (along, held, square) = parts(foot, free);
    if square > PUSHABLE * PUSHABLE { force + held * (along.dot(&force) / square) } else { force }
}

/// The way of a node in its free directions that brings a tool as near as this way of it: what a tool moves by goes to the node's
/// conditions by it, and what they answer to the tool's force.
pub(in crate::solver) fn seen_from(foot: &Projection, free: &Mat3, way: Vec3) -> Vec3 {
    let (along, held, square) = parts(foot, free);
    if square > PUSHABLE * PUSHABLE { way + along * (held.dot(&way) / square) } else { way }
}

/// The parts of a tool's normal in a node's free directions and across them, and the square of the first.
pub(in crate::solver) fn parts(foot: &Projection, free: &Mat3) -> (Vec3, Vec3, f64) {
    let along = free * foot.normal;
    (along, foot.normal - along, along.norm_squared())
}

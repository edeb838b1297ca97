//! Control of a tool in an increment: travel, force, spring, or absent.

/// Control of a tool during the current increment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Role {
    /// Absent.
    Absent,
    /// Prescribed travel.
    Travel,
    /// Prescribed force along the direction [N], of the modelled part; the travel is an unknown.
    Force(f64),
    /// Spring force `force - stiffness * travel` [N, N/mm], of the modelled part; the travel is an unknown.
    Spring { force: f64, stiffness: f64 },
}

impl Role {
    /// Prescribed force at the given travel [N] of a tool with unknown travel.
    pub(crate) fn push(self, travel: f64) -> Option<f64> {
        match self {
            Self::Force(force) => Some(force),
            Self::Spring { force, stiffness } => Some(force - stiffness * travel),
            Self::Absent | Self::Travel => None,
        }
    }

    /// Decrease of the force per travel [N/mm].
    pub(crate) fn stiffness(self) -> f64 {
        if let Self::Spring { stiffness, .. } = self { stiffness } else { 0.0 }
    }
}

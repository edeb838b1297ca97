//! What drives a tool: its travel, a force, or nothing.

/// What a tool is during the present increment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::solver) enum Role {
    /// Not there.
    Absent,
    /// Stands at its travel.
    Travel,
    /// Pushes with this force along its direction [N], of the modelled part; its travel is unknown.
    Force(f64),
    /// Pushes with `force - stiffness * travel` [N, N/mm], of the modelled part; its travel is unknown.
    Spring { force: f64, stiffness: f64 },
}

impl Role {
    /// Force with which a tool whose travel is unknown is to push at that travel [N].
    pub(in crate::solver) fn push(self, travel: f64) -> Option<f64> {
        match self {
            Self::Force(force) => Some(force),
            Self::Spring { force, stiffness } => Some(force - stiffness * travel),
            Self::Absent | Self::Travel => None,
        }
    }

    /// How much less it pushes a travel of one farther on [N/mm].
    pub(in crate::solver) fn stiffness(self) -> f64 {
        if let Self::Spring { stiffness, .. } = self { stiffness } else { 0.0 }
    }
}

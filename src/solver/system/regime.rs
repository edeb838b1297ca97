//! What acts on the sheet in an iteration besides its tools and supports, and what stabilises it: the one state by which
//! iterations differ. An accepted increment has no stabilisation.

use super::damper::Damper;

/// What acts on the sheet besides tools and supports.
#[derive(Debug, Clone, Default)]
pub(in crate::solver) struct Regime {
    /// Loads of the scene act.
    pub(in crate::solver) loads: bool,
    /// Forces that released tools left behind act, which fall to zero over the stage.
    pub(in crate::solver) released_forces: bool,
    /// What stabilises the sheet.
    pub(in crate::solver) stabilisation: Stabilisation,
}

/// Viscous forces on the nodes that make an iteration stable or a free motion definite.
#[derive(Debug, Clone, Default)]
pub(in crate::solver) enum Stabilisation {
    /// None.
    #[default]
    None,
    /// Pseudo-transient continuation past a limit point or out of active-set cycling.
    Continuation {
        /// Viscous forces about the last state.
        damper: Damper,
        /// Forces that push the sheet out of an unstable equilibrium (three a node) [N].
        push: Option<Vec<f64>>,
    },
    /// Tools move an unconstrained sheet ([`crate::solver::increment::loose_sheet`]).
    LooseSheet {
        /// Light viscous forces about the last state.
        damper: Damper,
        /// Tools have their friction; otherwise none.
        friction: bool,
    },
}

impl Regime {
    /// The viscous forces, where there are any.
    pub(in crate::solver) fn damper(&self) -> Option<&Damper> {
        match &self.stabilisation {
            Stabilisation::None => None,
            Stabilisation::Continuation { damper, .. }
            | Stabilisation::LooseSheet { damper, .. } => Some(damper),
        }
    }

    /// Whether the sheet has viscous forces.
    pub(in crate::solver) fn is_stabilised(&self) -> bool {
        self.damper().is_some()
    }

    /// Whether tools move an unconstrained sheet.
    pub(in crate::solver) fn is_loose(&self) -> bool {
        matches!(self.stabilisation, Stabilisation::LooseSheet { .. })
    }

    /// Whether tools have their friction.
    pub(in crate::solver) fn has_friction(&self) -> bool {
        !matches!(self.stabilisation, Stabilisation::LooseSheet { friction: false, .. })
    }

    /// Sets viscous forces about a state, without forces that push.
    pub(in crate::solver) fn continue_with(&mut self, damper: Damper) {
        self.stabilisation = Stabilisation::Continuation { damper, push: None };
    }

    /// Removes what stabilises the sheet; the viscous forces, where there were any.
    pub(in crate::solver) fn release(&mut self) -> Option<Damper> {
        match std::mem::take(&mut self.stabilisation) {
            Stabilisation::None => None,
            Stabilisation::Continuation { damper, .. }
            | Stabilisation::LooseSheet { damper, .. } => Some(damper),
        }
    }

    /// Forces that push the sheet out of an unstable equilibrium (three a node) [N].
    pub(in crate::solver) fn push(&self) -> Option<&[f64]> {
        match &self.stabilisation {
            Stabilisation::Continuation { push, .. } => push.as_deref(),
            _ => None,
        }
    }
}

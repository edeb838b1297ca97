//! Loads and stabilisation that act on the sheet in an iteration, in addition to tools and supports. An accepted
//! increment has no stabilisation.

use super::damper::Damper;

/// Loads and stabilisation in addition to tools and supports.
#[derive(Debug, Clone, Default)]
pub(crate) struct Regime {
    /// Loads of the model act.
    pub(crate) loads: bool,
    /// Stabilisation of the sheet.
    pub(crate) stabilisation: Stabilisation,
}

/// Viscous forces on the nodes that make an iteration stable or a free motion definite.
#[derive(Debug, Clone, Default)]
pub(crate) enum Stabilisation {
    /// None.
    #[default]
    None,
    /// Pseudo-transient continuation past a limit point or out of active-set cycling.
    Continuation {
        /// Viscous forces about the last state.
        damper: Damper,
        /// Perturbation that moves the sheet out of an unstable equilibrium (three forces for each node) [N].
        push: Option<Vec<f64>>,
    },
    /// Tools move an unconstrained sheet ([`crate::increment::loose_sheet`]).
    LooseSheet {
        /// Light viscous forces about the last state.
        damper: Damper,
        /// Whether tools have friction.
        friction: bool,
    },
}

impl Regime {
    /// Viscous forces, if any.
    pub(crate) fn damper(&self) -> Option<&Damper> {
        match &self.stabilisation {
            Stabilisation::None => None,
            Stabilisation::Continuation { damper, .. }
            | Stabilisation::LooseSheet { damper, .. } => Some(damper),
        }
    }

    /// Whether viscous forces act.
    pub(crate) fn is_stabilised(&self) -> bool {
        self.damper().is_some()
    }

    /// Whether tools move an unconstrained sheet.
    pub(crate) fn is_loose(&self) -> bool {
        matches!(self.stabilisation, Stabilisation::LooseSheet { .. })
    }

    /// Whether tools have friction.
    pub(crate) fn has_friction(&self) -> bool {
        !matches!(self.stabilisation, Stabilisation::LooseSheet { friction: false, .. })
    }

    /// Sets viscous forces about a state, without perturbation.
    pub(crate) fn continue_with(&mut self, damper: Damper) {
        self.stabilisation = Stabilisation::Continuation { damper, push: None };
    }

    /// Removes the stabilisation; returns its viscous forces, if any.
    pub(crate) fn release(&mut self) -> Option<Damper> {
        match std::mem::take(&mut self.stabilisation) {
            Stabilisation::None => None,
            Stabilisation::Continuation { damper, .. }
            | Stabilisation::LooseSheet { damper, .. } => Some(damper),
        }
    }

    /// Perturbation that moves the sheet out of an unstable equilibrium (three forces for each node) [N].
    pub(crate) fn push(&self) -> Option<&[f64]> {
        match &self.stabilisation {
            Stabilisation::Continuation { push, .. } => push.as_deref(),
            _ => None,
        }
    }
}
